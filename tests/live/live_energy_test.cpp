// SPDX-License-Identifier: MIT
// Light without a bake against what is known exactly: furnaces, plates, a wall that moves.
#include "formats/sphere_points.h"
#include "runtime/voxels/radiance_along.h"
#include "tests/live/lit_volumes.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

using namespace test;

constexpr float kPi = std::numbers::pi_v<float>;

TEST(LiveCaches, aClosedFurnaceHasEmissionOverOneLessAlbedo) {
  for (const float albedo : {0.0f, 0.5f, 0.8f}) {
    VoxelLevel level;
    level.surfaces[0] = {glm::vec3(albedo), {1, 2, 0}};
    level.addBox({0, 0, 0}, {4, 3, 5}, true);
    VoxelVolume volume = volumeOf(level, coarse(16));
    LiveCaches live = light();
    run(live, volume, {}, 40);
    // Voxels share the emitters' area evenly: at a place it is right in the mean.
    const float expected = kPi / (1.0f - albedo);
    double sum = 0.0, green = 0.0;
    int count = 0;
    for (float x = 0.5f; x < 4.0f; x += 0.25f) {
      for (float z = 0.5f; z < 5.0f; z += 0.25f) {
        const glm::vec3 e = live.irradiance({x, 0, z}, {0, 1, 0});
        sum += e.x;
        green += e.y;
        EXPECT_EQ(e.z, 0.0f);
        EXPECT_NEAR(e.x, expected, 0.04f * expected);
        ++count;
      }
    }
    EXPECT_NEAR(sum / count, expected, 0.01 * expected) << albedo;
    EXPECT_NEAR(green / count, 2.0 * expected, 0.02 * expected) << albedo;
  }
}

TEST(LiveCaches, aWhiteFurnaceStaysBounded) {
  VoxelLevel level;
  level.surfaces[0] = {glm::vec3(1.0f), glm::vec3(1.0f)};
  level.addBox({0, 0, 0}, {2, 2, 2}, true);
  level.addBox({0.7f, 0.3f, 0.9f}, {1.1f, 0.8f, 1.3f}, false);
  VoxelVolume volume = volumeOf(level, coarse(8));
  LiveCaches live = light(16);
  // What a wall adds in each frame adds up, and nothing more: the brightest voxel emits twice the mean.
  run(live, volume, {}, 300);
  const float y0 = std::sqrt(4.0f * kPi);
  EXPECT_LT(largest(live), 300.0f * 2.0f * y0);
  EXPECT_GT(largest(live), 300.0f * 0.5f * y0);
  // Without emission the light that is there goes round and never grows.
  float before = largest(live);
  LiveFrame dark;
  dark.emissionScale = glm::vec3(0.0f);
  const float start = before;
  for (int k = 0; k < 10; ++k) {
    run(live, volume, dark, 100);
    EXPECT_LT(largest(live), 1.01f * before);
    before = std::min(before, largest(live));
  }
  EXPECT_LE(before, 1.01f * start);
}

// Irradiance at the middle of a plate from a parallel one of half side a at distance h, both squares: four times the
// form factor of a corner (Howell, configuration B-3).
double facingPlate(double a, double h) {
  const double x = a / h, root = std::sqrt(1.0 + x * x);
  return 4.0 / (2.0 * std::numbers::pi) * 2.0 * (x / root) * std::atan(x / root);
}

TEST(LiveCaches, aPlateLightsAnotherByTheirFormFactor) {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.0f)}, {glm::vec3(0.0f), glm::vec3(3.0f)}};
  // Wide: three bands of a small source overhead give up to 6 % too much.
  level.addQuad({-2, 0, -2}, {-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, 0);
  level.addQuad({-2, 1.5f, -2}, {2, 1.5f, -2}, {2, 1.5f, 2}, {-2, 1.5f, 2}, 1);  // faces down
  VoxelVolume volume = volumeOf(level);
  LiveCaches live = light(4096);
  run(live, volume, {}, 1);
  const double expected = 3.0 * std::numbers::pi * facingPlate(2.0, 1.5);
  double sum = 0.0;
  for (const glm::vec2& p : {glm::vec2(0.03f, 0.03f), glm::vec2(-0.04f, 0.02f), glm::vec2(0.01f, -0.05f)})
    sum += live.irradiance({p.x, 0, p.y}, {0, 1, 0}).x / 3.0;
  EXPECT_NEAR(sum, expected, 0.03 * expected);
}

