// SPDX-License-Identifier: MIT
// The hemispherical basis: orthonormal, and what turning and tilting a frame does to functions in it.
#include "bake/preview/hsh.h"

#include "tests/preview/hemisphere_quadrature.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace relume {
namespace {

using namespace test;

// Calls visit(direction, solid angle) at the nodes of a product rule over the hemisphere.
void integrateHemisphere(const std::function<void(const glm::dvec3&, double)>& visit) {
  for (const HemisphereNode& node : hemisphereNodes<64, 64>()) visit(node.direction, node.weight);
}

std::vector<float> project(int order, const std::function<double(const glm::dvec3&)>& f) {
  std::vector<double> sum(static_cast<std::size_t>(order * order), 0.0), h(sum.size());
  integrateHemisphere([&](const glm::dvec3& d, double weight) {
    evaluateHsh(order, d, h);
    for (std::size_t i = 0; i < h.size(); ++i) sum[i] += weight * f(d) * h[i];
  });
  return {sum.begin(), sum.end()};
}

double evaluate(int order, const std::vector<float>& c, const glm::dvec3& d) {
  std::vector<double> h(c.size());
  evaluateHsh(order, d, h);
  double sum = 0.0;
  for (std::size_t i = 0; i < h.size(); ++i) sum += h[i] * static_cast<double>(c[i]);
  return sum;
}

TEST(Hsh, functionsAreOrthonormalOverTheHemisphere) {
  constexpr int kCount = kMaxHshCoefficients;
  std::vector<double> sum(kCount * kCount, 0.0), h(kCount);
  integrateHemisphere([&](const glm::dvec3& d, double weight) {
    evaluateHsh(kMaxHshOrder, d, h);
    for (int i = 0; i < kCount; ++i) {
      for (int j = 0; j < kCount; ++j) sum[i * kCount + j] += weight * h[i] * h[j];
    }
  });
  for (int i = 0; i < kCount; ++i) {
    for (int j = 0; j < kCount; ++j) EXPECT_NEAR(sum[i * kCount + j], i == j ? 1.0 : 0.0, 1e-6) << i << ", " << j;
  }
}

// GKPB04's formulas written out.
TEST(Hsh, theFirstFunctionsAreThePaperS) {
  const double theta = 0.7, phi = 2.1, z = std::cos(theta);
  const glm::dvec3 d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), z);
  std::array<double, 9> h{};
  evaluateHsh(3, d, h);
  const double x = 2.0 * z - 1.0, s = std::sqrt(1.0 - x * x);
  EXPECT_NEAR(h[0], std::sqrt(0.5 / std::numbers::pi), 1e-12);
  EXPECT_NEAR(h[1], std::sqrt(2.0) * std::sqrt(3.0 / (4.0 * std::numbers::pi)) * std::sin(phi) * s, 1e-12);
  EXPECT_NEAR(h[2], std::sqrt(1.5 / std::numbers::pi) * x, 1e-12);
  EXPECT_NEAR(h[6], std::sqrt(2.5 / std::numbers::pi) * 0.5 * (3.0 * x * x - 1.0), 1e-12);
  // At the pole and on the horizon nothing is left of functions that turn with phi.
  for (const glm::dvec3& edge : {glm::dvec3(0, 0, 1), glm::dvec3(0.6, 0.8, 0)}) {
    evaluateHsh(3, edge, h);
    for (const int i : {1, 3, 4, 5, 7, 8}) EXPECT_EQ(h[i], 0.0);
  }
}

TEST(Hsh, aTurnedFrameSeesTheSameFunction) {
  std::vector<float> c(kMaxHshCoefficients);
  for (std::size_t i = 0; i < c.size(); ++i) c[i] = std::sin(1.7f * static_cast<float>(i * i));
  std::vector<float> turned = c;
  const double psi = 0.9;
  turnHsh(kMaxHshOrder, static_cast<float>(std::cos(psi)), static_cast<float>(std::sin(psi)), turned);
  for (const double phi : {0.0, 0.4, 2.0, 5.0}) {
    for (const double z : {0.05, 0.5, 0.95}) {
      const double r = std::sqrt(1.0 - z * z);
      const glm::dvec3 inFirst(r * std::cos(phi + psi), r * std::sin(phi + psi), z);
      const glm::dvec3 inTurned(r * std::cos(phi), r * std::sin(phi), z);
      EXPECT_NEAR(evaluate(kMaxHshOrder, turned, inTurned), evaluate(kMaxHshOrder, c, inFirst), 2e-4);
    }
  }
}

// At no angle tilting changes nothing, and lobes well above both horizons come out as they would be seen from the other
// frame: there the tables are orthogonal.
TEST(Hsh, aTiltedFrameSeesLobesWhereTheyAre) {
  const HshTilt tilt(kMaxHshOrder, 20);
  std::vector<float> same(kMaxHshCoefficients), c(kMaxHshCoefficients);
  for (std::size_t i = 0; i < c.size(); ++i) c[i] = std::cos(0.3f * static_cast<float>(i * i));
  tilt.apply(0.0f, c, same);
  for (std::size_t i = 0; i < c.size(); ++i) EXPECT_NEAR(same[i], c[i], 1e-5f);

  for (const double deg : {5.0, 12.5, 20.0}) {
    const double beta = glm::radians(deg);
    const glm::dvec3 axis = glm::normalize(glm::dvec3(0.3, 0.4, 1.0));
    const auto lobe = [](const glm::dvec3& d, const glm::dvec3& about) {
      return std::pow(std::max(0.0, glm::dot(d, about)), 12.0);
    };
    const auto first = project(kMaxHshOrder, [&](const glm::dvec3& d) { return lobe(d, axis); });
    // The axis as the tilted frame has it.
    const glm::dvec3 seen(std::cos(beta) * axis.x - std::sin(beta) * axis.z, axis.y,
                          std::sin(beta) * axis.x + std::cos(beta) * axis.z);
    const auto expected = project(kMaxHshOrder, [&](const glm::dvec3& d) { return lobe(d, seen); });
    std::vector<float> tilted(first.size());
    tilt.apply(static_cast<float>(beta), first, tilted);
    double error = 0.0, size = 0.0, before = 0.0, after = 0.0;
    for (std::size_t i = 0; i < first.size(); ++i) {
      error += std::pow(tilted[i] - expected[i], 2.0);
      size += std::pow(expected[i], 2.0);
      before += std::pow(first[i], 2.0);
      after += std::pow(tilted[i], 2.0);
    }
    EXPECT_LT(std::sqrt(error / size), 0.02) << deg;
    EXPECT_NEAR(after / before, 1.0, 0.02) << deg;
  }
  // Beyond the largest angle is as at it; what is turned by a quarter shares half of the directions.
  std::vector<float> at(c.size()), beyond(c.size());
  tilt.apply(static_cast<float>(glm::radians(20.0)), c, at);
  tilt.apply(2.0f, c, beyond);
  EXPECT_EQ(at, beyond);
  const std::vector<float> constant = project(3, [](const glm::dvec3&) { return 1.0; });
  std::vector<float> quarter(9);
  HshTilt(3, 90).apply(static_cast<float>(0.5 * std::numbers::pi), constant, quarter);
  EXPECT_NEAR(quarter[0], 0.5f * constant[0], 1e-4f);
}

}  // namespace
}  // namespace relume
