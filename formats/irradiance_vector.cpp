// SPDX-License-Identifier: MIT
// Vectors from spherical harmonics by a table of integrals, from cones by their outlines, and their packing. See
// irradiance_vector.h.
#include "formats/irradiance_vector.h"

#include "formats/color.h"
#include "formats/pack.h"
#include "formats/sh.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kStride = kMaxCoefficients;
using Factors = std::array<float, 9 * kStride>;

// Nodes on 0..1 and weights of Gauss-Legendre quadrature: exact for polynomials of degree 2 n - 1. Newton's method on
// P_n from Chebyshev's guess.
template <std::size_t n>
std::array<std::pair<double, double>, n> gaussLegendre() {
  std::array<std::pair<double, double>, n> nodes;
  for (std::size_t k = 0; k < n; ++k) {
    double x = std::cos(std::numbers::pi * (static_cast<double>(k) + 0.75) / (static_cast<double>(n) + 0.5)),
           slope = 0.0;
    for (int step = 0; step < 20; ++step) {
      double before = 1.0, p = x;
      for (std::size_t l = 1; l < n; ++l) {
        const auto degree = static_cast<double>(l);
        before = std::exchange(p, ((2.0 * degree + 1.0) * x * p - degree * before) / (degree + 1.0));
      }
      slope = static_cast<double>(n) * (x * p - before) / (x * x - 1.0);
      x -= p / slope;
    }
    nodes[k] = {0.5 * (1.0 + x), 1.0 / ((1.0 - x * x) * slope * slope)};
  }
  return nodes;
}

// Integrals of y_i(w) w_b over the half w_a > 0. With the axis a as pole the integrand is a polynomial of degree 8 in
// the cosine once the azimuth is integrated, which both rules integrate exactly.
Factors makeFactors() {
  constexpr std::size_t kNodes = 8, kTurns = 32;
  const auto nodes = gaussLegendre<kNodes>();
  std::array<double, 9 * kStride> sum{};
  for (std::size_t a = 0; a < 3; ++a) {
    for (const auto& [cosine, weight] : nodes) {
      const double sine = std::sqrt(1.0 - cosine * cosine);
      for (std::size_t turn = 0; turn < kTurns; ++turn) {
        const double phi = 2.0 * std::numbers::pi * (static_cast<double>(turn) + 0.5) / kTurns;
        std::array<double, 3> w;
        w[a] = cosine;
        w[(a + 1) % 3] = sine * std::cos(phi);
        w[(a + 2) % 3] = sine * std::sin(phi);
        std::array<float, kStride> y;
        evaluateSh(kMaxBands, glm::vec3(w[0], w[1], w[2]), y);
        for (std::size_t b = 0; b < 3; ++b) {
          const double factor = weight * 2.0 * std::numbers::pi / kTurns * w[b];
          for (std::size_t i = 0; i < kStride; ++i)
            sum[(3 * a + b) * kStride + i] += factor * static_cast<double>(y[i]);
        }
      }
    }
  }
  // What symmetry makes zero is zero.
  Factors factors;
  std::transform(sum.begin(), sum.end(), factors.begin(),
                 [](double s) { return std::abs(s) < 1e-6 ? 0.0f : static_cast<float>(s); });
  return factors;
}

}  // namespace

std::span<const float> vectorFactors() {
  static const Factors factors = makeFactors();
  return factors;
}

SixVectors vectorsFromSh(int bands, std::span<const float> c) {
  const std::span<const float> factors = vectorFactors();
  SixVectors vectors;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = 0; b < 3; ++b) {
      const float* row = factors.data() + (3 * a + b) * kStride;
      float even = 0.0f, odd = 0.0f;
      for (int l = 0; l < bands; ++l) {
        // Of the odd bands the first alone has a vector.
        if (l % 2 == 1 && l > 1) continue;
        float sum = 0.0f;
        for (auto i = static_cast<std::size_t>(l * l); i < static_cast<std::size_t>((l + 1) * (l + 1)); ++i)
          sum += row[i] * c[i];
        (l % 2 == 0 ? even : odd) += sum;
      }
      vectors[2 * a][static_cast<int>(b)] = odd + even;
      vectors[2 * a + 1][static_cast<int>(b)] = odd - even;
    }
  }
  return vectors;
}

glm::vec3 axisParts(const std::array<glm::vec3, 3>& halves, const glm::vec3& n, DirectionWeights weights,
                    float crossWeight) {
  glm::vec3 parts;
  for (int a = 0; a < 3; ++a) {
    const glm::vec3& vector = halves[static_cast<std::size_t>(a)];
    float bracket = glm::dot(n, vector);
    if (weights == DirectionWeights::corrected) {
      const float own = n[a] * vector[a];
      bracket = (n[a] < 0.0f ? -vector[a] : vector[a]) + crossWeight * (bracket - own);
    }
    parts[a] = n[a] * n[a] * bracket;
  }
  return parts;
}

float irradianceFromVectors(const SixVectors& vectors, const glm::vec3& n, DirectionWeights weights,
                            float crossWeight) {
  const glm::vec3 parts =
      axisParts({vectors[halfOf(n, 0)], vectors[halfOf(n, 1)], vectors[halfOf(n, 2)]}, n, weights, crossWeight);
  return parts.x + parts.y + parts.z;
}

