// SPDX-License-Identifier: MIT
// Light without a bake in volumes that lie in one another: across their borders, after they have moved, on threads.
#include "runtime/live/nested_caches.h"

#include "relume/live_light.h"
#include "tests/live/lit_volumes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr float kPi = std::numbers::pi_v<float>;

NestedVolumes nestedOf(VoxelLevel& level, std::uint32_t cascades, std::uint32_t cells,
                       std::optional<glm::vec3> eye = std::nullopt, ParallelFor parallelFor = {}) {
  NestedOptions options;
  options.outermost.cells = cells;
  options.outermost.parallelFor = std::move(parallelFor);
  options.cascades = cascades;
  options.eyeWorld = eye;
  auto made = NestedVolumes::create(level.geometry(), options);
  EXPECT_TRUE(made) << made.error().message;
  return std::move(*made);
}

NestedCaches nestedLight(std::uint32_t rays = 64) {
  auto made = NestedCaches::create({rays});
  EXPECT_TRUE(made);
  return std::move(*made);
}

void runNested(NestedCaches& live, NestedVolumes& volumes, LiveFrame frame, int frames) {
  for (int f = 0; f < frames; ++f) {
    frame.raySet = static_cast<std::uint32_t>(f);
    const Status ok = live.update(volumes, frame);
    ASSERT_TRUE(ok) << ok.error().message;
  }
}

// Of the last frames the mean, as a picture averages them.
void settle(NestedCaches& live, NestedVolumes& volumes, LiveFrame frame) {
  for (int f = 0; f < 56; ++f) {
    const auto kept = static_cast<float>(std::max(f - 24, 0));
    frame.keep = kept / (kept + 1.0f);
    frame.raySet = static_cast<std::uint32_t>(f);
    ASSERT_TRUE(live.update(volumes, frame));
  }
}

// A hall with a lamp in its ceiling at one end and boxes on its floor.
VoxelLevel litHall() {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.6f, 0.5f, 0.4f)}, {glm::vec3(0.0f), glm::vec3(6.0f)}, {glm::vec3(0.2f, 0.6f, 0.3f)}};
  level.addBox({0, 0, 0}, {24, 4, 6}, true);
  level.addQuad({2, 3.9f, 1}, {9, 3.9f, 1}, {9, 3.9f, 5}, {2, 3.9f, 5}, 1);  // faces down
  for (int i = 0; i < 4; ++i) {
    const float x = 3.2f + 5.3f * static_cast<float>(i);
    level.addBox({x, 0, 3.4f}, {x + 1.2f, 1.6f, 4.9f}, false, 2);
  }
  return level;
}

TEST(NestedCaches, oneVolumeIsAsWithoutOthers) {
  VoxelLevel level = litHall();
  VoxelVolume volume = volumeOf(level, coarse(16));
  NestedVolumes volumes = nestedOf(level, 1, 16);
  LiveCaches one = light();
  NestedCaches nested = nestedLight();
  run(one, volume, {}, 6);
  runNested(nested, volumes, {}, 6);
  ASSERT_EQ(one.coefficients().size(), nested[0].coefficients().size());
  EXPECT_EQ(std::memcmp(one.coefficients().data(), nested[0].coefficients().data(), one.coefficients().size_bytes()),
            0);
  for (float x = -0.5f; x < 25.0f; x += 0.37f)
    EXPECT_EQ(one.irradiance({x, 0, 2}, {0, 1, 0}), nested.irradiance({x, 0, 2}, {0, 1, 0}));
}

// A furnace is the same everywhere: within the volumes, at their faces, and beyond.
TEST(NestedCaches, aFurnaceIsExactAcrossBorders) {
  for (const float albedo : {0.5f, 0.8f}) {
    VoxelLevel level;
    level.surfaces[0] = {glm::vec3(albedo), {1, 2, 0}};
    level.addBox({0, 0, 0}, {16, 4, 6}, true);
    NestedVolumes volumes = nestedOf(level, 3, 16, glm::vec3(6, 2, 3));
    NestedCaches live = nestedLight();
    runNested(live, volumes, {}, 40);
    const float expected = kPi / (1.0f - albedo);
    double sum = 0.0;
    int count = 0;
    for (float x = 0.5f; x < 16.0f; x += 0.125f) {
      for (float z = 0.75f; z < 6.0f; z += 0.75f) {
        const glm::vec3 e = live.irradiance({x, 0, z}, {0, 1, 0});
        EXPECT_NEAR(e.x, expected, 0.04f * expected) << x;
        EXPECT_NEAR(e.y, 2.0f * e.x, 0.01f * e.x);
        EXPECT_EQ(e.z, 0.0f);
        sum += static_cast<double>(e.x);
        ++count;
      }
    }
    EXPECT_NEAR(sum / count, static_cast<double>(expected), 0.01 * static_cast<double>(expected)) << albedo;
  }
}

