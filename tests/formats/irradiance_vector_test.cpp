// SPDX-License-Identifier: MIT
// Irradiance vectors against quadrature and closed forms, in the form of IVG's print and in the one that is used.
#include "formats/irradiance_vector.h"

#include "formats/color.h"
#include "formats/pack.h"
#include "formats/sh.h"

#include "tests/formats/random_direction.h"

#include <gtest/gtest.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

namespace relume {
namespace {

glm::vec3 axis(int half) {
  glm::vec3 d(0.0f);
  d[half / 2] = half % 2 == 0 ? 1.0f : -1.0f;
  return d;
}

std::array<float, kMaxCoefficients> randomCoefficients(std::mt19937& rng) {
  std::normal_distribution<float> gauss;
  std::array<float, kMaxCoefficients> c;
  for (float& value : c) value = gauss(rng);
  return c;
}

// Light from one direction of irradiance 1 on a plane that faces it.
SixVectors lightFrom(const glm::vec3& d) {
  SixVectors vectors{};
  for (int half = 0; half < 6; ++half) {
    if (glm::dot(axis(half), d) > 0.0f) vectors[static_cast<std::size_t>(half)] = d;
  }
  return vectors;
}

SixVectors uniformLight() {
  SixVectors vectors{};
  for (int half = 0; half < 6; ++half) vectors[static_cast<std::size_t>(half)] = std::numbers::pi_v<float> * axis(half);
  return vectors;
}

// Vectors of a radiance by quadrature: midpoints in the cosine to an axis and in the azimuth.
SixVectors integrate(const std::function<double(const glm::dvec3&)>& radiance, int steps = 600) {
  std::array<glm::dvec3, 6> sum{};
  const int turns = 2 * steps;
  for (int i = 0; i < steps; ++i) {
    const double z = -1.0 + 2.0 * (i + 0.5) / steps, r = std::sqrt(1.0 - z * z);
    for (int j = 0; j < turns; ++j) {
      const double phi = 2.0 * std::numbers::pi * (j + 0.5) / turns;
      const glm::dvec3 w(r * std::cos(phi), r * std::sin(phi), z);
      const glm::dvec3 part = radiance(w) * w;
      for (int a = 0; a < 3; ++a) sum[static_cast<std::size_t>(2 * a + (w[a] < 0.0 ? 1 : 0))] += part;
    }
  }
  SixVectors vectors;
  for (std::size_t half = 0; half < 6; ++half)
    vectors[half] = glm::vec3(sum[half] * (4.0 * std::numbers::pi / steps / turns));
  return vectors;
}

TEST(IrradianceVector, factorsAgreeWithQuadrature) {
  // Quadrature of its own, exact for polynomials: the trapezoid in the azimuth, and Simpson's rule of many steps in the
  // cosine, whose integrand has degree 8 at most.
  const auto factors = vectorFactors();
  ASSERT_EQ(factors.size(), std::size_t{9 * kMaxCoefficients});
  constexpr int kSteps = 400, kTurns = 24;
  std::array<std::array<double, kMaxCoefficients>, 9> sum{};
  for (int a = 0; a < 3; ++a) {
    for (int i = 0; i <= kSteps; ++i) {
      const double z = static_cast<double>(i) / kSteps, r = std::sqrt(1.0 - z * z);
      const double simpson = (i == 0 || i == kSteps ? 1.0 : (i % 2 == 1 ? 4.0 : 2.0)) / (3.0 * kSteps);
      for (int j = 0; j < kTurns; ++j) {
        const double phi = 2.0 * std::numbers::pi * j / kTurns;
        glm::dvec3 w;
        w[a] = z, w[(a + 1) % 3] = r * std::cos(phi), w[(a + 2) % 3] = r * std::sin(phi);
        std::array<float, kMaxCoefficients> y;
        evaluateSh(kMaxBands, glm::vec3(w), y);
        for (int b = 0; b < 3; ++b) {
          for (std::size_t k = 0; k < kMaxCoefficients; ++k) {
            sum[static_cast<std::size_t>(3 * a + b)][k] +=
                simpson * 2.0 * std::numbers::pi / kTurns * static_cast<double>(y[k]) * w[b];
          }
        }
      }
    }
  }
  for (std::size_t row = 0; row < 9; ++row) {
    for (std::size_t k = 0; k < kMaxCoefficients; ++k)
      EXPECT_NEAR(factors[row * kMaxCoefficients + k], sum[row][k], 1e-6) << "row " << row << " coefficient " << k;
  }
}

TEST(IrradianceVector, oppositeHalvesAddUpToTheSameVectorForAllAxes) {
  std::mt19937 rng(1);
  for (int trial = 0; trial < 50; ++trial) {
    for (int bands = 1; bands <= kMaxBands; ++bands) {
      const auto c = randomCoefficients(rng);
      const SixVectors v = vectorsFromSh(bands, c);
      const glm::vec3 x = v[0] + v[1], y = v[2] + v[3], z = v[4] + v[5];
      EXPECT_LT(glm::length(x - y), 2e-5f);
      EXPECT_LT(glm::length(x - z), 2e-5f);
      // Which is band 1: Int L w dw.
      const float factor = bands > 1 ? std::sqrt(4.0f * std::numbers::pi_v<float> / 3.0f) : 0.0f;
      EXPECT_LT(glm::length(x - factor * glm::vec3(c[3], c[1], c[2])), 2e-5f);
    }
  }
}

TEST(IrradianceVector, atTheAxesIsTheClampedCosineOfAnyBands) {
  std::mt19937 rng(2);
  for (int trial = 0; trial < 50; ++trial) {
    const auto c = randomCoefficients(rng);
    for (int bands = 1; bands <= kMaxBands; ++bands) {
      const SixVectors v = vectorsFromSh(bands, c);
      for (int half = 0; half < 6; ++half) {
        const float expected = irradianceClamped(bands, c, axis(half));
        for (const DirectionWeights weights : {DirectionWeights::corrected, DirectionWeights::printed})
          EXPECT_NEAR(irradianceFromVectors(v, axis(half), weights), expected, 3e-5f) << bands << " bands";
      }
    }
  }
}

TEST(IrradianceVector, fromShIsTheVectorOfTheSeries) {
  std::mt19937 rng(3);
  const auto c = randomCoefficients(rng);
  const SixVectors expected = integrate([&](const glm::dvec3& w) {
    std::array<float, kMaxCoefficients> y;
    evaluateSh(5, glm::vec3(w), y);
    double sum = 0.0;
    for (std::size_t i = 0; i < 25; ++i) sum += static_cast<double>(y[i]) * static_cast<double>(c[i]);
    return sum;
  });
  const SixVectors v = vectorsFromSh(5, c);
  for (std::size_t half = 0; half < 6; ++half) EXPECT_LT(glm::length(v[half] - expected[half]), 2e-3f);
}

TEST(IrradianceVector, uniformLightIsPiForAnyNormalAndThePrintLosesThreeQuartersOfIt) {
  std::mt19937 rng(4);
  const SixVectors v = uniformLight();
  const std::array<float, 1> c{1.0f / 0.28209479f};
  const SixVectors fromSh = vectorsFromSh(1, c);
  for (std::size_t half = 0; half < 6; ++half) EXPECT_LT(glm::length(v[half] - fromSh[half]), 1e-5f);
  for (int k = 0; k < 500; ++k) {
    const glm::vec3 n = randomDirection(rng);
    EXPECT_NEAR(irradianceFromVectors(v, n), std::numbers::pi_v<float>, 1e-5f);
    const glm::vec3 m = glm::abs(n);
    EXPECT_NEAR(irradianceFromVectors(v, n, DirectionWeights::printed),
                std::numbers::pi_v<float> * (m.x * m.x * m.x + m.y * m.y * m.y + m.z * m.z * m.z), 1e-5f);
  }
  const glm::vec3 diagonal(std::sqrt(1.0f / 3.0f));
  EXPECT_NEAR(irradianceFromVectors(v, diagonal, DirectionWeights::printed),
              std::numbers::pi_v<float> / std::sqrt(3.0f), 1e-5f);
}

TEST(IrradianceVector, lightFromOneDirectionIsExactAtTheAxes) {
  std::mt19937 rng(5);
  for (int k = 0; k < 200; ++k) {
    const glm::vec3 d = randomDirection(rng);
    const SixVectors v = lightFrom(d);
    for (int half = 0; half < 6; ++half)
      EXPECT_FLOAT_EQ(irradianceFromVectors(v, axis(half)), std::max(glm::dot(axis(half), d), 0.0f));
  }
}

// A lamp that fills the half above z: E(n) = pi (1 + n_z) / 2, with closed vectors.
TEST(IrradianceVector, aLitHalfIsNearItsFormFactor) {
  const SixVectors v = integrate([](const glm::dvec3& w) { return w.z > 0.0 ? 1.0 : 0.0; });
  EXPECT_LT(glm::length(v[4] - glm::vec3(0, 0, std::numbers::pi_v<float>)), 1e-4f);
  EXPECT_LT(glm::length(v[5]), 1e-6f);
  EXPECT_LT(glm::length(v[0] - glm::vec3(std::numbers::pi_v<float> / 2, 0, std::numbers::pi_v<float> / 2)), 1e-4f);
  std::mt19937 rng(6);
  double square = 0.0, error = 0.0, printedError = 0.0;
  for (int k = 0; k < 4000; ++k) {
    const glm::vec3 n = randomDirection(rng);
    const double truth = 0.5 * std::numbers::pi * (1.0 + static_cast<double>(n.z));
    const double e = static_cast<double>(irradianceFromVectors(v, n)) - truth;
    const double p = static_cast<double>(irradianceFromVectors(v, n, DirectionWeights::printed)) - truth;
    square += truth * truth, error += e * e, printedError += p * p;
  }
  EXPECT_LT(std::sqrt(error / square), 0.025);
  EXPECT_GT(std::sqrt(printedError / square), 0.15);
}

// For many directions and openings; quadrature has the larger error.
TEST(IrradianceVector, conesAreSplitAsQuadratureSplitsThem) {
  std::mt19937 rng(7);
  for (const float degrees : {2.0f, 10.0f, 25.0f, 44.0f, 60.0f, 80.0f, 90.0f}) {
    const float cosAlpha = std::cos(degrees * std::numbers::pi_v<float> / 180.0f),
                size = std::numbers::pi_v<float> * (1.0f - cosAlpha * cosAlpha);
    float worst = 0.0f;
    for (int k = 0; k < 40; ++k) {
      const glm::vec3 d = k < 6 ? axis(k) : randomDirection(rng);
      SixVectors v{};
      addCone(v, d, cosAlpha, 2.0f);
      // The cone's own sphere: midpoints in the cosine to its axis.
      std::array<glm::dvec3, 6> expected{};
      const glm::dvec3 side = glm::abs(d.x) < 0.6f ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
      const glm::dvec3 u = glm::normalize(glm::cross(glm::dvec3(d), side)), w = glm::cross(glm::dvec3(d), u);
      constexpr int kSteps = 120, kTurns = 240;
      for (int i = 0; i < kSteps; ++i) {
        const double z = 1.0 - (1.0 - static_cast<double>(cosAlpha)) * (i + 0.5) / kSteps, r = std::sqrt(1.0 - z * z);
        for (int j = 0; j < kTurns; ++j) {
          const double phi = 2.0 * std::numbers::pi * (j + 0.5) / kTurns;
          const glm::dvec3 at = z * glm::dvec3(d) + r * (std::cos(phi) * u + std::sin(phi) * w);
          for (int a = 0; a < 3; ++a) expected[static_cast<std::size_t>(2 * a + (at[a] < 0.0 ? 1 : 0))] += at;
        }
      }
      const double scale = 2.0 * 2.0 * std::numbers::pi * (1.0 - static_cast<double>(cosAlpha)) / (kSteps * kTurns);
      for (std::size_t half = 0; half < 6; ++half) {
        const glm::vec3 difference = v[half] - glm::vec3(scale * expected[half]);
        worst = std::max(worst, glm::length(difference) / (2.0f * size));
      }
      // All of the cone's light is in each pair of halves.
      for (std::size_t a = 0; a < 3; ++a)
        EXPECT_LT(glm::length(v[2 * a] + v[2 * a + 1] - 2.0f * size * d), 2e-3f * size) << degrees;
    }
    EXPECT_LT(worst, 0.004f) << degrees << " degrees";
  }
}

TEST(IrradianceVector, packingsKeepTheColourOfLightFromOneDirection) {
  std::mt19937 rng(8);
  const glm::vec3 d = randomDirection(rng);
  const SixVectors v = lightFrom(d);
  const glm::vec3 color(0.9f, 0.3f, 0.05f);
  for (const VectorPacking packing : {VectorPacking::axes, VectorPacking::printed}) {
    for (std::size_t half = 0; half < 6; ++half) {
      const auto packed = packVectors(packing, half, {color.r * v[half], color.g * v[half], color.b * v[half]}, 1.0f);
      const auto back = unpackVectors(packing, half, packed);
      for (int k = 0; k < 3; ++k)
        EXPECT_LT(glm::length(back[static_cast<std::size_t>(k)] - color[k] * v[half]), 3e-3f) << k;
    }
  }
}

// Red from one side and blue from another: norms add light that is not there, the luma vector does not.
TEST(IrradianceVector, axesKeepLumaAndNormsOverestimate) {
  const glm::vec3 red(1, 0, 0), blue(0, 1, 0);
  const std::array<glm::vec3, 3> rgb{red, glm::vec3(0.0f), blue};
  const auto luma = [](const std::array<glm::vec3, 3>& v) { return 0.25f * v[0] + 0.5f * v[1] + 0.25f * v[2]; };
  const auto kept = unpackVectors(VectorPacking::axes, 0, packVectors(VectorPacking::axes, 0, rgb, 1.0f));
  EXPECT_LT(glm::length(luma(kept) - luma(rgb)), 1e-3f);
  const auto printed = unpackVectors(VectorPacking::printed, 0, packVectors(VectorPacking::printed, 0, rgb, 1.0f));
  EXPECT_GT(glm::length(luma(printed)), 1.3f * glm::length(luma(rgb)));
}

std::array<ColorVector, 3> halvesOf(const std::array<SixVectors, 3>& yCoCg, const glm::vec3& n) {
  std::array<ColorVector, 3> halves;
  for (int a = 0; a < 3; ++a) {
    const std::size_t half = halfOf(n, a);
    halves[static_cast<std::size_t>(a)] = makeColorVector(half, yCoCg[0][half], yCoCg[1][half], yCoCg[2][half]);
  }
  return halves;
}

TEST(IrradianceVector, colorOfOneLightIsThatOfEveryReceiver) {
  std::mt19937 rng(9);
  const glm::vec3 color(0.2f, 0.9f, 0.4f), c = rgbToYCoCg(color);
  for (int k = 0; k < 100; ++k) {
    const glm::vec3 d = randomDirection(rng), n = randomDirection(rng);
    const SixVectors v = lightFrom(d);
    std::array<SixVectors, 3> colored;
    for (std::size_t half = 0; half < 6; ++half) {
      for (int i = 0; i < 3; ++i) colored[static_cast<std::size_t>(i)][half] = c[i] * v[half];
    }
    const glm::vec3 e = yCoCgToRgb(irradianceYCoCg(halvesOf(colored, n), n)),
                    expected = irradianceFromVectors(v, n) * color;
    EXPECT_LT(glm::length(e - expected), 1e-5f);
  }
}

// Lights of any colours from any directions: a receiver at an axis has its own colour.
TEST(IrradianceVector, colorsAreExactAtTheAxes) {
  std::mt19937 rng(10);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  std::array<SixVectors, 3> sum{};
  std::array<glm::vec3, 6> expected{};
  for (int k = 0; k < 20; ++k) {
    const glm::vec3 color(uniform(rng), uniform(rng), uniform(rng)), c = rgbToYCoCg(color), d = randomDirection(rng);
    const SixVectors v = lightFrom(d);
    for (std::size_t half = 0; half < 6; ++half) {
      for (int i = 0; i < 3; ++i) sum[static_cast<std::size_t>(i)][half] += c[i] * v[half];
      expected[half] += std::max(glm::dot(axis(static_cast<int>(half)), d), 0.0f) * color;
    }
  }
  for (int half = 0; half < 6; ++half) {
    const glm::vec3 e = yCoCgToRgb(irradianceYCoCg(halvesOf(sum, axis(half)), axis(half)));
    EXPECT_LT(glm::length(e - expected[static_cast<std::size_t>(half)]), 1e-5f);
  }
}

TEST(IrradianceVector, packingHoldsWhatHalvesCannot) {
  const glm::vec3 huge(1e9f, -1e9f, std::numeric_limits<float>::quiet_NaN());
  const auto packed = packVectors(VectorPacking::axes, 3, {huge, huge, huge}, 1.0f);
  for (const std::uint16_t half : packed) EXPECT_TRUE(std::isfinite(unpackHalf(half)));
  EXPECT_EQ(unpackHalf(packClampedHalf(1e9f)), 65504.0f);
  EXPECT_EQ(unpackHalf(packClampedHalf(-std::numeric_limits<float>::infinity())), -65504.0f);
  // Chroma without luma has no colour.
  const ColorVector none = makeColorVector(0, glm::vec3(0.0f), glm::vec3(1.0f), glm::vec3(2.0f));
  EXPECT_EQ(irradianceYCoCg({none, none, none}, glm::vec3(0, 0, 1)), glm::vec3(0.0f));
  // Nor does a little luma have more than a colour can.
  const ColorVector faint = makeColorVector(4, glm::vec3(0, 0, 1e-6f), glm::vec3(1.0f), glm::vec3(-1.0f));
  EXPECT_LE(glm::length(irradianceYCoCg({none, none, faint}, glm::vec3(0, 0, 1))), 3e-6f);
}

}  // namespace
}  // namespace relume
