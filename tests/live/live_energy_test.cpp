// SPDX-License-Identifier: MIT
// Light without a bake against what is known exactly: furnaces, plates, a wall that moves.
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
