// SPDX-License-Identifier: MIT
// Real spherical harmonics by recurrence, and the band factors of cones and cosine lobes. See sh.h.
#include "formats/sh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include <glm/geometric.hpp>

namespace relume {
namespace {

constexpr double kPi = std::numbers::pi;

// K_l^m = sqrt((2l+1)/(4 pi) (l-m)!/(l+m)!), times sqrt(2) for m > 0; index l*8 + m.
std::array<float, 64> makeNormalisation() {
  std::array<float, 64> k{};
  for (int l = 0; l < kMaxBands; ++l) {
    for (int m = 0; m <= l; ++m) {
      double ratio = 1.0;
      for (int i = l - m + 1; i <= l + m; ++i) ratio /= i;
      k[static_cast<std::size_t>(l * 8 + m)] =
          static_cast<float>(std::sqrt((2 * l + 1) / (4 * kPi) * ratio) * (m > 0 ? std::numbers::sqrt2 : 1.0));
    }
  }
  return k;
}

const std::array<float, 64> kNormalisation = makeNormalisation();

constexpr std::array<float, kMaxBands> kCosine = {static_cast<float>(kPi),       static_cast<float>(2 * kPi / 3),
                                                  static_cast<float>(kPi / 4),   0.0f,
                                                  static_cast<float>(-kPi / 24), 0.0f,
                                                  static_cast<float>(kPi / 64),  0.0f};

// Four bands, what the baker evaluates for every ray, written out: no divisions.
void evaluateFourBands(const glm::vec3& d, std::span<float> y) {
  const float x2 = d.x * d.x, y2 = d.y * d.y, z2 = d.z * d.z, five = 5.0f * z2 - 1.0f;
  y[0] = 0.28209479177387814f;
  y[1] = 0.48860251190291992f * d.y;
  y[2] = 0.48860251190291992f * d.z;
  y[3] = 0.48860251190291992f * d.x;
  y[4] = 1.0925484305920791f * d.x * d.y;
  y[5] = 1.0925484305920791f * d.y * d.z;
  y[6] = 0.31539156525252000f * (3.0f * z2 - 1.0f);
  y[7] = 1.0925484305920791f * d.x * d.z;
  y[8] = 0.54627421529603953f * (x2 - y2);
  y[9] = 0.59004358992664351f * d.y * (3.0f * x2 - y2);
  y[10] = 2.8906114426405540f * d.x * d.y * d.z;
  y[11] = 0.45704579946446574f * d.y * five;
  y[12] = 0.37317633259011540f * d.z * (five - 2.0f);
  y[13] = 0.45704579946446574f * d.x * five;
  y[14] = 1.4453057213202770f * d.z * (x2 - y2);
  y[15] = 0.59004358992664351f * d.x * (x2 - 3.0f * y2);
}

}  // namespace

void evaluateSh(int bands, const glm::vec3& d, std::span<float> y) {
  if (bands == 4) return evaluateFourBands(d, y);
  // Walk the orders m. (c, s) are Re and Im of (x + i y)^m; p walks the associated Legendre functions divided by
  // sin^m, so that nothing is singular at the poles.
  float c = 1.0f, s = 0.0f;
  float pmm = 1.0f;  // P_m^m / sin^m without the Condon-Shortley sign: (2m-1)!!
  for (int m = 0; m < bands; ++m) {
    float previous = 0.0f, p = pmm;
    for (int l = m; l < bands; ++l) {
      const float k = kNormalisation[static_cast<std::size_t>(l * 8 + m)] * p;
      const auto centre = static_cast<std::size_t>(l * l + l), order = static_cast<std::size_t>(m);
      if (m == 0) {
        y[centre] = k;
      } else {
        y[centre + order] = k * c;
        y[centre - order] = k * s;
      }
      const float next = (static_cast<float>(2 * l + 1) * d.z * p - static_cast<float>(l + m) * previous) /
                         static_cast<float>(l + 1 - m);
      previous = p;
      p = next;
    }
    const float t = c * d.x - s * d.y;
    s = c * d.y + s * d.x;
    c = t;
    pmm *= static_cast<float>(2 * m + 1);
  }
}

void coneBandRatios(int bands, float cosAlpha, std::span<float> ratio) {
  // Z_l / Z_0 with the common factor (1 - c) cancelled: stable for the narrowest cones.
  const float c = cosAlpha, c2 = c * c, c4 = c2 * c2, u = 1.0f + c;
  const std::array<float, kMaxBands> all = {
      1.0f,
      u * 0.5f,
      c * u * 0.5f,
      u * (5.0f * c2 - 1.0f) * 0.125f,
      c * u * (7.0f * c2 - 3.0f) * 0.125f,
      u * (21.0f * c4 - 14.0f * c2 + 1.0f) * 0.0625f,
      c * u * (33.0f * c4 - 30.0f * c2 + 5.0f) * 0.0625f,
      u * (429.0f * c4 * c2 - 495.0f * c4 + 135.0f * c2 - 5.0f) * 0.0078125f,
  };
  std::copy_n(all.begin(), bands, ratio.begin());
}

std::span<const float> clampedCosineFactors() { return kCosine; }

void cosineLobeFactors(int bands, float n, std::span<float> s) {
  s[0] = 1.0f;
  if (bands > 1) s[1] = (n + 1.0f) / (n + 2.0f);
  for (std::size_t l = 2; l < static_cast<std::size_t>(bands); ++l)
    s[l] = s[l - 2] * (n + 2.0f - static_cast<float>(l)) / (n + 1.0f + static_cast<float>(l));
}

float irradianceClamped(int bands, std::span<const float> c, const glm::vec3& n) {
  std::array<float, kMaxCoefficients> y;
  evaluateSh(bands, n, y);
  float e = 0.0f;
  for (std::size_t l = 0; l < static_cast<std::size_t>(bands); ++l) {
    float band = 0.0f;
    for (std::size_t i = l * l; i < (l + 1) * (l + 1); ++i) band += c[i] * y[i];
    e += kCosine[l] * band;
  }
  return e;
}

float irradianceLinear(std::span<const float> c, const glm::vec3& n) {
  constexpr float kFactor = static_cast<float>(4 * kPi / 3 * 0.48860251190291992);
  return kFactor * (c[1] * n.y + c[2] * n.z + c[3] * n.x);
}

float zonalIrradiance(float c0, const glm::vec3& linear, const glm::vec3& n) {
  // Squares of bright light would overflow: the vector is measured in its largest component.
  const float largest = std::max({std::abs(linear.x), std::abs(linear.y), std::abs(linear.z)});
  if (!(c0 > 0.0f) || !(largest > 0.0f)) return 0.0f;
  const glm::vec3 axis = linear / largest;
  const float length2 = glm::dot(axis, axis), along = glm::dot(axis, n);
  // A single direction has ratio sqrt(3) and zonal coefficient sqrt(5) c_0; no light has more. Deviation: the paper's
  // fit, (0.08 + 0.6 ratio) ratio, stays 13 % below that and is worse on Sponza and Cornell, where the slope at 0 comes
  // from.
  const float ratio = std::min(std::sqrt(length2) * (largest / c0), 1.7320508f);
  const float zonal = c0 * (0.9474243f * ratio - 0.35f) * ratio;
  const float cosine2 = std::min(along * along / length2, 1.0f);
  // A_2 sqrt(5 / (16 pi)) (3 cos² - 1)
  return 0.24770796f * zonal * (3.0f * cosine2 - 1.0f);
}

float irradianceAtSurface(int bands, std::span<const float> c, const glm::vec3& n, const glm::vec3& cacheNormal) {
  const float present = glm::dot(cacheNormal, cacheNormal);
  if (bands < 2) return (1.0f + present) * irradianceClamped(bands, c, n);
  const SurfaceLobe lobe = present > 0.0f ? surfaceLobe(glm::dot(n, cacheNormal)) : SurfaceLobe{};
  float e = 0.0f;
  if (lobe.linear > 0.0f) e += lobe.linear * irradianceLinear(c, n);
  if (lobe.clamped > 0.0f) e += lobe.clamped * irradianceClamped(bands, c, n);
  return e;
}

float surfaceBlend(float cosine) {
  const float t = std::clamp((cosine - 0.95f) / (0.995f - 0.95f), 0.0f, 1.0f);
  return t * t * (3.0f - 2.0f * t);
}

SurfaceLobe surfaceLobe(float cosine, float geometricCosine) {
  const float blend = surfaceBlend(cosine);
  return {blend / std::max(geometricCosine, 0.95f), (1.0f - blend) * 2.0f / (1.0f + std::max(geometricCosine, 0.0f))};
}

}  // namespace relume
