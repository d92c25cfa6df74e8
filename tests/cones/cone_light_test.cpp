// SPDX-License-Identifier: MIT
// Light that receivers find by cones.
#include "runtime/cones/cone_light.h"
#include "formats/frame_about.h"
#include "tests/live/lit_volumes.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <numbers>

namespace relume {
namespace {

using namespace test;

constexpr float kPi = std::numbers::pi_v<float>;

TEST(Cones, shareTheHemisphereAndTheLobe) {
  glm::vec3 mean(0.0f);
  float open = 0.0f;  // cosine-weighted solid angle
  for (const LocalCone& cone : hemisphereCones()) {
    EXPECT_NEAR(glm::length(cone.direction), 1.0f, 1e-6f);
    const float cosine = 1.0f / std::sqrt(1.0f + cone.spread * cone.spread);
    open += cone.direction.z * 2.0f * kPi * (1.0f - cosine);
    mean += cone.direction / static_cast<float>(kHemisphereCones);
  }
  EXPECT_NEAR(open, kPi, 1e-3f);
  EXPECT_NEAR(mean.z, 2.0f / 3.0f, 0.005f);
  EXPECT_LE(std::hypot(mean.x, mean.y), 0.03f);
  for (const float n : {0.0f, 1.0f, 16.0f, 64.0f, 650.0f}) {
    float z = 0.0f;
    for (const LocalCone& cone : lobeCones(n)) z += cone.direction.z / static_cast<float>(kLobeCones);
    EXPECT_NEAR(z, (n + 1.0f) / (n + 2.0f), 0.06f / (n + 1.0f)) << n;
  }
  EXPECT_EQ(lobeCones(-1.0f)[3].direction, lobeCones(0.0f)[3].direction);
  EXPECT_EQ(lobeCones(1e9f)[3].direction, lobeCones(1e4f)[3].direction);
}

TEST(Cones, framesAreOrthonormalAndRightHanded) {
  for (const glm::vec3& n : {glm::vec3(0, 0, 1), glm::vec3(0, 0, -1), glm::vec3(0.6f, -0.8f, 0), glm::vec3(-1, 0, 0)}) {
    const glm::mat3 f = frameAbout(n);
    EXPECT_NEAR(glm::determinant(f), 1.0f, 1e-6f);
    EXPECT_NEAR(glm::dot(f[0], f[1]), 0.0f, 1e-6f);
    EXPECT_EQ(f[2], n);
  }
}

// A box whose inside is lit by a sky alone, or that sends out 1 from all walls.
VoxelLevel closedBox() {
  VoxelLevel level;
  level.surfaces[0] = {glm::vec3(1.0f)};
  level.addBox({-4, -4, -4}, {4, 4, 4}, true);
  return level;
}

VoxelVolume lit(VoxelLevel level, std::uint32_t cells = 16) {
  VoxelVolume volume = volumeOf(level, coarse(cells));
  volume.reflect([](const SideAt&) { return glm::vec3(kPi); }, glm::vec3(0.0f));
  return volume;
}

// Wherever it is and wherever it looks, a receiver in a furnace sees the furnace: corners, edges and what lies within a
// voxel of a wall not excepted.
TEST(Cones, aReceiverInAFurnaceSeesIt) {
  const VoxelVolume volume = lit(closedBox());
  RadianceMips mips;
  ASSERT_TRUE(mips.update(volume));
  const ConeTracer cones(volume, mips, {});
  for (const float x : {-3.99f, -3.9f, -3.7f, -3.4f, 0.0f, 3.95f}) {
    const glm::vec3 at(x, -4, 3.97f), up(0, 1, 0);
    const Gathered around = cones.hemisphere(at, up, up, 0.0f);
    EXPECT_NEAR(around.radiance.x, 1.0f, 0.05f) << x;
    EXPECT_NEAR(around.occlusion, 1.0f, 0.05f) << x;
    for (const glm::vec3& towards : {glm::vec3(0.7f, 0.7f, 0), glm::vec3(-0.7f, 0.7f, 0), glm::vec3(0, 0.2f, -1)}) {
      const glm::vec3 direction = glm::normalize(towards);
      for (const float exponent : {4.0f, 64.0f, 1000.0f})
        EXPECT_NEAR(cones.glossy(at, up, direction, exponent).x, 1.0f, 0.1f) << x << ' ' << exponent;
    }
  }
}

TEST(Cones, seeTheSkyBeyondTheVolume) {
  VoxelLevel level;
  level.addQuad({-4, 0, -4}, {-4, 0, 4}, {4, 0, 4}, {4, 0, -4});
  const VoxelVolume volume = volumeOf(level, coarse(16));
  RadianceMips mips;
  ASSERT_TRUE(mips.update(volume));
  LiveSky sky;
  sky.radiance = {1.0f, 2.0f, 3.0f};
  const ConeTracer cones(volume, mips, sky);
  const Gathered open = cones.hemisphere({0, 0, 0}, {0, 1, 0}, {0, 1, 0}, 1.0f);
  EXPECT_NEAR(open.radiance.z, 3.0f, 0.06f);
  EXPECT_NEAR(open.occlusion, 0.0f, 0.02f);
  EXPECT_NEAR(cones.glossy({0, 0, 0}, {0, 1, 0}, glm::normalize(glm::vec3(1, 1, 0)), 16.0f).y, 2.0f, 0.02f);
  // A normal that leans over its plane sees that plane in part.
  const Gathered leaning = cones.hemisphere({0, 0, 0}, {0, 1, 0}, glm::normalize(glm::vec3(1, 1, 0)), 1.0f);
  EXPECT_NEAR(leaning.occlusion, 0.5f * (1.0f - std::sqrt(0.5f)), 0.04f);
}

// A wall beside a floor hides (1 - cos) / 2 of the angle that it fills. Beside it, four voxels away, cones that run
// along it have it in them at each step, and it hides too much.
TEST(Cones, aWallHidesItsFormFactorFalloffIncluded) {
  VoxelLevel level;
  level.addQuad({-8, 0, -8}, {-8, 0, 8}, {8, 0, 8}, {8, 0, -8});
  level.addQuad({1, 0, -8}, {1, 8, -8}, {1, 8, 8}, {1, 0, 8});
  const VoxelVolume volume = volumeOf(level, coarse(32));
  RadianceMips mips;
  ASSERT_TRUE(mips.update(volume));
  const ConeTracer cones(volume, mips, {});
  for (const float distance : {0.5f, 1.0f, 3.0f}) {
    const float expected = 0.5f * (1.0f - std::cos(std::atan2(8.0f, distance)));
    EXPECT_NEAR(cones.hemisphere({1 - distance, 0, 0}, {0, 1, 0}, {0, 1, 0}, 0.0f).occlusion, expected,
                distance < 2.0f ? 0.12f : 0.06f)
        << distance;
  }
  EXPECT_LT(cones.hemisphere({-2, 0, 0}, {0, 1, 0}, {0, 1, 0}, 2.0f).occlusion, 0.08f);
}

}  // namespace
}  // namespace relume
