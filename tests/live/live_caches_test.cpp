// SPDX-License-Identifier: MIT
// Light without a bake: bounces, skies, walls, threads, what is refused.
#include "runtime/live/ray_sets.h"
#include "tests/live/lit_volumes.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr float kPi = std::numbers::pi_v<float>;

// Of caps of a tenth of the sphere, by how much the share of directions in them is off: that of several sets, from any
// frame on, against one of as many directions. Sets turned at random would be off by the root of their number, by 2.6
// times as much as that one for 40.
TEST(RaySets, togetherAreNearlyAsEvenAsOne) {
  constexpr float kShare = 0.1f;
  std::mt19937 random(3);
  std::vector<glm::vec3> caps(500);
  for (glm::vec3& cap : caps) cap = unit(random);
  const auto errorOf = [&](const std::vector<glm::vec3>& directions) {
    double sum = 0.0;
    for (const glm::vec3& cap : caps) {
      const auto in = std::count_if(directions.begin(), directions.end(), [&](const glm::vec3& direction) {
        return glm::dot(direction, cap) > 1.0f - 2.0f * kShare;
      });
      const double off = static_cast<double>(in) / static_cast<double>(directions.size()) - kShare;
      sum += off * off;
    }
    return std::sqrt(sum / static_cast<double>(caps.size()));
  };
  for (const std::uint32_t rays : {16u, 64u, 100u, 256u}) {
    for (const std::uint32_t frames : {2u, 8u, 40u}) {
      const double one = errorOf(raysOfSet(rays * frames, 0));
      double most = 0.0;
      for (const std::uint32_t first : {0u, 37u, 1000000u}) {
        std::vector<glm::vec3> all;
        for (std::uint32_t f = 0; f < frames; ++f) {
          const std::vector<glm::vec3> set = raysOfSet(rays, first + f);
          all.insert(all.end(), set.begin(), set.end());
        }
        most = std::max(most, errorOf(all) / one);
      }
      std::printf("%u sets of %u rays are off by %.2f times as much as one of %u\n", frames, rays, most, rays * frames);
      EXPECT_LT(most, 1.9);
    }
  }
}

TEST(LiveCaches, eachFrameIsOneBounce) {
  VoxelLevel level;
  level.surfaces[0] = {glm::vec3(0.5f), glm::vec3(1.0f)};
  level.addBox({0, 0, 0}, {4, 4, 4}, true);
  VoxelVolume volume = volumeOf(level, coarse(16));
  LiveCaches live = light();
  const float expected[3] = {1.0f, 1.5f, 1.75f};
  for (std::uint32_t f = 0; f < 3; ++f) {
    LiveFrame frame;
    frame.raySet = f;
    ASSERT_TRUE(live.update(volume, frame));
    EXPECT_NEAR(live.irradiance({2, 0, 2}, {0, 1, 0}).x, kPi * expected[f], 0.03f * kPi * expected[f]) << f;
  }
}

TEST(LiveCaches, aConstantSkyLightsAnOpenPlane) {
  VoxelLevel level;
  level.addQuad({-4, 0, -4}, {-4, 0, 4}, {4, 0, 4}, {4, 0, -4});
  VoxelOptions options = coarse(16);
  options.boxMin = {-4, -1, -4};
  options.boxMax = {4, 3, 4};
  VoxelVolume volume = volumeOf(level, options);
  LiveCaches live = light(512);
  LiveFrame frame;
  frame.sky.radiance = {0.5f, 1.0f, 2.0f};
  run(live, volume, frame, 2);
  const glm::vec3 e = live.irradiance({0.3f, 0, -0.2f}, {0, 1, 0});
  EXPECT_NEAR(e.x, 0.5f * kPi, 0.02f * kPi);
  EXPECT_NEAR(e.z, 2.0f * kPi, 0.08f * kPi);
  // The same as a map.
  const std::vector<glm::vec3> map(64, frame.sky.radiance);
  LiveCaches mapped = light(512);
  frame.sky.map = map;
  frame.sky.side = 8;
  run(mapped, volume, frame, 2);
  EXPECT_NEAR(mapped.irradiance({0.3f, 0, -0.2f}, {0, 1, 0}).y, e.y, 1e-4f);
  EXPECT_EQ(live.irradiance({50, 0, 0}, {0, 1, 0}), glm::vec3(0.0f));
  EXPECT_EQ(live.irradiance({std::numeric_limits<float>::quiet_NaN(), 0, 0}, {0, 1, 0}), glm::vec3(0.0f));
  EXPECT_EQ(live.irradiance({0, 0, 0}, glm::vec3(std::numeric_limits<float>::quiet_NaN())), glm::vec3(0.0f));
}

