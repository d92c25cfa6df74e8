// SPDX-License-Identifier: MIT
// Radiance of voxels at every scale, and what cones find in it.
#include "runtime/cones/radiance_mips.h"
#include "tests/voxels/boxes.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace relume {
namespace {

using test::VoxelLevel;

VoxelOptions boxed(const glm::vec3& low, const glm::vec3& high, std::uint32_t cells = 16) {
  VoxelOptions options;
  options.boxMin = low;
  options.boxMax = high;
  options.cells = cells;
  return options;
}

constexpr auto kSix = RadianceMips::Directions::six, kOne = RadianceMips::Directions::one;

// A volume whose sides send out as much radiance as they have albedo: those that triangles face, or all.
struct Lit {
  VoxelVolume volume;
  RadianceMips mips;

  Lit(VoxelLevel& level, const VoxelOptions& options, bool bothSides = false,
      RadianceMips::Directions directions = kSix)
      : volume(std::move(*VoxelVolume::create(level.geometry(), options))), mips(directions) {
    const auto irradiance = [&](const SideAt& at) {
      return glm::vec3(bothSides || at.side.isFaced ? std::numbers::pi_v<float> : 0.0f);
    };
    volume.reflect(irradiance, glm::vec3(0.0f));
    EXPECT_TRUE(mips.update(volume));
  }
  ConeLight trace(const Cone& cone) const { return mips.trace(volume, cone); }
};

VoxelSurface sending(const glm::vec3& radiance) { return {radiance}; }

// A square across the x axis that faces -x, wider than anything here looks.
void addWall(VoxelLevel& level, float x, std::uint32_t surface) {
  level.addQuad({x, -40, -40}, {x, -40, 40}, {x, 40, 40}, {x, 40, -40}, surface);
}

TEST(RadianceMips, aPlaneFillsAConeWhateverItsDistanceAndWidth) {
  for (const float x : {1.0f, 2.07f, 3.5f, 7.77f, 7.9f}) {
    VoxelLevel level;
    level.surfaces = {sending({0.25f, 0.5f, 1.0f})};
    addWall(level, x, 0);
    const Lit lit(level, boxed({-8, -8, -8}, {8, 8, 8}));
    for (const float spread : {0.0f, 0.1f, 0.25f, 0.5f}) {
      for (const float phase : {0.0f, 0.07f, 0.11f, 0.19f}) {
        const ConeLight light = lit.trace({{phase, phase, 0}, {1, 0, 0}, {1, 0, 0}, spread});
        EXPECT_NEAR(light.radiance.x, 0.25f, 0.005f) << x << ' ' << spread << ' ' << phase;
        EXPECT_NEAR(light.radiance.z, 1.0f, 0.01f);
        EXPECT_LE(light.clear, 0.01f);
        EXPECT_NEAR(light.occlusion, 1.0f, 0.01f);
      }
    }
  }
}

// Of a wall whose back is dark a wide cone at a slant sees the front: rays along the wall, of which there are two in
// the six directions, say nothing of the side.
TEST(RadianceMips, aPlaneAtASlantShowsTheSideThatFacesTheCone) {
  VoxelLevel level;
  level.surfaces = {sending(glm::vec3(1.0f))};
  addWall(level, 5.0f, 0);
  level.addQuad({-5, 40, -40}, {-5, 40, 40}, {-5, -40, 40}, {-5, -40, -40}, 0);  // which faces +x
  const Lit lit(level, boxed({-8, -16, -16}, {8, 16, 16}, 32));
  for (const float slant : {0.5f, 0.8f, 1.0f}) {
    const glm::vec3 way = glm::normalize(glm::vec3(1.0f, slant, 0.5f * slant));
    for (const glm::vec3& d : {way, -way}) {
      for (const float spread : {0.1f, 0.25f, 0.4f})
        EXPECT_NEAR(lit.trace({{0, 0, 0}, d, d, spread}).radiance.x, 1.0f, 0.02f) << slant << ' ' << spread;
    }
  }
}

TEST(RadianceMips, nothingShinesThroughAWallOfOneVoxel) {
  for (const float x : {1.0f, 1.06f, 1.13f, 3.2f}) {
    VoxelLevel level;
    level.surfaces = {sending(glm::vec3(0.0f)), sending(glm::vec3(1.0f))};
    addWall(level, x, 0);
    addWall(level, x + 2.0f, 1);
    const Lit lit(level, boxed({-8, -8, -8}, {8, 8, 8}));
    for (const float spread : {0.0f, 0.25f, 0.5f})
      EXPECT_LE(lit.trace({{0, 0.05f, 0}, {1, 0, 0}, {1, 0, 0}, spread}).radiance.x, spread < 0.5f ? 0.01f : 0.05f)
          << x << ' ' << spread;
  }
}

// Fewer voxels stand for a slanted wall; and what covers half of a wide voxel and half of the next may cover the same
// half.
TEST(RadianceMips, slantedWallsLetLittleThrough) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  float worst = 0.0f, sum = 0.0f;
  int cones = 0;
  for (int turn = 0; turn < 10; ++turn) {
    const glm::quat q = glm::normalize(glm::quat(uniform(random), uniform(random), uniform(random), uniform(random)));
    VoxelLevel level;
    level.surfaces = {sending(glm::vec3(0.0f)), sending(glm::vec3(1.0f))};
    level.addBox(glm::vec3(-4.0f), glm::vec3(4.0f), true);
    for (glm::vec3& p : level.meshes[0].position) p = q * p;
    level.addBox(glm::vec3(-9.0f), glm::vec3(9.0f), true, 1);
    const Lit lit(level, boxed(glm::vec3(-9.0f), glm::vec3(9.0f)), true);
    for (int k = 0; k < 40; ++k) {
      const glm::vec3 d = glm::normalize(glm::vec3(uniform(random), uniform(random), uniform(random)));
      const ConeLight light = lit.trace({q * glm::vec3(uniform(random), uniform(random), uniform(random)), d, d, 0.1f});
      worst = std::max(worst, light.radiance.x);
      sum += light.radiance.x;
      ++cones;
    }
  }
  EXPECT_LE(sum / static_cast<float>(cones), 0.045f);
  EXPECT_LE(worst, 0.45f);
}

