// SPDX-License-Identifier: MIT
// Lobes in hemispherical harmonics against quadrature.
#include "bake/preview/glossy_lobe.h"

#include "tests/preview/hemisphere_quadrature.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace relume {
namespace {

using namespace test;

double lobe(const glm::dvec3& d, const glm::dvec3& axis, double exponent) {
  return std::pow(std::max(0.0, glm::dot(d, axis)), exponent);
}

glm::vec3 axisAt(double deg) {
  return {std::sin(glm::radians(deg)) * 0.6, std::sin(glm::radians(deg)) * 0.8, std::cos(glm::radians(deg))};
}

// A world of one radiance has lambda_00 = sqrt(2 pi) of it and nothing else: c_00 sqrt(2 pi) is what is mirrored of it,
// which is 1 of a mean, and the albedo of Phong's lobe.
TEST(LobeTable, aUniformWorldIsMirroredByTheAlbedo) {
  Context context;
  const LobeTable mean(6, LobeKind::mean, context), phong(6, LobeKind::phong, context);
  const std::vector<HemisphereNode> nodes = hemisphereNodes<96, 192>();
  std::vector<float> c(36);
  for (const double exponent : {1.0, 3.4, 20.0}) {
    for (const double deg : {0.0, 25.0, 60.0, 85.0}) {
      const glm::vec3 axis = axisAt(deg);
      mean.evaluate(static_cast<float>(exponent), axis, c);
      EXPECT_NEAR(c[0] * std::sqrt(2.0 * std::numbers::pi), 1.0, 1e-3);
      double albedo = 0.0, integral = 0.0;
      for (const HemisphereNode& node : nodes) {
        const double value = node.weight * lobe(node.direction, axis, exponent);
        integral += value;
        albedo += value * node.direction.z * (exponent + 2.0) / (2.0 * std::numbers::pi);
      }
      phong.evaluate(static_cast<float>(exponent), axis, c);
      EXPECT_NEAR(c[0] * std::sqrt(2.0 * std::numbers::pi), albedo, 0.005 * albedo) << exponent << " at " << deg;
      EXPECT_NEAR(mean.integral(static_cast<float>(exponent), axis.z), integral, 0.01 * integral);
    }
    EXPECT_NEAR(mean.integral(static_cast<float>(exponent), 1.0f), 2.0 * std::numbers::pi / (exponent + 1.0), 5e-3);
    EXPECT_NEAR(mean.integral(static_cast<float>(exponent), 0.0f), std::numbers::pi / (exponent + 1.0), 1e-3);
  }
  // Phong's lobe along the normal reflects all there is.
  phong.evaluate(20.0f, {0, 0, 1}, c);
  EXPECT_NEAR(c[0] * std::sqrt(2.0 * std::numbers::pi), 1.0, 1e-4);
}

// A sphere of Phong's lobe of exponent 20 in a room of smooth light with a bright part, seen along an axis: order 10
// within 2 % of RCS Eq. (5) by quadrature.
TEST(LobeTable, aPhongSphereOfOrderTenIsThatOfQuadrature) {
  Context context;
  const LobeTable table(kMaxHshOrder, LobeKind::phong, context);
  const std::vector<HemisphereNode> nodes = hemisphereNodes<96, 192>();
  const glm::dvec3 lamp = glm::normalize(glm::dvec3(0.4, 0.3, 0.8)), toViewer(0, 0, 1);
  const auto radiance = [&](const glm::dvec3& d) { return 0.3 + 0.1 * d.y + 3.0 * lobe(d, lamp, 30.0); };
  std::vector<double> h(kMaxHshCoefficients);
  std::vector<float> c(kMaxHshCoefficients);
  double squares = 0.0, sum = 0.0;
  for (const double turn : {0.3, 2.0, 4.0}) {
    for (const double lean : {0.0, 15.0, 30.0, 45.0, 60.0}) {
      // A normal of the sphere, and the frame about it.
      const double s = std::sin(glm::radians(lean));
      const glm::dvec3 n(s * std::cos(turn), s * std::sin(turn), std::cos(glm::radians(lean)));
      const glm::dvec3 t = glm::normalize(glm::cross(glm::dvec3(0.1, 1, 0), n)), b = glm::cross(n, t);
      const glm::dvec3 r = glm::reflect(-toViewer, n);
      const glm::dvec3 axis(glm::dot(r, t), glm::dot(r, b), glm::dot(r, n));
      std::vector<double> lambda(kMaxHshCoefficients, 0.0);
      double expected = 0.0;
      for (const HemisphereNode& node : nodes) {
        const double light = node.weight * radiance(t * node.direction.x + b * node.direction.y + n * node.direction.z);
        expected += light * lobe(node.direction, axis, 20.0) * node.direction.z * 22.0 / (2.0 * std::numbers::pi);
        evaluateHsh(kMaxHshOrder, node.direction, h);
        for (std::size_t i = 0; i < h.size(); ++i) lambda[i] += light * h[i];
      }
      table.evaluate(20.0f, axis, c);
      double found = 0.0;
      for (std::size_t i = 0; i < lambda.size(); ++i) found += static_cast<double>(c[i]) * lambda[i];
      squares += (found - expected) * (found - expected);
      sum += expected * expected;
    }
  }
  EXPECT_LT(std::sqrt(squares / sum), 0.02);
}

TEST(LobeTable, whatIsOutOfRangeIsReadAtItsEnd) {
  Context context;
  const LobeTable table(4, LobeKind::mean, context);
  std::vector<float> at(16), beyond(16);
  const glm::vec3 axis = axisAt(30.0);
  for (const auto& [inside, outside] :
       {std::pair{1.0f, 0.0f}, std::pair{1.0f, -5.0f}, std::pair{1.0f, std::numeric_limits<float>::quiet_NaN()},
        std::pair{kMaxRecordExponent, 1e4f}, std::pair{kMaxRecordExponent, std::numeric_limits<float>::infinity()}}) {
    table.evaluate(inside, axis, at);
    table.evaluate(outside, axis, beyond);
    for (std::size_t i = 0; i < at.size(); ++i) EXPECT_NEAR(at[i], beyond[i], 1e-6f);
  }
  // Below the horizon: on it. Along the normal no direction is across.
  table.evaluate(8.0f, glm::normalize(glm::vec3(0.6f, 0.8f, -0.1f)), beyond);
  table.evaluate(8.0f, {0.6f, 0.8f, 0.0f}, at);
  for (std::size_t i = 0; i < at.size(); ++i) EXPECT_NEAR(at[i], beyond[i], 1e-5f);
  table.evaluate(8.0f, {0, 0, 1}, at);
  for (const std::size_t i : {1u, 3u, 4u, 5u, 7u, 8u}) EXPECT_NEAR(at[i], 0.0f, 1e-6f);
}

// Order 1 knows how much light there is, and no direction.
TEST(LobeTable, orderOneIsTheMeanOfTheHemisphere) {
  Context context;
  const LobeTable table(1, LobeKind::mean, context);
  std::vector<float> c(1);
  table.evaluate(20.0f, axisAt(40.0), c);
  EXPECT_NEAR(c[0], 1.0 / std::sqrt(2.0 * std::numbers::pi), 1e-3);
}

}  // namespace
}  // namespace relume