TEST(LiveCaches, aThinWallKeepsTheDarkRoomDark) {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.7f)}, {glm::vec3(0.7f), glm::vec3(5.0f)}};
  level.addBox({0, 0, 0}, {4, 3, 4}, true);
  // A wall in the middle, 2 cm thick: a quarter of a voxel.
  level.addBox({1.99f, 0, 0}, {2.01f, 3, 4}, false);
  level.addQuad({1, 2.9f, 1}, {1.5f, 2.9f, 1}, {1.5f, 2.9f, 3}, {1, 2.9f, 3}, 1);
  VoxelVolume volume = volumeOf(level, coarse(16));
  LiveCaches live = light();
  run(live, volume, {}, 30);
  const float lit = live.irradiance({0.5f, 0, 2}, {0, 1, 0}).x;
  EXPECT_GT(lit, 0.1f);
  for (float x = 2.02f; x < 4.0f; x += 0.05f) {
    EXPECT_LE(live.irradiance({x, 0, 2}, {0, 1, 0}).x, 1e-3f * lit) << x;
    EXPECT_LE(live.irradiance({2.01f, 1.0f, x - 1.0f}, {1, 0, 0}).x, 1e-3f * lit) << x;
  }
}

// Floor, ceiling and walls go on beneath a wall that stands on them: voxels at its foot hold both sides' light. By 4096
// rays 1.4e-4 of it come through in the worst of these, of 13 cells.
TEST(LiveCaches, theFootOfAWallIsLitFromItsOwnSide) {
  for (const std::uint32_t cells : {8u, 13u, 16u}) {
    for (const float thickness : {0.1f, 0.2f, 0.35f}) {
      VoxelLevel level;
      level.surfaces = {{glm::vec3(0.7f)}, {glm::vec3(0.7f), glm::vec3(5.0f)}};
      level.addBox({0, 0, 0}, {8, 3, 4}, true);
      level.addBox({4.0f - 0.5f * thickness, 0, 0}, {4.0f + 0.5f * thickness, 3, 4}, false);
      level.addQuad({1, 2.9f, 1}, {1.5f, 2.9f, 1}, {1.5f, 2.9f, 3}, {1, 2.9f, 3}, 1);
      VoxelVolume volume = volumeOf(level, coarse(cells));
      LiveCaches live = light();
      run(live, volume, {}, 15);
      const float lit = live.irradiance({2.0f, 0, 2}, {0, 1, 0}).x;
      EXPECT_GT(lit, 0.05f);
      for (float x = 4.02f + 0.5f * thickness; x < 8.0f; x += x < 4.5f ? 0.03f : 0.25f)
        EXPECT_LE(live.irradiance({x, 0, 2}, {0, 1, 0}).x, 2e-4f * lit)
            << cells << " cells, " << thickness << " m, " << x;
    }
  }
}

// A slit narrower than a voxel lets light through, in proportion to its width.
TEST(LiveCaches, lightComesThroughWhatIsNarrowerThanAVoxel) {
  const auto behind = [](float width) {
    VoxelLevel level;
    level.surfaces = {{glm::vec3(0.0f)}, {glm::vec3(0.0f), glm::vec3(5.0f)}};
    level.addBox({0, 0, 0}, {8, 4, 4}, true);
    level.addQuad({0.2f, 0, 0}, {0.2f, 4, 0}, {0.2f, 4, 4}, {0.2f, 0, 4}, 1);
    const float low = 2.0f - 0.5f * width, high = 2.0f + 0.5f * width;
    level.addBox({4.0f, 0, 0}, {4.05f, low, 4}, false);
    level.addBox({4.0f, high, 0}, {4.05f, 4, 4}, false);
    VoxelVolume volume = volumeOf(level, coarse(12));
    LiveCaches live = light();
    LiveFrame frame;
    frame.keep = 0.95f;
    run(live, volume, frame, 60);
    float sum = 0.0f;
    for (float y = 0.5f; y < 4.0f; y += 0.5f) sum += live.irradiance({7.9f, y, 2}, {-1, 0, 0}).x;
    return sum;
  };
  const float voxel = 8.0f / 47.0f, wide = behind(2.0f * voxel), narrow = behind(0.75f * voxel);
  EXPECT_EQ(behind(0.0f), 0.0f);
  EXPECT_GT(narrow, 0.2f * wide);
  EXPECT_LT(narrow, 0.6f * wide);
}

