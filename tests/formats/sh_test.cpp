// SPDX-License-Identifier: MIT
// Spherical harmonics against quadrature, and the formulas of PIC that the print has wrong.
#include "formats/sh.h"

#include "tests/formats/random_direction.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace relume {
namespace {

constexpr double kPi = std::numbers::pi;

// Integrate f over the sphere: Gauss-like midpoint rule in z, uniform in phi.
double integrateSphere(const std::function<double(const glm::vec3&)>& f, double zMin = -1.0) {
  constexpr int kZ = 2000, kPhi = 64;
  double sum = 0.0;
  for (int i = 0; i < kZ; ++i) {
    const double z = zMin + (1.0 - zMin) * (i + 0.5) / kZ;
    const double r = std::sqrt(1.0 - z * z);
    for (int j = 0; j < kPhi; ++j) {
      const double phi = 2.0 * kPi * (j + 0.5) / kPhi;
      sum += f(glm::vec3(r * std::cos(phi), r * std::sin(phi), z));
    }
  }
  return sum * (1.0 - zMin) / kZ * 2.0 * kPi / kPhi;
}

TEST(Sh, BasisIsOrthonormal) {
  for (int i = 0; i < kMaxCoefficients; i += 5) {
    for (int j = i; j < kMaxCoefficients; j += 7) {
      const double dot = integrateSphere([&](const glm::vec3& d) {
        std::array<float, kMaxCoefficients> y;
        evaluateSh(kMaxBands, d, y);
        return static_cast<double>(y[i]) * y[j];
      });
      EXPECT_NEAR(dot, i == j ? 1.0 : 0.0, 2e-4) << i << " " << j;
    }
  }
}

TEST(Sh, FirstBandsMatchTheirClosedForms) {
  std::mt19937 rng(1);
  for (int k = 0; k < 100; ++k) {
    const glm::vec3 d = randomDirection(rng);
    std::array<float, 9> y;
    evaluateSh(3, d, y);
    EXPECT_NEAR(y[0], 0.282095f, 1e-6);
    EXPECT_NEAR(y[1], 0.488603f * d.y, 1e-6);
    EXPECT_NEAR(y[2], 0.488603f * d.z, 1e-6);
    EXPECT_NEAR(y[3], 0.488603f * d.x, 1e-6);
    EXPECT_NEAR(y[4], 1.092548f * d.x * d.y, 2e-6);
    EXPECT_NEAR(y[6], 0.315392f * (3 * d.z * d.z - 1), 2e-6);
    EXPECT_NEAR(y[8], 0.546274f * (d.x * d.x - d.y * d.y), 2e-6);
  }
}

// PIC App. C (Erratum: the leading minus is real on all rows, and the rows are Z_l without K_l).
TEST(Sh, ConeRatiosAgreeWithQuadratureForAllBands) {
  for (const float cosAlpha : {0.999f, 0.9f, 0.5f, 0.0f, -0.7f}) {
    std::array<float, kMaxBands> ratio;
    coneBandRatios(kMaxBands, cosAlpha, ratio);
    for (int l = 0; l < kMaxBands; ++l) {
      const double z =
          integrateSphere([&](const glm::vec3& d) { return std::legendre(l, static_cast<double>(d.z)); }, cosAlpha);
      EXPECT_NEAR(ratio[l], z / (2.0 * kPi * (1.0 - double{cosAlpha})), 1e-4) << "band " << l << " cos " << cosAlpha;
    }
  }
}

// PIC App. B.
TEST(Sh, CosineLobeFactorsAgreeWithQuadrature) {
  for (const float n : {1.0f, 2.5f, 30.0f, 300.0f}) {
    std::array<float, kMaxBands> s;
    cosineLobeFactors(kMaxBands, n, s);
    for (int l = 0; l < kMaxBands; ++l) {
      const double integral = integrateSphere(
          [&](const glm::vec3& d) {
            return std::pow(static_cast<double>(d.z), n) * std::legendre(l, static_cast<double>(d.z));
          },
          0.0);
      EXPECT_NEAR(s[l], (n + 1) / (2 * kPi) * integral, 2e-3) << "band " << l << " n " << n;
    }
  }
  std::array<float, kMaxBands> one;
  cosineLobeFactors(kMaxBands, 1.0f, one);
  for (int l = 0; l < kMaxBands; ++l) EXPECT_NEAR(clampedCosineFactors()[l], kPi * one[l], 1e-5);
}

// A light of one direction in the hemisphere above n: the linear form is exact with two bands.
TEST(Sh, LinearIrradianceIsExactForTheHemisphere) {
  std::mt19937 rng(2);
  for (int k = 0; k < 200; ++k) {
    const glm::vec3 n = randomDirection(rng);
    glm::vec3 d = randomDirection(rng);
    if (glm::dot(n, d) < 0) d = -d;
    std::array<float, 4> c;
    evaluateSh(2, d, c);
    EXPECT_NEAR(irradianceLinear(c, n), glm::dot(n, d), 2e-6);
    EXPECT_NEAR(irradianceAtSurface(2, c, n, n), glm::dot(n, d), 2e-6);
  }
}

// A cache that has seen the upper half of a uniform world; receivers tilted against it see a part of the lower half
// too.
TEST(Sh, SurfaceIrradianceOfAUniformWorldIsPiForTiltedReceivers) {
  std::array<float, kMaxCoefficients> c{};
  for (int l = 0; l < kMaxBands; ++l) {
    const double legendre =
        integrateSphere([&](const glm::vec3& d) { return std::legendre(l, static_cast<double>(d.z)); }, 0.0);
    c[l * l + l] = static_cast<float>(std::sqrt((2 * l + 1) / (4 * kPi)) * legendre);
  }
  const glm::vec3 cacheNormal(0, 0, 1);
  for (int bands = 1; bands <= kMaxBands; ++bands) {
    for (int degrees = 0; degrees <= 60; degrees += 2) {
      const double a = degrees * kPi / 180;
      const glm::vec3 n(std::sin(a), 0, std::cos(a));
      EXPECT_NEAR(irradianceAtSurface(bands, c, n, cacheNormal), kPi, 0.01 * kPi) << bands << " bands, " << degrees;
    }
  }
}

TEST(Sh, SurfaceLobeLeavesAShadingNormalAloneOnTheCachesPlane) {
  const SurfaceLobe own = surfaceLobe(1.0f), mapped = surfaceLobe(0.9f, 1.0f), tilted = surfaceLobe(0.5f);
  EXPECT_EQ(own.linear, 1.0f);
  EXPECT_EQ(own.clamped, 0.0f);
  EXPECT_NEAR(mapped.linear + mapped.clamped, 1.0f, 1e-6f);
  EXPECT_EQ(tilted.linear, 0.0f);
  EXPECT_NEAR(tilted.clamped, 2.0f / 1.5f, 1e-6f);
  EXPECT_EQ(surfaceLobe(-1.0f).clamped, 2.0f);
}

// Light from one direction: all three bands by zonalIrradiance() are those of the series.
TEST(Sh, ZonalIrradianceIsExactForOneDirection) {
  std::mt19937 rng(5);
  for (int i = 0; i < 50; ++i) {
    const glm::vec3 d = randomDirection(rng), n = randomDirection(rng);
    std::array<float, 9> c;
    evaluateSh(3, d, c);
    for (float& each : c) each *= 7.5f;
    const float guessed = irradianceClamped(2, c, n) + zonalIrradiance(c[0], {c[3], c[1], c[2]}, n);
    EXPECT_NEAR(guessed, irradianceClamped(3, c, n), 1e-4f * 7.5f);
  }
}

TEST(Sh, ZonalIrradianceOfNoLightAndOfAUniformWorldIsNothing) {
  EXPECT_EQ(zonalIrradiance(0.0f, {1, 0, 0}, {1, 0, 0}), 0.0f);
  EXPECT_EQ(zonalIrradiance(-1.0f, {1, 0, 0}, {1, 0, 0}), 0.0f);
  EXPECT_EQ(zonalIrradiance(2.0f, {0, 0, 0}, {1, 0, 0}), 0.0f);
}

// The mean over all normals is band 0's alone.
TEST(Sh, ZonalIrradianceSumsToNothingOverAllNormals) {
  const glm::vec3 linear(0.3f, -0.7f, 0.4f);
  EXPECT_NEAR(integrateSphere([&](const glm::vec3& n) { return zonalIrradiance(1.0f, linear, n); }), 0.0, 1e-4);
  EXPECT_GT(zonalIrradiance(1.0f, linear, glm::normalize(linear)), 0.05f);
}

TEST(Sh, ClampedIrradianceOfAUniformSkyIsPi) {
  for (int bands = 1; bands <= kMaxBands; ++bands) {
    std::array<float, kMaxCoefficients> c{};
    c[0] = 2.0f * std::sqrt(static_cast<float>(kPi));  // radiance 1
    EXPECT_NEAR(irradianceClamped(bands, c, glm::vec3(0, 1, 0)), kPi, 1e-5);
  }
}

}  // namespace
}  // namespace relume
