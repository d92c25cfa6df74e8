// SPDX-License-Identifier: MIT
// Cones through volumes in one another.
#include "runtime/cones/nested_cones.h"
#include "runtime/cones/cone_light.h"
#include "tests/cones/nested_rooms.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <limits>
#include <random>

namespace relume {
namespace {

using namespace test;

// A box with things in it, and its voxels: 8 m along x, those of the outermost 1/8 m, of each further one half of that.
constexpr glm::vec3 kLow(-4.0f), kHigh(4.0f);
constexpr std::uint32_t kCells = 16;

void addClutter(VoxelLevel& level) {
  level.addBox({-3.9f, -3.9f, -3.9f}, {3.9f, 3.9f, 3.9f}, true);
  std::mt19937 random(5);
  for (int i = 0; i < 30; ++i) {
    const glm::vec3 at = 3.0f * unit(random), a = 0.6f * unit(random), b = 0.6f * unit(random);
    level.addQuad(at, at + a, at + a + b, at + b);
  }
}

Cone coneOf(std::mt19937& random) {
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  Cone cone{{3.0f * uniform(random), 3.0f * uniform(random), 3.0f * uniform(random)}, unit(random), unit(random)};
  if (glm::dot(cone.direction, cone.normal) < 0.0f) cone.direction = -cone.direction;
  cone.spread = 0.3f + 0.3f * uniform(random);
  cone.falloff = 0.5f;
  return cone;
}

TEST(NestedCones, ofOneVolumeAreItsOwnToTheBit) {
  VoxelLevel level;
  level.surfaces = {{{0.25f, 0.5f, 1.0f}}};
  addClutter(level);
  const NestedRoom room(level, nestedAbout(1, kCells, kLow, kHigh, {0, 0, 0}), albedoOfLitSide);
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const Cone cone = coneOf(random);
    const ConeLight found = room.cones().trace(cone), own = room.outermost(cone);
    EXPECT_EQ(found.radiance, own.radiance);
    EXPECT_EQ(found.clear, own.clear);
    EXPECT_EQ(found.occlusion, own.occlusion);
  }
}

// Where the inner volumes are not, a cone sees what it would without them.
TEST(NestedCones, awayFromTheInnerVolumesSeeTheOutermost) {
  VoxelLevel level;
  level.surfaces = {{{0.25f, 0.5f, 1.0f}}};
  addClutter(level);
  const NestedRoom room(level, nestedAbout(3, kCells, kLow, {12, 4, 4}, {10, 0, 0}), albedoOfLitSide);
  std::mt19937 random(2);
  int blocked = 0;
  for (int i = 0; i < 200; ++i) {
    Cone cone = coneOf(random);
    if (cone.direction.x > 0.0f) cone.direction.x = -cone.direction.x;
    cone.originWorld.x = std::min(cone.originWorld.x, -1.0f);
    cone.normal = cone.direction;
    const ConeLight found = room.cones().trace(cone), own = room.outermost(cone);
    EXPECT_NEAR(found.radiance.y, own.radiance.y, 1e-4f);
    EXPECT_NEAR(found.clear, own.clear, 1e-4f);
    EXPECT_NEAR(found.occlusion, own.occlusion, 1e-4f);
    blocked += own.clear < 0.5f;
  }
  EXPECT_GT(blocked, 100);
}

// A dark plate before a bright wall, in voxels of the outermost volume that it fills in part: they are bright. In the
// innermost both are apart.
TEST(NestedCones, aPlateThatTheInnerVolumeResolvesHidesWhatIsBehindIt) {
  for (const float x : {0.15f, 0.22f, 0.3f}) {
    VoxelLevel level;
    level.surfaces = {{glm::vec3(0.0f)}, {glm::vec3(1.0f)}};
    level.addQuad({x, -0.2f, -0.25f}, {x, -0.2f, 0.25f}, {x, 0.3f, 0.25f}, {x, 0.3f, -0.25f}, 0);
    level.addQuad({x + 0.14f, -40, -40}, {x + 0.14f, -40, 40}, {x + 0.14f, 40, 40}, {x + 0.14f, 40, -40}, 1);
    const NestedRoom room(level, nestedAbout(4, 8, {-8, -8, -8}, {8, 8, 8}, {0, 0, 0}), albedoOfLitSide);
    for (const float spread : {0.02f, 0.1f}) {
      const Cone cone{{-0.95f, 0.05f, 0}, {1, 0, 0}, {1, 0, 0}, spread};
      EXPECT_GT(room.outermost(cone).radiance.x, 0.2f) << x << ' ' << spread;
      EXPECT_LT(room.cones().trace(cone).radiance.x, 0.01f) << x << ' ' << spread;
      EXPECT_LT(room.cones().trace(cone).clear, 0.01f);
    }
  }
}

// In whichever volume it stands, and where one takes over from the other.
TEST(NestedCones, aPlaneFillsAConeWhereverItIs) {
  for (const float x : {0.5f, 1.0f, 1.9f, 2.3f, 2.9f, 3.1f, 3.6f, 4.5f, 5.2f, 6.1f, 7.7f}) {
    VoxelLevel level;
    level.surfaces = {{{0.25f, 0.5f, 1.0f}}};
    level.addQuad({x, -40, -40}, {x, -40, 40}, {x, 40, 40}, {x, 40, -40});
    const NestedRoom room(level, nestedAbout(3, kCells, {-8, -8, -8}, {8, 8, 8}, {0, 0, 0}), albedoOfLitSide);
    for (const float spread : {0.0f, 0.1f, 0.25f, 0.5f}) {
      for (const float phase : {0.0f, 0.07f, 0.11f, 0.19f}) {
        const ConeLight light = room.cones().trace({{phase, phase, 0}, {1, 0, 0}, {1, 0, 0}, spread});
        EXPECT_NEAR(light.radiance.x, 0.25f, 0.005f) << x << ' ' << spread << ' ' << phase;
        EXPECT_NEAR(light.radiance.z, 1.0f, 0.01f);
        EXPECT_LE(light.clear, 0.01f);
      }
    }
  }
}

// A floor does not hide the sky from itself where a cone along it leaves a volume for one of larger voxels.
TEST(NestedCones, aConeDoesNotMeetThePlaneThatItStartsOn) {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(1.0f)}};
  level.addQuad({-8, 0.03f, -8}, {-8, 0.03f, 8}, {8, 0.03f, 8}, {8, 0.03f, -8});
  const NestedRoom room(level, nestedAbout(4, kCells, {-8, -8, -8}, {8, 8, 8}, {0, 0, 0}), albedoOfLitSide);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  float worst = 0.0f, alone = 0.0f;
  for (int i = 0; i < 400; ++i) {
    const float elevation = 0.1f + 0.9f * std::abs(uniform(random)), angle = 3.14f * uniform(random),
                flat = std::sqrt(1.0f - elevation * elevation);
    const glm::vec3 direction(flat * std::cos(angle), elevation, flat * std::sin(angle));
    const glm::vec3 at(2.0f * uniform(random), 0.03f, 2.0f * uniform(random));
    const Cone cone{at, {0, 1, 0}, direction, 0.25f};
    worst = std::max(worst, 1.0f - room.cones().trace(cone).clear);
    alone = std::max(alone, 1.0f - room.outermost(cone).clear);
  }
  EXPECT_LE(worst, alone + 0.01f);
  EXPECT_LE(worst, 0.04f);
}