// Albedo 1 and a volume that walks: what is there goes round and never grows.
TEST(NestedCaches, aWhiteFurnaceStaysBounded) {
  VoxelLevel level;
  level.surfaces[0] = {glm::vec3(1.0f), glm::vec3(1.0f)};
  level.addBox({0, 0, 0}, {8, 2, 2}, true);
  NestedVolumes volumes = nestedOf(level, 3, 8);
  NestedCaches live = nestedLight(16);
  const auto largestOf = [&] {
    float most = 0.0f;
    for (std::size_t i = 0; i < live.size(); ++i) most = std::max(most, largest(live[i]));
    return most;
  };
  runNested(live, volumes, {}, 200);
  const float y0 = std::sqrt(4.0f * kPi), lit = largestOf();
  EXPECT_LT(lit, 200.0f * 2.0f * y0);
  EXPECT_GT(lit, 200.0f * 0.5f * y0);
  LiveFrame dark;
  dark.emissionScale = glm::vec3(0.0f);
  float before = lit;
  for (int k = 0; k < 40; ++k) {
    ASSERT_TRUE(volumes.centre({4.0f + 3.5f * std::sin(0.4f * static_cast<float>(k)), 1, 1}));
    runNested(live, volumes, dark, 10);
    EXPECT_LT(largestOf(), 1.01f * before) << k;
    before = std::min(before, largestOf());
  }
}

// Along the floor no step where one volume takes over from another.
TEST(NestedCaches, lightGoesOnAcrossBorders) {
  VoxelLevel level = litHall();
  NestedVolumes volumes = nestedOf(level, 3, 16, glm::vec3(14, 2, 3));
  NestedCaches live = nestedLight(256);
  settle(live, volumes, {});
  constexpr float kStep = 0.01f;
  glm::vec3 before = live.irradiance({9.0f, 0, 1.5f}, {0, 1, 0});
  float largest = 0.0f;
  bool reads[3] = {false, false, false};
  for (float x = 9.0f + kStep; x < 23.5f; x += kStep) {
    const glm::vec3 e = live.irradiance({x, 0, 1.5f}, {0, 1, 0});
    largest = std::max(largest, std::abs(e.x - before.x) / std::max(before.x, 1e-3f));
    before = e;
    const NestedStencil stencil = live.stencil({x, 0, 1.5f}, {0, 1, 0});
    for (std::size_t i = 0; i < 3; ++i) reads[i] = reads[i] || stencil.share[i] > 0.9f;
  }
  EXPECT_TRUE(reads[0] && reads[1] && reads[2]);
  EXPECT_LT(largest, 0.03f);
}

// A sky is seen through all of them.
TEST(NestedCaches, aConstantSkyLightsAnOpenPlane) {
  VoxelLevel level;
  level.addQuad({-8, 0, -8}, {-8, 0, 8}, {8, 0, 8}, {8, 0, -8});
  level.addQuad({-8, -4, -8}, {-8, -4, 8}, {8, -4, 8}, {8, -4, -8});  // so that the box has a height
  level.addQuad({-8, 4, -8}, {-8, 4, -7.9f}, {-7.9f, 4, -7.9f}, {-7.9f, 4, -8});
  NestedVolumes volumes = nestedOf(level, 3, 16, glm::vec3(0, 0.5f, 0));
  NestedCaches live = nestedLight(512);
  LiveFrame frame;
  frame.sky.radiance = {0.5f, 1.0f, 2.0f};
  runNested(live, volumes, frame, 2);
  for (float x = -6.0f; x < 7.0f; x += 0.25f) {
    const glm::vec3 e = live.irradiance({x, 0, 0.2f}, {0, 1, 0});
    EXPECT_NEAR(e.x, 0.5f * kPi, 0.02f * kPi) << x;
    EXPECT_NEAR(e.z, 2.0f * kPi, 0.08f * kPi) << x;
  }
}

