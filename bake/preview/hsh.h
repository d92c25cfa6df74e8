// SPDX-License-Identifier: MIT
// Hemispherical harmonics: Gautron, Krivanek, Pattanaik, Bouatouch, "A Novel Hemispherical Basis for Accurate and
// Efficient Rendering", EGSR 2004 (GKPB04). Radiance records keep what arrives at a surface in them (RCS 4.1).
//
//   H_l^m = sqrt(2) K cos(m phi) Q_l^m(z) for m > 0, K Q_l^0 for m = 0, sqrt(2) K sin(-m phi) Q_l^-m(z) for m < 0
//   Q_l^m(z) = P_l^m(2 z - 1), K = sqrt((2 l + 1) (l - |m|)! / (2 pi (l + |m|)!)), z the cosine with the normal
//
// Orthonormal over the hemisphere about +Z; H_l^m has index l*l + l + m, and no Condon-Shortley sign. Where m is not 0
// they vanish at the horizon. Pure functions, any thread.
#pragma once

#include <glm/vec3.hpp>

#include <span>
#include <vector>

namespace relume {

inline constexpr int kMaxHshOrder = 10;
inline constexpr int kMaxHshCoefficients = kMaxHshOrder * kMaxHshOrder;

// The order * order values in unit direction d; a direction below the horizon counts as on it. [order 1..kMaxHshOrder]
// [Size h >= order²]
void evaluateHsh(int order, const glm::dvec3& d, std::span<double> h);

// Coefficients of the same function in a frame whose +X lies at the angle psi from +X about +Z, in place. Exact.
// [Size c >= order²]
void turnHsh(int order, float cosPsi, float sinPsi, std::span<float> c);

// Functions in a frame that is tilted about +Y, so that its +Z is (sin beta, 0, cos beta):
//   c'_i = sum over j of M_ij(beta) c_j, M_ij = Int H_i(w) H_j(R w) dw over the half that both frames share
// From below the first frame's horizon there is nothing. M by tables at whole degrees, and linear between them.
class HshTilt {
 public:
  // [order 1..kMaxHshOrder] maxDeg [0..90] the largest angle
  HshTilt(int order, int maxDeg);

  // Angles beyond the largest are read at it. `c` and `tilted` must not overlap. [angleRad >= 0] [Size order²]
  void apply(float angleRad, std::span<const float> c, std::span<float> tilted) const;
  int order() const { return order_; }
  int maxDeg() const { return maxDeg_; }
  // The matrices of each whole degree, row by row: of the functions of m >= 0, by l, then m, then of the others.
  std::span<const float> tables() const { return tables_; }

 private:
  void makeTable(int deg);

  int order_, maxDeg_;
  // Functions that are even in phi (m >= 0) do not mix with those that are odd: indices of either, and the matrices of
  // a degree one after the other.
  std::vector<int> even_, odd_;
  std::vector<float> tables_;
};

// Nodes and weights of Gauss and Legendre's rule over [low, high]. [Size nodes = weights]
void gaussLegendre(double low, double high, std::span<double> nodes, std::span<double> weights);

}  // namespace relume