// A volume's light from all around a place [W/m²].
double fluenceAt(const VoxelVolume& volume, const glm::vec3& positionWorld) {
  constexpr std::uint32_t kDirections = 50000;
  const glm::vec3 at = volume.grid().toGrid(positionWorld);
  double sum = 0.0;
  for (std::uint32_t i = 0; i < kDirections; ++i)
    sum += radianceAlong(volume, {}, at, spherePoint(i, kDirections), glm::vec3(0.0f)).x;
  return 4.0 * std::numbers::pi * sum / kDirections;
}

// What a rectangle about `middle` that faces cross(halfU, halfV) and has that radiance sends to a place [W/m²].
double fluenceOf(const glm::vec3& middle, const glm::vec3& halfU, const glm::vec3& halfV, float radiance,
                 const glm::vec3& place) {
  constexpr int kSteps = 200;
  const glm::vec3 normal = glm::cross(halfU, halfV);
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; j < kSteps; ++j) {
      const auto along = [](int k) { return (static_cast<float>(2 * k + 1) - kSteps) / kSteps; };
      const glm::vec3 to = place - (middle + along(i) * halfU + along(j) * halfV);
      sum += double{std::max(glm::dot(normal, to), 0.0f)} / std::pow(double{glm::length(to)}, 3.0);
    }
  }
  return 4.0 * double{radiance} * sum / (kSteps * kSteps);
}

// A flat emitter has no rim. With that of its sub-voxels it sends these places 6 to 7 % more.
TEST(LiveCaches, aPanelShinesByTheAreaThatItShows) {
  for (const float degrees : {0.0f, 5.0f, 20.0f}) {
    const float tilt = degrees * kPi / 180.0f;
    const glm::vec3 u(0.5f * std::cos(tilt), 0.5f * std::sin(tilt), 0), v(0, 0, 0.5f), middle(2, 2.7f, 2);
    VoxelLevel level;
    level.surfaces = {{glm::vec3(0.0f)}, {glm::vec3(0.0f), glm::vec3(3.0f)}};
    level.addBox({0, 0, 0}, {4, 3, 4}, true);
    level.addQuad(middle - u - v, middle + u - v, middle + u + v, middle - u + v, 1);  // faces down
    VoxelVolume volume = volumeOf(level, coarse(16));
    volume.reflect({}, glm::vec3(1.0f));
    double found = 0.0, expected = 0.0;
    for (const glm::vec3& place :
         {glm::vec3(3.7f, 2.4f, 2.1f), glm::vec3(0.3f, 2.5f, 1.8f), glm::vec3(1.9f, 2.5f, 0.4f),
          glm::vec3(3.6f, 2.3f, 3.6f), glm::vec3(1.0f, 2.2f, 1.2f), glm::vec3(2.2f, 0.5f, 2)}) {
      found += fluenceAt(volume, place);
      expected += fluenceOf(middle, u, v, 3.0f, place);
    }
    EXPECT_NEAR(found, expected, 0.03 * expected) << degrees;
  }
}

// What lies behind its voxels does not shine with it, as the ceiling right above does through the gap.
TEST(LiveCaches, aPanelRightBelowTheCeilingShinesByItsOwnArea) {
  const glm::vec3 u(0.5f, 0, 0), v(0, 0, 0.5f);
  for (const float y : {2.86f, 2.88f, 2.9f, 2.92f, 2.94f}) {
    VoxelLevel level;
    level.surfaces = {{glm::vec3(0.0f)}, {glm::vec3(0.0f), glm::vec3(3.0f)}};
    level.addBox({0, 0, 0}, {4, 3, 4}, true);
    const glm::vec3 middle(2, y, 2);
    level.addQuad(middle - u - v, middle + u - v, middle + u + v, middle - u + v, 1);  // faces down
    VoxelVolume volume = volumeOf(level, coarse(16));
    volume.reflect({}, glm::vec3(1.0f));
    double found = 0.0, expected = 0.0;
    for (const glm::vec3& place :
         {glm::vec3(3.7f, 2.7f, 2.1f), glm::vec3(0.3f, 2.6f, 1.8f), glm::vec3(1.9f, 2.75f, 0.4f)}) {
      found += fluenceAt(volume, place);
      expected += fluenceOf(middle, u, v, 3.0f, place);
    }
    EXPECT_NEAR(found, expected, 0.1 * expected) << y;
  }
}