TEST(RadianceMips, theTwoSidesOfAWallStayApartAtEveryLevel) {
  VoxelLevel level;
  level.surfaces = {sending({1, 0, 0})};
  addWall(level, 0.1f, 0);
  Lit lit(level, boxed({-8, -8, -8}, {8, 8, 8}));
  for (std::uint32_t l = 0; l <= 4; ++l) {
    const auto width = static_cast<float>(1u << l);
    const glm::vec3 place = lit.volume.grid().toGrid({0.1f, 0, 0});
    // The middle of the voxel of this level that holds the wall.
    const glm::vec3 middle = (glm::floor(place / width) + 0.5f) * width;
    const glm::vec4 front = lit.mips.read(lit.volume, static_cast<float>(l), middle, {1, 0, 0});
    const glm::vec4 back = lit.mips.read(lit.volume, static_cast<float>(l), middle, {-1, 0, 0});
    EXPECT_GE(1.0f - std::exp(-front.w), 0.99f) << l;
    EXPECT_NEAR(front.x / front.w, 1.0f, 0.01f) << l;
    EXPECT_EQ(back.x, 0.0f) << l;
  }
}

TEST(RadianceMips, withOneDirectionAWallThinsOutByHalfALevel) {
  VoxelLevel level;
  level.surfaces = {sending(glm::vec3(1.0f))};
  addWall(level, 0.1f, 0);
  const Lit lit(level, boxed({-8, -8, -8}, {8, 8, 8}), true, kOne);
  for (std::uint32_t l = 0; l <= 4; ++l) {
    const auto width = static_cast<float>(1u << l);
    const glm::vec3 place = lit.volume.grid().toGrid({0.1f, 0, 0});
    const glm::vec3 middle = (glm::floor(place / width) + 0.5f) * width;
    const glm::vec4 seen = lit.mips.read(lit.volume, static_cast<float>(l), middle, {1, 0, 0});
    EXPECT_NEAR(1.0f - std::exp(-seen.w), std::exp2(-static_cast<float>(l)), 0.01f) << l;
    EXPECT_NEAR(seen.x / seen.w, 1.0f, 0.01f) << l;
  }
}

