// SPDX-License-Identifier: MIT
// Light without a bake against what is known exactly: furnaces, plates, walls, skies.
#include "runtime/live/live_light.h"
#include "tests/voxels/boxes.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

namespace relume {
namespace {

using test::VoxelLevel;
constexpr float kPi = std::numbers::pi_v<float>;

VoxelVolume volumeOf(VoxelLevel& level, VoxelOptions options = {}) {
  auto volume = VoxelVolume::create(level.geometry(), options);
  EXPECT_TRUE(volume) << volume.error().message;
  return std::move(*volume);
}

LiveLight light(std::uint32_t rays = 64) {
  auto made = LiveLight::create({rays});
  EXPECT_TRUE(made);
  return std::move(*made);
}

void run(LiveLight& live, VoxelVolume& volume, LiveFrame frame, int frames) {
  for (int f = 0; f < frames; ++f) {
    frame.raySet = static_cast<std::uint32_t>(f);
    const Status ok = live.update(volume, frame);
    ASSERT_TRUE(ok) << ok.error().message;
  }
}

VoxelOptions coarse(std::uint32_t cells) {
  VoxelOptions options;
  options.cells = cells;
  return options;
}

float largest(const LiveLight& live) {
  float most = 0.0f;
  for (const float c : live.coefficients()) {
    EXPECT_TRUE(std::isfinite(c));
    most = std::max(most, std::abs(c));
  }
  return most;
}

TEST(LiveLight, aClosedFurnaceHasEmissionOverOneLessAlbedo) {
  for (const float albedo : {0.0f, 0.5f, 0.8f}) {
    VoxelLevel level;
    level.surfaces[0] = {glm::vec3(albedo), {1, 2, 0}};
    level.addBox({0, 0, 0}, {4, 3, 5}, true);
    VoxelVolume volume = volumeOf(level, coarse(16));
    LiveLight live = light();
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

TEST(LiveLight, eachFrameIsOneBounce) {
  VoxelLevel level;
  level.surfaces[0] = {glm::vec3(0.5f), glm::vec3(1.0f)};
  level.addBox({0, 0, 0}, {4, 4, 4}, true);
  VoxelVolume volume = volumeOf(level, coarse(16));
  LiveLight live = light();
  const float expected[3] = {1.0f, 1.5f, 1.75f};
  for (std::uint32_t f = 0; f < 3; ++f) {
    LiveFrame frame;
    frame.raySet = f;
    ASSERT_TRUE(live.update(volume, frame));
    EXPECT_NEAR(live.irradiance({2, 0, 2}, {0, 1, 0}).x, kPi * expected[f], 0.03f * kPi * expected[f]) << f;
  }
}

TEST(LiveLight, aWhiteFurnaceStaysBounded) {
  VoxelLevel level;
  level.surfaces[0] = {glm::vec3(1.0f), glm::vec3(1.0f)};
  level.addBox({0, 0, 0}, {2, 2, 2}, true);
  level.addBox({0.7f, 0.3f, 0.9f}, {1.1f, 0.8f, 1.3f}, false);
  VoxelVolume volume = volumeOf(level, coarse(8));
  LiveLight live = light(16);
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

TEST(LiveLight, aPlateLightsAnotherByTheirFormFactor) {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.0f)}, {glm::vec3(0.0f), glm::vec3(3.0f)}};
  // Wide: three bands of a small source overhead give up to 6 % too much.
  level.addQuad({-2, 0, -2}, {-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, 0);
  level.addQuad({-2, 1.5f, -2}, {2, 1.5f, -2}, {2, 1.5f, 2}, {-2, 1.5f, 2}, 1);  // faces down
  VoxelVolume volume = volumeOf(level);
  LiveLight live = light(4096);
  run(live, volume, {}, 1);
  const double expected = 3.0 * std::numbers::pi * facingPlate(2.0, 1.5);
  double sum = 0.0;
  for (const glm::vec2& p : {glm::vec2(0.03f, 0.03f), glm::vec2(-0.04f, 0.02f), glm::vec2(0.01f, -0.05f)})
    sum += live.irradiance({p.x, 0, p.y}, {0, 1, 0}).x / 3.0;
  EXPECT_NEAR(sum, expected, 0.03 * expected);
}

TEST(LiveLight, aConstantSkyLightsAnOpenPlane) {
  VoxelLevel level;
  level.addQuad({-4, 0, -4}, {-4, 0, 4}, {4, 0, 4}, {4, 0, -4});
  VoxelOptions options = coarse(16);
  options.boxMin = {-4, -1, -4};
  options.boxMax = {4, 3, 4};
  VoxelVolume volume = volumeOf(level, options);
  LiveLight live = light(512);
  LiveFrame frame;
  frame.sky.radiance = {0.5f, 1.0f, 2.0f};
  run(live, volume, frame, 2);
  const glm::vec3 e = live.irradiance({0.3f, 0, -0.2f}, {0, 1, 0});
  EXPECT_NEAR(e.x, 0.5f * kPi, 0.02f * kPi);
  EXPECT_NEAR(e.z, 2.0f * kPi, 0.08f * kPi);
  // The same as a map.
  const std::vector<glm::vec3> map(64, frame.sky.radiance);
  LiveLight mapped = light(512);
  frame.sky.map = map;
  frame.sky.side = 8;
  run(mapped, volume, frame, 2);
  EXPECT_NEAR(mapped.irradiance({0.3f, 0, -0.2f}, {0, 1, 0}).y, e.y, 1e-4f);
  EXPECT_EQ(live.irradiance({50, 0, 0}, {0, 1, 0}), glm::vec3(0.0f));
  EXPECT_EQ(live.irradiance({std::numeric_limits<float>::quiet_NaN(), 0, 0}, {0, 1, 0}), glm::vec3(0.0f));
  EXPECT_EQ(live.irradiance({0, 0, 0}, glm::vec3(std::numeric_limits<float>::quiet_NaN())), glm::vec3(0.0f));
}

TEST(LiveLight, aThinWallKeepsTheDarkRoomDark) {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.7f)}, {glm::vec3(0.7f), glm::vec3(5.0f)}};
  level.addBox({0, 0, 0}, {4, 3, 4}, true);
  // A wall in the middle, 2 cm thick: a quarter of a voxel.
  level.addBox({1.99f, 0, 0}, {2.01f, 3, 4}, false);
  level.addQuad({1, 2.9f, 1}, {1.5f, 2.9f, 1}, {1.5f, 2.9f, 3}, {1, 2.9f, 3}, 1);
  VoxelVolume volume = volumeOf(level, coarse(16));
  LiveLight live = light();
  run(live, volume, {}, 30);
  const float lit = live.irradiance({0.5f, 0, 2}, {0, 1, 0}).x;
  EXPECT_GT(lit, 0.1f);
  for (float x = 2.02f; x < 4.0f; x += 0.05f) {
    EXPECT_LE(live.irradiance({x, 0, 2}, {0, 1, 0}).x, 1e-3f * lit) << x;
    EXPECT_LE(live.irradiance({2.01f, 1.0f, x - 1.0f}, {1, 0, 0}).x, 1e-3f * lit) << x;
  }
}