// A box that follows the eye ends in the sky, without a step.
TEST(NestedCaches, aBoxThatFollowsTheEyeFadesIntoTheSky) {
  VoxelLevel level;
  level.surfaces[0].albedo = glm::vec3(0.0f);
  level.addQuad({-40, 0, -40}, {-40, 0, 40}, {40, 0, 40}, {40, 0, -40});
  for (int i = 0; i < 20; ++i)
    level.addBox({-40.0f + 4.0f * static_cast<float>(i), 0, 1.5f}, {-39.0f + 4.0f * static_cast<float>(i), 3, 2.5f},
                 false);
  LiveLightOptions options;
  options.boxMin = {0, -1, -4};
  options.boxMax = {8, 5, 4};
  options.cells = 8;
  options.cascades = 2;
  options.raysPerCell = 256;
  options.boxFollowsEye = true;
  options.eyeWorld = {10, 1, 0};
  auto light = LiveLight::create(level.geometry(), options);
  ASSERT_TRUE(light) << light.error().message;
  LiveFrame frame;
  frame.sky.radiance = glm::vec3(1.0f);
  for (float eye = 10.0f; eye > -10.0f; eye -= 1.7f) {
    ASSERT_TRUE(light->centre({eye, 1, 0}));
    ASSERT_TRUE(light->update({}, frame));
  }
  EXPECT_NEAR(light->irradiance({30, 0, 0.5f}, {0, 1, 0}).x, kPi, 0.01f * kPi) << "beyond it";
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  for (const glm::vec3& normal : {glm::vec3(kNan, 0, 1), glm::vec3(0, kInfinity, 0), glm::vec3(0, 0, -3e38f)}) {
    for (const float x : {30.0f, -10.0f, -6.5f})
      EXPECT_EQ(light->irradiance({x, 0, 0.5f}, normal), glm::vec3(0.0f)) << x;
  }
  float before = light->irradiance({-20, 0, 0.5f}, {0, 1, 0}).x, darkest = before;
  for (float x = -20.0f; x < 5.0f; x += 0.02f) {
    const float e = light->irradiance({x, 0, 0.5f}, {0, 1, 0}).x;
    EXPECT_LT(std::abs(e - before), 0.06f * before) << x;
    before = e;
    darkest = std::min(darkest, e);
  }
  EXPECT_LT(darkest, 0.95f * kPi) << "the boxes hide nothing";
  light->reset();
  EXPECT_EQ(light->irradiance({30, 0, 0.5f}, {0, 1, 0}), glm::vec3(0.0f));
}

// The eye walks off and comes back: the light is that from before, once it has settled.
TEST(NestedCaches, lightComesBackWithTheEye) {
  VoxelLevel level = litHall();
  const glm::vec3 home(5.1f, 2, 3);
  NestedVolumes volumes = nestedOf(level, 3, 16, home);
  NestedCaches live = nestedLight();
  settle(live, volumes, {});
  std::vector<glm::vec3> before;
  for (float x = 0.5f; x < 23.5f; x += 0.21f) before.push_back(live.irradiance({x, 0, 1.7f}, {0, 1, 0}));
  int moved = 0;
  const auto walk = [&](float from, float to) {
    for (int i = 1; i <= 40; ++i) {
      const Result<bool> now = volumes.centre({from + (to - from) * static_cast<float>(i) / 40.0f, 2, 3});
      ASSERT_TRUE(now);
      moved += *now ? 1 : 0;
      LiveFrame frame;
      frame.keep = 0.5f;
      frame.raySet = static_cast<std::uint32_t>(i);
      ASSERT_TRUE(live.update(volumes, frame));
    }
  };
  walk(home.x, 21.0f);
  EXPECT_GT(moved, 20);
  ASSERT_TRUE(volumes.centre({21, 2, 3}));
  walk(21.0f, home.x);
  const glm::ivec3 there = volumes[2].grid().shift;
  EXPECT_EQ(there, nestedOf(level, 3, 16, home)[2].grid().shift);
  settle(live, volumes, {});
  std::size_t i = 0;
  for (float x = 0.5f; x < 23.5f; x += 0.21f) {
    const glm::vec3 e = live.irradiance({x, 0, 1.7f}, {0, 1, 0});
    EXPECT_NEAR(e.x, before[i].x, 1e-3f * before[i].x) << x;
    ++i;
  }
}