// Receivers in each volume and between two see the furnace, and no more than that.
TEST(NestedCones, aReceiverInAFurnaceSeesItAndNoMore) {
  VoxelLevel level;
  level.surfaces[0] = {glm::vec3(1.0f)};
  level.addBox(kLow, kHigh, true);
  level.addBox({-1, -4, -1}, {1, -2, 1}, false);
  const NestedRoom room(level, nestedAbout(3, kCells, kLow, kHigh, {3.9f, -3.9f, 3.9f}),
                        [](const VoxelVolume&, std::uint32_t) { return glm::vec3(1.0f); });
  const ConeTracer cones(room.volumes.all(), room.mips.all(), {});
  const glm::vec3 up(0, 1, 0);
  for (const float x : {-3.99f, -1.7f, -0.3f, 0.4f, 1.4f, 1.9f, 2.2f, 3.4f, 3.95f}) {
    const glm::vec3 at(x, -4, 3.97f);
    const Gathered around = cones.hemisphere(at, up, up, 0.0f);
    EXPECT_NEAR(around.radiance.x, 1.0f, 0.05f) << x;
    EXPECT_LE(around.radiance.x, 1.0001f) << x;
    EXPECT_NEAR(around.occlusion, 1.0f, 0.05f) << x;
    for (const glm::vec3& towards : {glm::vec3(0.7f, 0.7f, 0), glm::vec3(-0.7f, 0.7f, 0), glm::vec3(0, 0.2f, -1)}) {
      for (const float exponent : {4.0f, 64.0f, 1000.0f}) {
        const float mirrored = cones.glossy(at, up, glm::normalize(towards), exponent).x;
        EXPECT_NEAR(mirrored, 1.0f, 0.1f) << x << ' ' << exponent;
        EXPECT_LE(mirrored, 1.0001f) << x << ' ' << exponent;
      }
    }
  }
}

TEST(NestedCones, wideSamplesTakeTheOuterVolumeEarlier) {
  VoxelLevel level;
  level.addBox(kLow, kHigh, true);
  const NestedRoom room(level, nestedAbout(2, kCells, kLow, kHigh, {0, 0, 0}), albedoOfLitSide);
  const VolumeReach& reach = room.volumes[1].reach();
  const glm::vec3 middle(0.5f * glm::vec3(room.volumes[1].grid().voxels()));
  EXPECT_EQ(reach.share(middle, 1.0f), 1.0f);
  EXPECT_EQ(reach.share({reach.low.x + 9.0f, middle.y, middle.z}, 1.0f), 1.0f);
  EXPECT_EQ(reach.share({reach.low.x + 9.0f, middle.y, middle.z}, 5.0f), 0.5f);
  EXPECT_EQ(reach.share({reach.low.x + 9.0f, middle.y, middle.z}, 9.0f), 0.0f);
  EXPECT_EQ(reach.share({reach.low.x - 3.0f, middle.y, middle.z}, 1.0f), 0.0f);
}

TEST(NestedCones, aConeOfNonsenseFindsNothing) {
  VoxelLevel level;
  level.addBox({-3, -3, -3}, {3, 3, 3}, true);
  const NestedRoom room(level, nestedAbout(2, kCells, kLow, kHigh, {0, 0, 0}), albedoOfLitSide);
  const Cone good{{0, 0, 0}, {0, 1, 0}, {0, 1, 0}, 0.25f};
  EXPECT_LT(room.cones().trace(good).clear, 0.01f);
  Cone cone = good;
  cone.direction.z = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(room.cones().trace(cone).clear, 1.0f);
  cone = good;
  cone.spread = std::numeric_limits<float>::infinity();
  EXPECT_TRUE(std::isfinite(room.cones().trace(cone).radiance.x));
  cone = good;
  cone.originWorld = {500, 0, 0};
  EXPECT_EQ(room.cones().trace(cone).clear, 1.0f);
}

}  // namespace
}  // namespace relume