// Receivers see their caches past posts that are a fifth of a voxel wide: no whole voxels are hidden.
TEST(LiveCaches, postsHideNoMoreThanTheirSubVoxels) {
  VoxelLevel level;
  level.addBox({0, 0, 0}, {8, 4, 4}, true);
  std::vector<glm::vec3> posts;
  for (int i = 0; i < 15; ++i) {
    posts.emplace_back(0.51f + 0.5f * static_cast<float>(i), 0, i % 2 == 0 ? 1.27f : 2.61f);
    level.addBox(posts.back(), posts.back() + glm::vec3(0.035f, 4, 0.035f), false);
  }
  const VoxelVolume volume = volumeOf(level, coarse(12));
  const CellSet cells = findCells(volume);
  const auto isHidden = [&](const glm::vec3& from, const glm::vec3& to) {
    for (const glm::vec3& post : posts) {
      float enters = 0.0f, leaves = 1.0f;
      for (const int a : {0, 2}) {
        const float d = to[a] - from[a], low = (post[a] - from[a]) / d, high = (post[a] + 0.035f - from[a]) / d;
        enters = std::max(enters, std::min(low, high));
        leaves = std::min(leaves, std::max(low, high));
      }
      if (enters < leaves) return true;
    }
    return false;
  };
  int open = 0, seen = 0, hidden = 0, seenThrough = 0;
  for (float x = 0.31f; x < 7.8f; x += 0.047f) {
    for (float z = 0.33f; z < 3.7f; z += 0.053f) {
      const glm::vec3 world(x, 0, z), place = volume.grid().toGrid(world), up(0, 1, 0);
      const CellStencil all = stencilOf(cells, place, up, 0xFF);
      const SeenCaches sees = seenCaches(cells, place, up);
      for (std::size_t k = 0; k < 8; ++k) {
        const glm::vec3 cache = cells.positionOf(all.slot[k]);
        if (all.weight[k] == 0.0f || cache.y <= place.y) continue;
        const bool isSeen = (sees >> k & 1u) != 0;
        if (isHidden(world, volume.grid().toWorld(cache))) {
          ++hidden;
          seenThrough += isSeen ? 1 : 0;
        } else {
          ++open;
          seen += isSeen ? 1 : 0;
        }
      }
    }
  }
  std::printf("of %d open ways %d are seen, of %d hidden ones %d\n", open, seen, hidden, seenThrough);
  EXPECT_GT(open, 10000);
  EXPECT_GT(hidden, 300);
  EXPECT_GT(seen, 0.96f * static_cast<float>(open));
  EXPECT_LT(seenThrough, 0.1f * static_cast<float>(hidden));
}

// Weights are of where caches stand, not of the middles of their cells: light that is linear in space is read as it is.
TEST(LiveCaches, lightIsReadWhereCachesStand) {
  VoxelLevel level;
  level.addBox({0, 0, 0}, {8, 4, 4}, true);
  std::mt19937 random(7);
  std::uniform_real_distribution<float> share(0.0f, 1.0f);
  const auto inBox = [&] { return glm::vec3(7.0f * share(random), 3.0f * share(random), 3.0f * share(random)); };
  for (int i = 0; i < 40; ++i) {
    const glm::vec3 low = inBox();
    level.addBox(low, low + 0.7f * glm::vec3(share(random), share(random), share(random)), false);
  }
  const VoxelVolume volume = volumeOf(level, coarse(12));
  const CellSet cells = findCells(volume);
  int between = 0, moved = 0;
  float farthest = 0.0f, sum = 0.0f;
  for (int i = 0; i < 20000; ++i) {
    const glm::vec3 place = volume.grid().toGrid(inBox()), up(0, 1, 0);
    const CellStencil stencil = stencilOf(cells, place, up, 0xFF);
    glm::vec3 read(0.0f), ofCells(0.0f);
    float least = 1.0f;
    for (std::size_t k = 0; k < 8; ++k) {
      const glm::vec3 cache = cells.positionOf(stencil.slot[k]);
      read += stencil.weight[k] * cache;
      ofCells += stencil.weight[k] * (4.0f * glm::floor(0.25f * cache) + 1.5f);
      least = std::min(least, stencil.weight[k]);
    }
    if (least < 1e-3f) continue;  // it is not between eight
    ++between;
    moved += glm::distance(read, ofCells) > 0.1f ? 1 : 0;
    sum += glm::distance(read, place + up);
    farthest = std::max(farthest, glm::distance(read, place + up));
  }
  const float mean = sum / static_cast<float>(between);
  std::printf("%d places between eight, %d of them among some that stand aside: %.4f voxels off, %.3f at most\n",
              between, moved, mean, farthest);
  EXPECT_GT(moved, 1000);
  EXPECT_LT(mean, 0.02f);
  EXPECT_LT(farthest, 0.6f);
}

TEST(LiveCaches, sameBytesOnTwoThreads) {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.5f)}, {glm::vec3(0.5f), glm::vec3(5.0f)}};
  level.addBox({0, 0, 0}, {4, 3, 4}, true);
  level.addBox({1, 0, 1}, {2, 1.5f, 2}, false, 1);
  VoxelOptions options = coarse(16);
  VoxelVolume one = volumeOf(level, options);
  options.parallelFor = test::onTwoThreads;
  VoxelVolume two = volumeOf(level, options);
  LiveCaches a = light(), b = light();
  LiveFrame frame;
  frame.keep = 0.25f;
  run(a, one, frame, 5);
  run(b, two, frame, 5);
  ASSERT_EQ(a.coefficients().size(), b.coefficients().size());
  EXPECT_EQ(std::memcmp(a.coefficients().data(), b.coefficients().data(), a.coefficients().size_bytes()), 0);
}

TEST(LiveCaches, whatIsRefusedChangesNothing) {
  EXPECT_FALSE(LiveCaches::create({7}));
  EXPECT_FALSE(LiveCaches::create({5000}));
  VoxelLevel level;
  level.surfaces[0].emission = glm::vec3(1.0f);
  level.addBox({0, 0, 0}, {4, 3, 4}, true);
  VoxelVolume volume = volumeOf(level, coarse(8));
  LiveCaches live = light();
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