// Light that has settled stays as steady where volumes take over from one another as elsewhere, while the eye walks.
TEST(NestedCaches, noReceiverJumpsWhileTheEyeWalks) {
  VoxelLevel level = litHall();
  NestedVolumes volumes = nestedOf(level, 3, 16, glm::vec3(5, 2, 3));
  NestedCaches live = nestedLight(32);
  for (int f = 0; f < 30; ++f) ASSERT_TRUE(live.update(volumes, {}));
  std::vector<float> before;
  float largest = 0.0f;
  int moved = 0;
  for (int f = 0; f < 60; ++f) {
    const Result<bool> now = volumes.centre({5.0f + 0.03f * static_cast<float>(f), 2, 3});
    ASSERT_TRUE(now);
    moved += *now ? 1 : 0;
    LiveFrame frame;
    frame.keep = 0.9f;
    ASSERT_TRUE(live.update(volumes, frame));
    std::vector<float> light;
    for (float x = 0.5f; x < 23.5f; x += 0.07f) light.push_back(live.irradiance({x, 0, 1.7f}, {0, 1, 0}).x);
    for (std::size_t i = 0; i < before.size(); ++i)
      largest = std::max(largest, std::abs(light[i] - before[i]) / before[i]);
    before = light;
  }
  EXPECT_GT(moved, 4);
  EXPECT_LT(largest, 0.03f);
}

// What stays in the volume keeps its light to the bit; what has entered has some at once.
TEST(NestedCaches, aMoveKeepsWhatStays) {
  VoxelLevel level = litHall();
  NestedVolumes volumes = nestedOf(level, 2, 16, glm::vec3(10, 2, 3));
  NestedCaches live = nestedLight();
  settle(live, volumes, {});
  const LiveCaches before = live[1];
  const VolumeGrid was = volumes[1].grid();
  ASSERT_TRUE(*volumes.centre({12.2f, 2, 3}));
  LiveFrame frozen;
  frozen.keep = 0.999f;
  ASSERT_TRUE(live.update(volumes, frozen));
  const CellSet &cells = live[1].cells(), &old = before.cells();
  const glm::ivec3 by = volumes[1].grid().shift - was.shift;
  ASSERT_GT(by.x, 0);
  std::uint32_t kept = 0, entered = 0, dark = 0;
  for (std::size_t i = 0; i < cells.active.size(); ++i) {
    const glm::ivec3 from = cells.grid.cellAt(cells.active[i]) + by;
    const float now = live[1].coefficients()[27 * i];
    dark += now > 0.0f ? 0 : 1;  // within the boxes
    if (!old.grid.holdsCell(from) || old.slot[old.grid.cellIndex(from)] == kInactive) {
      ++entered;
      continue;
    }
    const float then = before.coefficients()[27 * old.slot[old.grid.cellIndex(from)]];
    EXPECT_NEAR(now, then, 5e-3f * then + 1e-3f);
    ++kept;
  }
  EXPECT_GT(kept, 4 * entered);
  EXPECT_GT(entered, 20u);
  EXPECT_LT(20 * dark, kept);
  // Farther than itself: nothing is kept, and yet it is not dark.
  ASSERT_TRUE(*volumes.centre({23, 2, 3}));
  ASSERT_TRUE(live.update(volumes, frozen));
  EXPECT_GT(live.irradiance({21, 0, 1.5f}, {0, 1, 0}).x, 0.0f);
}

TEST(NestedCaches, sameBytesAtAnyNumberOfThreads) {
  VoxelLevel level = litHall();
  std::vector<std::vector<float>> found;
  for (const unsigned threads : {1u, 2u, 7u}) {
    NestedVolumes volumes = nestedOf(level, 3, 12, std::nullopt,
                                     [threads](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
                                       onThreads(threads, tasks, body);
                                     });
    NestedCaches live = nestedLight(32);
    std::vector<float>& all = found.emplace_back();
    for (int f = 0; f < 8; ++f) {
      ASSERT_TRUE(volumes.centre({6.0f + 1.7f * static_cast<float>(f), 2, 3}));
      LiveFrame frame;
      frame.keep = 0.25f;
      frame.raySet = static_cast<std::uint32_t>(f);
      ASSERT_TRUE(live.update(volumes, frame));
    }
    for (std::size_t i = 0; i < live.size(); ++i)
      all.insert(all.end(), live[i].coefficients().begin(), live[i].coefficients().end());
  }
  for (const std::vector<float>& all : found) {
    ASSERT_EQ(all.size(), found[0].size());
    EXPECT_EQ(std::memcmp(all.data(), found[0].data(), all.size() * sizeof(float)), 0);
  }
}