// A floor at any angle to the voxels must not hide the sky from itself.
TEST(RadianceMips, aConeDoesNotMeetThePlaneThatItStartsOn) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  float worst = 0.0f, sum = 0.0f;
  int cones = 0;
  for (int turn = 0; turn < 40; ++turn) {
    const glm::quat q = glm::normalize(glm::quat(uniform(random), uniform(random), uniform(random), uniform(random)));
    VoxelLevel level;
    level.surfaces = {sending(glm::vec3(1.0f))};
    level.addQuad(q * glm::vec3(-7, 0, -7), q * glm::vec3(-7, 0, 7), q * glm::vec3(7, 0, 7), q * glm::vec3(7, 0, -7));
    const Lit lit(level, boxed({-10, -10, -10}, {10, 10, 10}), true);
    for (int k = 0; k < 40; ++k) {
      const float elevation = 0.15f + 0.85f * std::abs(uniform(random)), angle = 3.14f * uniform(random);
      const float flat = std::sqrt(1.0f - elevation * elevation);
      const glm::vec3 direction = q * glm::vec3(flat * std::cos(angle), elevation, flat * std::sin(angle));
      const glm::vec3 at = q * glm::vec3(2.0f * uniform(random), 0, 2.0f * uniform(random));
      const ConeLight light = lit.trace({at, q * glm::vec3(0, 1, 0), direction, 0.25f});
      worst = std::max(worst, 1.0f - light.clear);
      sum += 1.0f - light.clear;
      ++cones;
    }
  }
  EXPECT_LE(sum / static_cast<float>(cones), 0.01f);
  EXPECT_LE(worst, 0.25f);
}

TEST(RadianceMips, whatBlocksAConeHasOneRadianceWhereAllHas) {
  VoxelLevel level;
  level.surfaces = {sending({0.25f, 0.5f, 1.0f})};
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-7.0f, 7.0f);
  for (int i = 0; i < 60; ++i) {
    const glm::vec3 a(uniform(random), uniform(random), uniform(random));
    level.addQuad(a, a + glm::vec3(0.3f, 0, 0), a + glm::vec3(0.3f, 0.3f, 0), a + glm::vec3(0, 0.3f, 0));
  }
  for (const auto directions : {kSix, kOne}) {
    const Lit lit(level, boxed({-8, -8, -8}, {8, 8, 8}), true, directions);
    for (const glm::vec3& direction : {glm::vec3(1, 0, 0), glm::vec3(0.6f, 0.8f, 0), glm::vec3(-0.6f, 0, 0.8f)}) {
      const ConeLight light = lit.trace({{0, 0, 0}, direction, direction, 0.5f});
      EXPECT_GT(light.clear, 0.0f);
      EXPECT_LT(light.clear, 1.0f);
      EXPECT_NEAR(light.radiance.z, 1.0f - light.clear, 1e-4f);
      EXPECT_NEAR(light.radiance.y, 0.5f * light.radiance.z, 1e-4f);
      EXPECT_NEAR(light.occlusion, 1.0f - light.clear, 1e-5f);
    }
  }
}

// VCT prints 1.5 for what six directions cost beside one, the voxels included. One keeps the areas of sides as well.
TEST(RadianceMips, sixDirectionsTakeFiveEighthsMoreThanOne) {
  VoxelLevel level;
  addWall(level, 0.1f, 0);
  const VoxelOptions options = boxed({-8, -8, -8}, {8, 8, 8});
  const Lit six(level, options, true, kSix), one(level, options, true, kOne);
  const double voxels = 64.0 * 64.0 * 64.0 * sizeof(glm::vec4);
  const std::size_t areas = one.volume.sideCount() * sizeof(float), levels = one.mips.sizeBytes() - areas;
  const double ratio = (voxels + static_cast<double>(six.mips.sizeBytes())) / (voxels + static_cast<double>(levels));
  EXPECT_NEAR(ratio, (1.0 + 6.0 / 7.0) / (8.0 / 7.0), 1e-3);
}