void addCone(SixVectors& vectors, const glm::vec3& direction, float cosAlpha, float radiance) {
  cosAlpha = std::clamp(cosAlpha, 0.0f, 1.0f);
  const float sin2 = 1.0f - cosAlpha * cosAlpha, sine = std::sqrt(sin2);
  const glm::vec3 whole = static_cast<float>(std::numbers::pi) * sin2 * direction;
  for (int a = 0; a < 3; ++a) {
    const float s = std::clamp(direction[a], -1.0f, 1.0f), t = std::sqrt(std::max(1.0f - s * s, 0.0f));
    // cos of the azimuth at which the outline crosses the plane, from the side that is away from the axis.
    const float x = s * cosAlpha, reach = t * sine;
    glm::vec3 above = s > 0.0f && x >= reach ? whole : glm::vec3(0.0f);
    if (std::abs(x) < reach) {
      const float phi = std::acos(-x / reach), crossing = std::sin(phi) * sine;
      const float chord = std::atan2(crossing * t, cosAlpha);
      // The axis is s d + t u: what is along u joins d and the axis.
      glm::vec3 u = -s * direction;
      u[a] += 1.0f;
      above = (phi * sin2 + chord * s) * direction + (chord * t - crossing * cosAlpha) / t * u;
    }
    vectors[static_cast<std::size_t>(2 * a)] += radiance * above;
    vectors[static_cast<std::size_t>(2 * a + 1)] += radiance * (whole - above);
  }
}

ColorVector makeColorVector(std::size_t half, const glm::vec3& luma, const glm::vec3& co, const glm::vec3& cg) {
  const int a = static_cast<int>(half / 2);
  const float sign = half % 2 == 0 ? 1.0f : -1.0f;
  return {luma, sign * co[a], sign * cg[a]};
}

glm::vec3 irradianceYCoCg(const std::array<ColorVector, 3>& halves, const glm::vec3& n) {
  const glm::vec3 parts = axisParts({halves[0].luma, halves[1].luma, halves[2].luma}, n);
  glm::vec3 axes(0.0f);
  for (int a = 0; a < 3; ++a) {
    const ColorVector& half = halves[static_cast<std::size_t>(a)];
    axes += n[a] * n[a] * glm::vec3(n[a] < 0.0f ? -half.luma[a] : half.luma[a], half.axisCo, half.axisCg);
  }
  const float y = parts.x + parts.y + parts.z;
  if (!(axes.x > 0.0f)) return {y, 0.0f, 0.0f};
  return {y, y * std::clamp(axes.y / axes.x, -2.0f, 2.0f), y * std::clamp(axes.z / axes.x, -1.0f, 1.0f)};
}

std::uint16_t packClampedHalf(float value) {
  if (value != value) return 0;
  return packHalf(std::clamp(value, -kMaxHalf, kMaxHalf));
}

std::array<std::uint16_t, 6> packVectors(VectorPacking packing, std::size_t half, const std::array<glm::vec3, 3>& rgb,
                                         float share) {
  if (packing == VectorPacking::printed) {
    const glm::vec3 sum = rgb[0] + rgb[1] + rgb[2];
    const float length = glm::length(sum);
    const glm::vec3 d = length > 0.0f ? sum / length : glm::vec3(0.0f);
    return {packClampedHalf(glm::length(rgb[0])),
            packClampedHalf(glm::length(rgb[1])),
            packClampedHalf(glm::length(rgb[2])),
            packClampedHalf(d.x),
            packClampedHalf(d.y),
            packClampedHalf(d.z)};
  }
  std::array<glm::vec3, 3> channels;  // Y, Co, Cg
  for (int b = 0; b < 3; ++b) {
    const glm::vec3 c = rgbToYCoCg({rgb[0][b], rgb[1][b], rgb[2][b]});
    for (std::size_t k = 0; k < 3; ++k) channels[k][b] = c[static_cast<int>(k)];
  }
  const ColorVector color = makeColorVector(half, channels[0], channels[1], channels[2]);
  return {packClampedHalf(color.luma.x), packClampedHalf(color.luma.y), packClampedHalf(color.luma.z),
          packClampedHalf(share),        packClampedHalf(color.axisCo), packClampedHalf(color.axisCg)};
}

std::array<glm::vec3, 3> unpackVectors(VectorPacking packing, std::size_t half,
                                       const std::array<std::uint16_t, 6>& packed) {
  std::array<float, 6> v;
  std::transform(packed.begin(), packed.end(), v.begin(), unpackHalf);
  if (packing == VectorPacking::printed) {
    const glm::vec3 d(v[3], v[4], v[5]);
    return {v[0] * d, v[1] * d, v[2] * d};
  }
  const glm::vec3 luma(v[0], v[1], v[2]);
  const float axis = half % 2 == 0 ? luma[static_cast<int>(half / 2)] : -luma[static_cast<int>(half / 2)];
  if (!(axis > 0.0f)) return {luma, luma, luma};
  const glm::vec3 gain = yCoCgToRgb({1.0f, v[4] / axis, v[5] / axis});
  return {gain.r * luma, gain.g * luma, gain.b * luma};
}

}  // namespace relume
