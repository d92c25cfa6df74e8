// SPDX-License-Identifier: MIT
#include "bake/preview/hemisphere_cells.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <cmath>
#include <numbers>

namespace relume {
namespace {

constexpr float kFov = 2.2142974f;  // 126.87 degrees: half a side of the plane is twice its distance

glm::dvec3 sumOf(const HemisphereCells& cells) {
  glm::dvec3 sum(0.0);
  for (const glm::vec3& integral : cells.integral) sum += glm::dvec3(integral);
  return sum;
}

// Irradiance by uniform light through the square |x|, |y| <= t at distance 1.
double squareForm(double t) {
  const double root = std::sqrt(1.0 + t * t);
  return 4.0 * (t / root) * std::atan(t / root);
}

TEST(HemisphereCells, aFansCellsShareTheProjectedHemisphereEvenly) {
  for (const std::uint32_t rays : {16u, 240u, 1024u, 4096u}) {
    const HemisphereCells cells = fanCells(rays);
    ASSERT_EQ(cells.integral.size(), cells.count());
    const glm::dvec3 sum = sumOf(cells);
    EXPECT_NEAR(sum.z, std::numbers::pi, 1e-5);
    EXPECT_NEAR(sum.x, 0.0, 1e-4);
    EXPECT_NEAR(sum.y, 0.0, 1e-4);
    for (const glm::vec3& integral : cells.integral) EXPECT_FLOAT_EQ(integral.z, cells.integral.front().z);
  }
}

// Lambert's sum along a cell's border and the map's equal areas say the same, cell by cell.
TEST(HemisphereCells, tangentPartsAreThoseOfADenseQuadrature) {
  const HemisphereCells coarse = fanCells(64), fine = fanCells(64 * 1024);
  ASSERT_EQ(coarse.columns, 8u);
  ASSERT_EQ(fine.columns, 256u);
  for (std::uint32_t j = 0; j < coarse.rows; ++j) {
    for (std::uint32_t i = 0; i < coarse.columns; ++i) {
      glm::dvec3 sum(0.0);
      for (std::uint32_t k = 0; k < 32 * 32; ++k)
        sum += glm::dvec3(fine.integral[(j * 32 + k / 32) * fine.columns + i * 32 + k % 32]);
      const glm::vec3& integral = coarse.integral[j * coarse.columns + i];
      EXPECT_NEAR(sum.x, integral.x, 2e-3) << i << ' ' << j;
      EXPECT_NEAR(sum.y, integral.y, 2e-3) << i << ' ' << j;
      EXPECT_NEAR(sum.z, integral.z, 1e-4) << i << ' ' << j;
    }
  }
}

// RCS 5.2, Table 1: a plane alone loses what it does not cover, 16.9 % at t = 2; the other two lose nothing.
TEST(HemisphereCells, planesCoverWhatTheirKindSays) {
  for (const std::uint32_t side : {2u, 16u, 64u}) {
    EXPECT_NEAR(sumOf(planeCells(side, kFov, Hemisphere::plane)).z, squareForm(2.0), 1e-5) << side;
    EXPECT_NEAR(sumOf(planeCells(side, kFov, Hemisphere::scaled)).z, std::numbers::pi, 1e-5) << side;
    EXPECT_NEAR(sumOf(planeCells(side, kFov, Hemisphere::border)).z, std::numbers::pi, 1e-5) << side;
  }
  EXPECT_NEAR(1.0 - squareForm(2.0) / std::numbers::pi, 0.169, 5e-4);
}

// A border pixel's share beyond the plane, against its closed form
//   w+ = 1/2 [phi - t / sqrt(1 + t²) atan(t tan phi / sqrt(1 + t²))] between the edge's ends, tan phi = y / t.
TEST(HemisphereCells, borderPixelsOwnTheSkyBehindThem) {
  constexpr std::uint32_t kSide = 16;
  constexpr double kT = 2.0;
  const HemisphereCells plain = planeCells(kSide, kFov, Hemisphere::plane),
                        border = planeCells(kSide, kFov, Hemisphere::border);
  const auto beyond = [](double y) {
    const double phi = std::atan(y / kT), root = std::sqrt(1.0 + kT * kT);
    return 0.5 * (phi - kT / root * std::atan(kT * std::tan(phi) / root));
  };
  for (std::uint32_t j = 1; j + 1 < kSide; ++j) {
    const double y0 = kT * (2.0 * j / kSide - 1.0), y1 = kT * (2.0 * (j + 1) / kSide - 1.0);
    const std::size_t cell = std::size_t{j} * kSide + kSide - 1, inner = cell - 1;
    EXPECT_NEAR(border.integral[cell].z - plain.integral[cell].z, beyond(y1) - beyond(y0), 1e-6) << j;
    EXPECT_EQ(border.integral[inner].z, plain.integral[inner].z);
  }
  // A corner pixel has two such edges.
  const double y0 = kT * (1.0 - 2.0 / kSide);
  EXPECT_NEAR(border.integral[kSide * kSide - 1].z - plain.integral[kSide * kSide - 1].z,
              2.0 * (beyond(kT) - beyond(y0)), 1e-6);
}

TEST(HemisphereCells, directionsLieInTheirCells) {
  const HemisphereCells cells = planeCells(64, kFov, Hemisphere::border);
  ASSERT_EQ(cells.direction.size(), cells.count());
  for (std::uint32_t j = 1; j + 1 < 64; ++j) {
    for (std::uint32_t i = 1; i + 1 < 64; ++i) {
      const std::size_t cell = std::size_t{j} * 64 + i;
      EXPECT_GT(glm::dot(cells.direction[cell], glm::normalize(cells.integral[cell])), 0.9999f);
    }
  }
}

}  // namespace
}  // namespace relume