TEST(LiveLight, aMovedWallIsFollowed) {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.5f)}, {glm::vec3(0.5f), glm::vec3(5.0f)}};
  level.addBox({0, 0, 0}, {4, 3, 4}, true);
  level.addQuad({0.5f, 2.9f, 1}, {1.0f, 2.9f, 1}, {1.0f, 2.9f, 3}, {0.5f, 2.9f, 3}, 1);
  level.addBox({1.9f, 0, 0}, {2.1f, 3, 4}, false);  // sinks into the floor
  level.parts.back().moves = true;
  VoxelVolume volume = volumeOf(level, coarse(16));
  LiveLight live = light();
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

TEST(LiveLight, sameBytesOnTwoThreads) {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.5f)}, {glm::vec3(0.5f), glm::vec3(5.0f)}};
  level.addBox({0, 0, 0}, {4, 3, 4}, true);
  level.addBox({1, 0, 1}, {2, 1.5f, 2}, false, 1);
  VoxelOptions options = coarse(16);
  VoxelVolume one = volumeOf(level, options);
  options.parallelFor = test::onTwoThreads;
  VoxelVolume two = volumeOf(level, options);
  LiveLight a = light(), b = light();
  LiveFrame frame;
  frame.keep = 0.25f;
  run(a, one, frame, 5);
  run(b, two, frame, 5);
  ASSERT_EQ(a.coefficients().size(), b.coefficients().size());
  EXPECT_EQ(std::memcmp(a.coefficients().data(), b.coefficients().data(), a.coefficients().size_bytes()), 0);
}

TEST(LiveLight, whatIsRefusedChangesNothing) {
  EXPECT_FALSE(LiveLight::create({7}));
  EXPECT_FALSE(LiveLight::create({5000}));
  VoxelLevel level;
  level.surfaces[0].emission = glm::vec3(1.0f);
  level.addBox({0, 0, 0}, {4, 3, 4}, true);
  VoxelVolume volume = volumeOf(level, coarse(8));
  LiveLight live = light();
  run(live, volume, {}, 2);
  const std::vector<float> before(live.coefficients().begin(), live.coefficients().end());
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::vector<glm::vec3> bad(4, glm::vec3(-1.0f));
  std::vector<LiveFrame> frames(6);
  frames[0].keep = 1.0f;
  frames[1].bounceScale = nan;
  frames[2].emissionScale.y = -1.0f;
  frames[3].sky.radiance.z = std::numeric_limits<float>::infinity();
  frames[4].sky.map = bad;
  frames[4].sky.side = 2;
  frames[5].sky.map = bad;
  frames[5].sky.side = 3;
  for (const LiveFrame& frame : frames) EXPECT_FALSE(live.update(volume, frame));
  EXPECT_TRUE(std::equal(before.begin(), before.end(), live.coefficients().begin()));
  live.reset();
  EXPECT_EQ(largest(live), 0.0f);
}

}  // namespace
}  // namespace relume
