// SPDX-License-Identifier: MIT
// See hsh.h. With z = sin²u, sqrt(z) and sqrt(1 - z) are sin u and cos u, so that the functions are trigonometric
// polynomials in u and quadrature over u converges fast.
#include "bake/preview/hsh.h"

#include <glm/trigonometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace relume {
namespace {

using std::numbers::pi;
constexpr std::size_t kRows = 32, kColumns = 16;  // nodes in u, and in a quarter turn of phi

int hshIndex(int l, int m) { return l * l + l + m; }

std::size_t squared(std::size_t n) { return n * n; }

// rows of `matrix`, which is square, times the entries of c at `index`, times share.
void addProduct(const float* matrix, std::span<const int> index, std::span<const float> c, float share,
                std::span<float> sum) {
  std::array<float, kMaxHshCoefficients> dense{};
  const std::size_t n = index.size();
  for (std::size_t j = 0; j < n; ++j) dense[j] = share * c[static_cast<std::size_t>(index[j])];
  for (std::size_t i = 0; i < n; ++i) {
    float row = 0.0f;
    for (std::size_t j = 0; j < n; ++j) row += matrix[i * n + j] * dense[j];
    sum[static_cast<std::size_t>(index[i])] += row;
  }
}

}  // namespace

void evaluateHsh(int order, const glm::dvec3& d, std::span<double> h) {
  // P_m^m has the factor sqrt(1 - x²)^m of x = 2 z - 1: with cos phi and sin phi a power of 2 sqrt(z / (1 + z)) (x, y),
  // which needs no angle at the pole. P_l^m then follows by the recurrence in l, all of them normalised.
  const double z = std::clamp(d.z, 0.0, 1.0), x = 2.0 * z - 1.0, radius = 2.0 * std::sqrt(z / (1.0 + z));
  const double stepX = radius * d.x, stepY = radius * d.y;
  double cosine = 1.0, sine = 0.0, diagonal = std::sqrt(0.5 / pi);
  for (int m = 0; m < order; ++m) {
    if (m > 0) {
      const double c = cosine * stepX - sine * stepY;
      sine = sine * stepX + cosine * stepY;
      cosine = c;
      diagonal *= std::sqrt((2.0 * m + 1.0) / (2.0 * m));
    }
    double before = 0.0, p = m > 0 ? std::numbers::sqrt2 * diagonal : diagonal;
    for (int l = m; l < order; ++l) {
      if (m > 0) h[static_cast<std::size_t>(hshIndex(l, -m))] = p * sine;
      h[static_cast<std::size_t>(hshIndex(l, m))] = p * cosine;
      const double k = l + 1.0;
      const double next = std::sqrt((4.0 * k * k - 1.0) / (k * k - m * m)) *
                          (x * p - std::sqrt((l * l - m * m) / (4.0 * l * l - 1.0)) * before);
      before = p;
      p = next;
    }
  }
}

void turnHsh(int order, float cosPsi, float sinPsi, std::span<float> c) {
  float cosine = 1.0f, sine = 0.0f;
  for (int m = 1; m < order; ++m) {
    const float next = cosine * cosPsi - sine * sinPsi;
    sine = sine * cosPsi + cosine * sinPsi;
    cosine = next;
    for (int l = m; l < order; ++l) {
      float &a = c[static_cast<std::size_t>(hshIndex(l, m))], &b = c[static_cast<std::size_t>(hshIndex(l, -m))];
      const float turned = a * cosine + b * sine;
      b = b * cosine - a * sine;
      a = turned;
    }
  }
}

HshTilt::HshTilt(int order, int maxDeg) : order_(order), maxDeg_(std::clamp(maxDeg, 0, 90)) {
  for (int l = 0; l < order; ++l) {
    for (int m = -l; m <= l; ++m) (m < 0 ? odd_ : even_).push_back(hshIndex(l, m));
  }
  tables_.assign((static_cast<std::size_t>(maxDeg_) + 1) * (squared(even_.size()) + squared(odd_.size())), 0.0f);
  for (int deg = 0; deg <= maxDeg_; ++deg) makeTable(deg);
}