// A volume over a building alone has room for light before its faces.
TEST(LiveCaches, anOutermostFaceSeesTheSky) {
  VoxelLevel level;
  level.surfaces[0] = {glm::vec3(0.5f), glm::vec3(0.0f)};
  level.addBox({0, 0, 0}, {4, 3, 4}, false);
  for (const std::uint32_t cells : {16u, 32u}) {
    VoxelOptions options = coarse(cells);
    options.margin = kLitMargin;
    VoxelVolume volume = volumeOf(level, options);
    LiveCaches live = light(256);
    LiveFrame frame;
    frame.sky.radiance = glm::vec3(1.0f);
    run(live, volume, frame, 2);
    for (int k = 0; k < 3; ++k) {
      for (const float side : {-1.0f, 1.0f}) {
        glm::vec3 normal(0.0f), place(2.0f, 1.5f, 2.0f);
        normal[k] = side;
        place[k] += side * place[k];
        EXPECT_NEAR(live.irradiance(place, normal).x, kPi, 0.03f * kPi) << cells << " cells, " << k << ", " << side;
      }
    }
  }
}

// A lamp thinner than a voxel shines on all its sides.
TEST(LiveCaches, aThinLampShinesOnItsSides) {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.0f)}, {glm::vec3(0.0f), glm::vec3(3.0f)}};
  level.addBox({0, 0, 0}, {4, 3, 4}, true);
  level.addBox({1.5f, 2.7f, 1.98f}, {2.5f, 2.74f, 2.02f}, false, 1);
  VoxelVolume volume = volumeOf(level, coarse(16));
  volume.reflect({}, glm::vec3(1.0f));
  for (const glm::vec3& place : {glm::vec3(2, 2.72f, 0.5f), glm::vec3(2, 1.5f, 2), glm::vec3(3.5f, 2.72f, 2)}) {
    double expected = 0.0;
    expected += fluenceOf({2, 2.72f, 1.98f}, {0, 0.02f, 0}, {0.5f, 0, 0}, 3.0f, place);
    expected += fluenceOf({2, 2.7f, 2}, {0.5f, 0, 0}, {0, 0, 0.02f}, 3.0f, place);
    expected += fluenceOf({2.5f, 2.72f, 2}, {0, 0.02f, 0}, {0, 0, 0.02f}, 3.0f, place);
    // Its sub-voxels are thicker than it is: 31 % too much toward its long side.
    const double found = fluenceAt(volume, place);
    EXPECT_GT(found, 0.9 * expected) << place.x;
    EXPECT_LT(found, 1.4 * expected) << place.x;
  }
}

TEST(LiveCaches, aMovedWallIsFollowed) {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.5f)}, {glm::vec3(0.5f), glm::vec3(5.0f)}};
  level.addBox({0, 0, 0}, {4, 3, 4}, true);
  level.addQuad({0.5f, 2.9f, 1}, {1.0f, 2.9f, 1}, {1.0f, 2.9f, 3}, {0.5f, 2.9f, 3}, 1);
  level.addBox({1.9f, 0, 0}, {2.1f, 3, 4}, false);  // sinks into the floor
  level.parts.back().moves = true;
  VoxelVolume volume = volumeOf(level, coarse(16));
  LiveCaches live = light();
  run(live, volume, {}, 20);
  // Of the floor of the second room.
  const auto energy = [&] {
    double sum = 0.0;
    for (float x = 2.4f; x < 3.8f; x += 0.2f) {
      for (float z = 0.3f; z < 3.8f; z += 0.2f) sum += live.irradiance({x, 0, z}, {0, 1, 0}).x;
    }
    return sum;
  };
  EXPECT_LE(energy(), 1e-3);
  const glm::mat4x3 away({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, -2.9f, 0});
  ASSERT_TRUE(volume.move({&away, 1}));
  LiveFrame frame;
  frame.keep = 0.75f;
  run(live, volume, frame, 20);
  const double opened = energy();
  EXPECT_GT(opened, 1.0);
  double later = 0.0;
  for (int k = 0; k < 5; ++k) {
    run(live, volume, frame, 20);
    later += energy() / 5.0;
  }
  EXPECT_NEAR(opened, later, 0.05 * later) << "20 frames reach 95 % of the converged light";
}

}  // namespace
}  // namespace relume