TEST(RadianceMips, whatIsFartherOffHidesLess) {
  VoxelLevel level;
  level.surfaces = {sending(glm::vec3(1.0f))};
  addWall(level, 4.0f, 0);
  const Lit lit(level, boxed({-8, -8, -8}, {8, 8, 8}));
  Cone cone{{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, 0.1f};
  EXPECT_NEAR(lit.trace(cone).occlusion, 1.0f, 0.01f);
  cone.falloff = 1.0f;
  EXPECT_NEAR(lit.trace(cone).occlusion, 1.0f / 5.0f, 0.02f);
  EXPECT_EQ(lit.trace({{0, 0, 0}, {-1, 0, 0}, {-1, 0, 0}, 0.1f}).clear, 1.0f);
  EXPECT_EQ(lit.trace({{500, 0, 0}, {1, 0, 0}, {1, 0, 0}, 0.1f}).clear, 1.0f);
}

TEST(RadianceMips, aConeOfNonsenseFindsNothing) {
  VoxelLevel level;
  level.addBox({-3, -3, -3}, {3, 3, 3}, true);
  const Lit lit(level, boxed({-4, -4, -4}, {4, 4, 4}), true);
  const Cone good{{0, 0, 0}, {0, 1, 0}, {0, 1, 0}, 0.25f};
  EXPECT_LT(lit.trace(good).clear, 0.01f);
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinite = std::numeric_limits<float>::infinity();
  const std::vector<std::function<void(Cone&)>> changes{[&](Cone& c) { c.originWorld.x = nan; },
                                                        [&](Cone& c) { c.originWorld.y = 1e30f; },
                                                        [&](Cone& c) { c.direction = glm::vec3(0.0f); },
                                                        [&](Cone& c) { c.direction.z = infinite; },
                                                        [&](Cone& c) { c.normal = glm::vec3(nan); },
                                                        [&](Cone& c) { c.spread = nan; },
                                                        [&](Cone& c) { c.spread = -1.0f; },
                                                        [&](Cone& c) { c.spread = infinite; },
                                                        [&](Cone& c) { c.falloff = infinite; },
                                                        [&](Cone& c) { c.falloff = nan; }};
  for (const auto& change : changes) {
    Cone cone = good;
    change(cone);
    const ConeLight light = lit.trace(cone);
    EXPECT_EQ(light.clear, 1.0f);
    EXPECT_EQ(light.radiance, glm::vec3(0.0f));
  }
}

// From so far away that its steps are lost in rounding it comes to an end.
TEST(RadianceMips, aConeFromAnywhereEnds) {
  VoxelLevel level;
  level.addBox({0.1f, 0.1f, 0.1f}, {0.2f, 0.2f, 0.2f}, false);
  const Lit lit(level, boxed({0, 0, 0}, {1, 1, 1}), true);
  for (float distance = 1.0f; distance < 1e9f; distance *= 1.7f) {
    const ConeLight light = lit.trace({{-distance, 0.8f, 0.8f}, {1, 0, 0}, {1, 0, 0}, 0.0f});
    EXPECT_EQ(light.clear, 1.0f) << distance;
  }
}

TEST(RadianceMips, doNotDependOnThreads) {
  std::vector<std::vector<glm::vec4>> found;
  for (const std::uint32_t threads : {1u, 2u, 7u}) {
    VoxelLevel level;
    level.surfaces = {sending({0.25f, 0.5f, 1.0f})};
    level.addBox({-3, -3, -3}, {3, 2, 3.3f}, true);
    level.addBox({-1, -2, -1}, {0.4f, 0.7f, 1}, false);
    VoxelOptions options = boxed({-4, -4, -4}, {4, 4, 4});
    options.parallelFor = [threads](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
      test::onThreads(threads, tasks, body);
    };
    const Lit lit(level, options);
    auto& values = found.emplace_back();
    for (std::uint32_t l = 0; l <= lit.mips.levels(); ++l) {
      for (float x = 1.0f; x < 60.0f; x += 7.3f)
        values.push_back(lit.mips.read(lit.volume, static_cast<float>(l), {x, 64 - x, 30}, {0.6f, 0, -0.8f}));
    }
  }
  for (std::size_t i = 1; i < found.size(); ++i)
    EXPECT_EQ(std::memcmp(found[i].data(), found[0].data(), found[0].size() * sizeof(glm::vec4)), 0);
}

}  // namespace
}  // namespace relume