// The shared half, quarter by quarter of phi, from the higher of the two horizons to the pole; both halves of phi give
// the same.
void HshTilt::makeTable(int deg) {
  const double beta = glm::radians(static_cast<double>(deg)), cosBeta = std::cos(beta), sinBeta = std::sin(beta);
  const std::size_t evens = even_.size(), odds = odd_.size();
  std::vector<double> sums(squared(evens) + squared(odds), 0.0);
  std::array<double, kMaxHshCoefficients> here{}, there{};
  std::array<double, kColumns> phi{}, phiWeight{};
  std::array<double, kRows> u{}, uWeight{};
  for (int quarter = 0; quarter < 2; ++quarter) {
    gaussLegendre(0.5 * pi * quarter, 0.5 * pi * (quarter + 1), phi, phiWeight);
    for (std::size_t column = 0; column < kColumns; ++column) {
      const double cosPhi = std::cos(phi[column]), sinPhi = std::sin(phi[column]);
      // The first frame's z of a direction is cos beta z - sin beta cos phi sqrt(1 - z²), at least 0.
      const double slope = sinBeta * cosPhi / std::max(cosBeta, 1e-12);
      const double lowest = slope > 0.0 ? slope / std::sqrt(1.0 + slope * slope) : 0.0;
      gaussLegendre(std::asin(std::sqrt(lowest)), 0.5 * pi, u, uWeight);
      for (std::size_t row = 0; row < kRows; ++row) {
        const double z = std::sin(u[row]) * std::sin(u[row]), r = std::sqrt(1.0 - z * z);
        const glm::dvec3 d(r * cosPhi, r * sinPhi, z);
        evaluateHsh(order_, d, here);
        evaluateHsh(order_, {cosBeta * d.x + sinBeta * d.z, d.y, cosBeta * d.z - sinBeta * d.x}, there);
        const double weight = 2.0 * phiWeight[column] * uWeight[row] * std::sin(2.0 * u[row]);
        double* sum = sums.data();
        for (const std::vector<int>* block : {&even_, &odd_}) {
          for (const int i : *block) {
            const double share = weight * here[static_cast<std::size_t>(i)];
            for (const int j : *block) *sum++ += share * there[static_cast<std::size_t>(j)];
          }
        }
      }
    }
  }
  std::transform(sums.begin(), sums.end(),
                 tables_.begin() + static_cast<std::ptrdiff_t>(deg) * static_cast<std::ptrdiff_t>(sums.size()),
                 [](double value) { return static_cast<float>(value); });
}

void HshTilt::apply(float angleRad, std::span<const float> c, std::span<float> tilted) const {
  const float deg = std::clamp(glm::degrees(angleRad), 0.0f, static_cast<float>(maxDeg_));
  const auto low = static_cast<std::size_t>(deg);
  const float share = deg - static_cast<float>(low);
  const std::size_t evens = squared(even_.size()), stride = evens + squared(odd_.size());
  std::fill_n(tilted.begin(), even_.size() + odd_.size(), 0.0f);
  for (std::size_t table = low; table <= low + (share > 0.0f ? 1 : 0); ++table) {
    const float weight = table == low ? 1.0f - share : share;
    addProduct(&tables_[table * stride], even_, c, weight, tilted);
    addProduct(tables_.data() + table * stride + evens, odd_, c, weight, tilted);
  }
}

void gaussLegendre(double low, double high, std::span<double> nodes, std::span<double> weights) {
  const std::size_t n = nodes.size();
  for (std::size_t i = 0; i < n; ++i) {
    // Newton's method from a close guess, on P_n and its derivative.
    double x = std::cos(pi * (static_cast<double>(i) + 0.75) / (static_cast<double>(n) + 0.5)), derivative = 1.0;
    for (int step = 0; step < 8; ++step) {
      double before = 1.0, p = x;
      for (std::size_t k = 2; k <= n; ++k) {
        const double degree = static_cast<double>(k);
        const double next = ((2.0 * degree - 1.0) * x * p - (degree - 1.0) * before) / degree;
        before = p;
        p = next;
      }
      derivative = static_cast<double>(n) * (x * p - before) / (x * x - 1.0);
      x -= p / derivative;
    }
    nodes[i] = 0.5 * (low + high) - 0.5 * (high - low) * x;
    weights[i] = (high - low) / ((1.0 - x * x) * derivative * derivative);
  }
}

}  // namespace relume