// After a walk caches stand where they would have been placed there.
TEST(NestedCaches, cachesOfAMovedVolumeStandAsInANewOne) {
  VoxelLevel level = litHall();
  NestedVolumes volumes = nestedOf(level, 2, 24, glm::vec3(8, 2, 3));
  NestedCaches live = nestedLight(16);
  runNested(live, volumes, {}, 1);
  for (const glm::vec3& eye :
       {glm::vec3(9, 2, 3), glm::vec3(9.6f, 2, 3), glm::vec3(13, 2, 3), glm::vec3(12.2f, 2, 3)}) {
    ASSERT_TRUE(*volumes.centre(eye));
    runNested(live, volumes, {}, 1);
    const CellSet &moved = live[1].cells(), found = findCells(volumes[1]);
    EXPECT_EQ(moved.active, found.active);
    EXPECT_EQ(moved.place, found.place);
    EXPECT_EQ(moved.slot, found.slot);
    // And voxels read the same ones of them.
    NestedCaches fresh = nestedLight(16);
    LiveFrame frozen;
    frozen.freezeVoxels = true;
    ASSERT_TRUE(fresh.update(volumes, frozen));
    NestedVolumes copy = volumes;
    ASSERT_TRUE(fresh.update(copy, {}));
    NestedCaches carried = live;
    carried.reset();
    ASSERT_TRUE(carried.update(volumes, frozen));
    copy = volumes;
    ASSERT_TRUE(carried.update(copy, {}));
    // To the rounding of places in a grid that begins elsewhere.
    const float most = largest(fresh[1]);
    std::size_t others = 0;
    for (std::size_t i = 0; i < fresh[1].coefficients().size(); ++i)
      others += std::abs(fresh[1].coefficients()[i] - carried[1].coefficients()[i]) > 1e-4f * most ? 1 : 0;
    EXPECT_LT(200 * others, fresh[1].coefficients().size());
  }
}

// As games call it.
TEST(NestedCaches, liveLightFollowsTheEye) {
  VoxelLevel level = litHall();
  LiveLightOptions options;
  options.cells = 16;
  options.cascades = 3;
  options.eyeWorld = {5, 2, 3};
  auto light = LiveLight::create(level.geometry(), options);
  ASSERT_TRUE(light) << light.error().message;
  for (std::uint32_t f = 0; f < 12; ++f) {
    LiveFrame frame;
    frame.raySet = f;
    ASSERT_TRUE(light->update({}, frame));
  }
  EXPECT_FALSE(*light->centre({5, 2, 3}));
  const glm::vec3 before = light->irradiance({6, 0, 2}, {0, 1, 0});
  EXPECT_GT(before.x, 0.0f);
  const auto refused = light->centre({std::numeric_limits<float>::quiet_NaN(), 0, 0});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::usage);
  EXPECT_EQ(light->irradiance({6, 0, 2}, {0, 1, 0}), before);
  EXPECT_TRUE(*light->centre({15, 2, 3}));
  ASSERT_TRUE(light->update({}, {}));
  EXPECT_GT(light->irradiance({15, 0, 2}, {0, 1, 0}).x, 0.0f);
  options.cascades = 1;
  auto one = LiveLight::create(level.geometry(), options);
  ASSERT_TRUE(one);
  EXPECT_FALSE(*one->centre({20, 2, 3}));
  EXPECT_GT(light->voxels().occupied, 2 * one->voxels().occupied);
  options.cascades = 5;
  EXPECT_FALSE(LiveLight::create(level.geometry(), options));
  options.cascades = 2;
  options.eyeWorld = glm::vec3(std::numeric_limits<float>::infinity());
  EXPECT_FALSE(LiveLight::create(level.geometry(), options));
}

}  // namespace
}  // namespace relume
