// SPDX-License-Identifier: MIT
// Volumes in one another that follow the eye: wherever they have been, they are what would be created there.
#include "runtime/voxels/nested_volumes.h"

#include "formats/decimal.h"
#include "formats/limits.h"
#include "tests/voxels/boxes.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <functional>
#include <limits>
#include <random>
#include <vector>

namespace relume {
namespace {

using namespace test;

// A long hall with columns, a ramp, and triangles at any angle.
VoxelLevel hall() {
  VoxelLevel level;
  level.surfaces = {{glm::vec3(0.5f)}, {glm::vec3(0.2f, 0.6f, 0.4f), glm::vec3(3.0f, 1.0f, 0.0f)}};
  level.addBox({0, 0, 0}, {37, 7, 11}, true);
  for (int i = 0; i < 6; ++i) {
    const float x = 2.3f + 6.1f * static_cast<float>(i);
    level.addBox({x, 0, 3.1f}, {x + 0.7f, 6.2f, 3.8f}, false, static_cast<std::uint32_t>(i % 2));
  }
  level.addQuad({1, 0, 5}, {1, 0, 9}, {30, 4, 9}, {30, 4, 5});
  std::mt19937 random(7);
  std::uniform_real_distribution<float> at(0.0f, 1.0f);
  VoxelLevel::Mesh splinters;
  for (std::uint32_t t = 0; t < 300; ++t) {
    const glm::vec3 p(37.0f * at(random), 7.0f * at(random), 11.0f * at(random));
    for (int k = 0; k < 3; ++k) splinters.position.push_back(p + 0.8f * unit(random));
    splinters.triangle.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    splinters.surface.push_back(t % 2);
  }
  level.parts.push_back({static_cast<std::uint32_t>(level.meshes.size()), glm::mat4x3(1.0f), false});
  level.meshes.push_back(std::move(splinters));
  level.addBox({-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}, false, 1);
  level.parts.back().moves = true;
  level.parts.back().toWorld[3] = {5, 1, 5};
  return level;
}

NestedOptions nested(std::uint32_t cascades, std::uint32_t cells = 8) {
  NestedOptions options;
  options.outermost.cells = cells;
  options.cascades = cascades;
  return options;
}

NestedVolumes made(VoxelLevel& level, const NestedOptions& options) {
  auto volumes = NestedVolumes::create(level.geometry(), options);
  EXPECT_TRUE(volumes) << volumes.error().message;
  return std::move(*volumes);
}

void expectSame(const NestedVolumes& a, const NestedVolumes& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t level = 0; level < a.size(); ++level) {
    ASSERT_EQ(a[level].grid().shift, b[level].grid().shift) << level;
    EXPECT_EQ(a[level].grid().originWorld, b[level].grid().originWorld);
    EXPECT_TRUE(std::equal(a[level].bits().begin(), a[level].bits().end(), b[level].bits().begin())) << level;
    ASSERT_EQ(a[level].sideCount(), b[level].sideCount());
    std::uint32_t others = 0;
    for (std::uint32_t s = 0; s < a[level].sideCount(); ++s) {
      const bool isSame = a[level].side(s) == b[level].side(s) && a[level].voxelOfSide(s) == b[level].voxelOfSide(s) &&
                          a[level].emissionOfSide(s) == b[level].emissionOfSide(s);
      others += isSame ? 0 : 1;
    }
    EXPECT_EQ(others, 0u) << level;
    EXPECT_EQ(a[level].standing().emitters, b[level].standing().emitters);
    EXPECT_EQ(a[level].stats().occupied, b[level].stats().occupied);
  }
}

TEST(NestedVolumes, eachIsHalfAsWideAsTheOneAroundIt) {
  VoxelLevel level = hall();
  NestedOptions options = nested(4);
  options.eyeWorld = {20, 2, 5};
  const NestedVolumes volumes = made(level, options);
  ASSERT_EQ(volumes.size(), 4u);
  for (std::size_t i = 1; i < 4; ++i) {
    const VolumeGrid &outer = volumes[i - 1].grid(), &inner = volumes[i].grid();
    EXPECT_EQ(inner.voxel, 0.5f * outer.voxel);
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(inner.cells[k], std::min(2 * outer.cells[k], 8));
      // Within it, and its faces on faces of voxels there.
      EXPECT_GE(inner.shift[k], 2 * outer.shift[k]);
      EXPECT_LE(inner.shift[k] + inner.cells[k], 2 * (outer.shift[k] + outer.cells[k]));
    }
    const glm::vec3 eye = inner.toGrid({20, 2, 5}) / 4.0f;
    EXPECT_NEAR(eye.x, 4.0f, 0.51f);
    EXPECT_GT(volumes[i].stats().occupied, 100u);
  }
  // The outermost is the volume that there is without others.
  const NestedVolumes one = made(level, nested(1));
  EXPECT_TRUE(std::equal(one[0].bits().begin(), one[0].bits().end(), volumes[0].bits().begin()));
}

// Edits and moves of one frame: all of them or none.
TEST(NestedVolumes, placeWhatMovesAndWhatIsEditedAtOnce) {
  VoxelLevel level = hall();
  NestedVolumes once = made(level, nested(2)), apart = made(level, nested(2));
  glm::mat4x3 aside(1.0f), away(1.0f);
  aside[3] = {1.5f, 0, 0.5f};
  away[3] = {12, 2, 7};
  const std::vector<PartEdit> edits{{2, aside, true}, {3, aside, false}};
  const std::vector<glm::mat4x3> one{away}, two{away, away};
  const Status refused = once.place({edits, two});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::usage);
  expectSame(once, apart);
  EXPECT_FALSE(once.place({std::vector<PartEdit>{{2, aside, true}, {99, aside, true}}, one}));
  expectSame(once, apart);
  ASSERT_TRUE(once.place({edits, one}));
  ASSERT_TRUE(apart.edit(edits) && apart.move(one));
  expectSame(once, apart);
}

TEST(NestedVolumes, afterManyMovesAreThoseCreatedThere) {
  VoxelLevel level = hall();
  NestedVolumes walked = made(level, nested(3));
  std::mt19937 random(3);
  std::uniform_real_distribution<float> at(-1.0f, 1.0f);
  glm::vec3 eye(18, 3, 5);
  int moves = 0;
  for (int step = 0; step < 60; ++step) {
    // Mostly a walk, now and then somewhere else.
    eye = step % 20 == 19 ? glm::vec3(18.0f + 18.0f * at(random), 3.0f, 5.0f)
                          : eye + glm::vec3(2.0f * at(random), 0.8f * at(random), 1.2f * at(random));
    const Result<bool> moved = walked.centre(eye);
    ASSERT_TRUE(moved);
    moves += *moved ? 1 : 0;
    if (step == 30) {
      glm::mat4x3 to(1.0f);
      to[3] = {19, 2, 6};
      ASSERT_TRUE(walked.move({&to, 1}));
      level.parts.back().toWorld = to;
      const PartEdit edit{2, glm::mat4x3({1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1.7f, 0, 0.9f}), true};
      ASSERT_TRUE(walked.edit({&edit, 1}));
      level.parts[2].toWorld = edit.toWorld;
    }
  }
  EXPECT_GT(moves, 25);
  // To the middle of cells, so that where they were before makes no difference.
  const VolumeGrid& grid = walked[2].grid();
  eye = grid.toWorld(2.0f * glm::vec3(grid.cells)) + glm::vec3(4.0f * grid.voxel, 0, 0);
  ASSERT_TRUE(walked.centre(eye));
  NestedOptions options = nested(3);
  options.eyeWorld = eye;
  expectSame(walked, made(level, options));
}

TEST(NestedVolumes, aBoxThatFollowsTheEyeIsThatCreatedThere) {
  VoxelLevel level = hall();
  NestedOptions options = nested(2);
  options.outermost.boxMin = {0, 0, 0};
  options.outermost.boxMax = {8, 6, 8};
  options.boxFollowsEye = true;
  NestedVolumes walked = made(level, options);
  for (float x = 4.0f; x < 33.0f; x += 1.3f) ASSERT_TRUE(walked.centre({x, 3, 5.5f}));
  options.eyeWorld = {32.6f, 3, 5.5f};
  expectSame(walked, made(level, options));
  EXPECT_GT(walked[0].grid().shift.x, 20);
  EXPECT_GT(walked[0].stats().occupied, 500u);
}

// Where volumes are read from follows the eye without a step, within each volume but for faces that are the
// outermost's.
TEST(NestedVolumes, theirReachFollowsTheEyeWithoutAStep) {
  constexpr float kStep = 0.02f;  // [m]
  for (const bool boxFollowsEye : {false, true}) {
    VoxelLevel level = hall();
    NestedOptions options = nested(3);
    options.boxFollowsEye = boxFollowsEye;
    if (boxFollowsEye) options.outermost.boxMax = glm::vec3(16.0f);
    options.eyeWorld = glm::vec3(-3, 3, 5);
    NestedVolumes volumes = made(level, options);
    int moves = 0, shrunk = 0;
    std::vector<VolumeReach> before(3);
    for (float x = -3.0f; x < 40.0f; x += kStep) {
      const Result<bool> moved = volumes.centre({x, 3, 5});
      ASSERT_TRUE(moved);
      moves += *moved ? 1 : 0;
      for (std::size_t l = 0; l < 3; ++l) {
        const VolumeGrid &grid = volumes[l].grid(), &box = volumes.outermost().grid();
        const VolumeReach& reach = volumes[l].reach();
        const VolumeReach world{grid.toWorld(reach.low), grid.toWorld(reach.high)};
        if (x > -3.0f && std::abs(reach.low.x) < 1e6f) {
          EXPECT_LE(std::abs(world.low.x - before[l].low.x), 1.6f * kStep) << l << ' ' << x;
          EXPECT_LE(std::abs(world.high.x - before[l].high.x), 1.6f * kStep) << l << ' ' << x;
        }
        before[l] = world;
        const bool endsAtLow = grid.shift.x == box.shift.x << l && !boxFollowsEye,
                   endsAtHigh = grid.shift.x + grid.cells.x == (box.shift.x + box.cells.x) << l && !boxFollowsEye;
        EXPECT_TRUE(endsAtLow || reach.low.x > -1e-3f) << l << ' ' << x;
        EXPECT_TRUE(endsAtHigh || reach.high.x < static_cast<float>(grid.voxels().x) + 1e-3f) << l << ' ' << x;
        EXPECT_GT(reach.high.x - reach.low.x, 0.6f * static_cast<float>(grid.voxels().x)) << l << ' ' << x;
        shrunk += reach.low.x > 0.0f && reach.high.x < static_cast<float>(grid.voxels().x) ? 1 : 0;
      }
    }
    EXPECT_GT(moves, 25);
    EXPECT_GT(shrunk, 1000);
  }
  VoxelLevel level = hall();
  // An eye that volumes have not followed yet: nothing is read outside them.
  NestedOptions options = nested(2);
  options.eyeWorld = glm::vec3(18, 3, 5);
  const NestedVolumes there = made(level, options);
  std::vector<VoxelVolume> late(there.all().begin(), there.all().end());
  for (const float x : {15.0f, 21.0f, 37.0f}) {
    setReach(late, {x, 3, 5}, false);
    EXPECT_GE(late[1].reach().low.x, 0.0f) << x;
    EXPECT_LE(late[1].reach().high.x, static_cast<float>(late[1].grid().voxels().x)) << x;
  }
  const NestedVolumes one = made(level, nested(1));
  EXPECT_EQ(one.outermost().reach().share({-100.0f, 2.0f, 2.0f}, 0.0f), 1.0f) << "nothing takes over";
}

TEST(NestedVolumes, whatIsRefusedChangesNothing) {
  VoxelLevel level = hall();
  NestedVolumes volumes = made(level, nested(2));
  const NestedVolumes before = volumes;
  const float nan = std::numeric_limits<float>::quiet_NaN(), far = std::numeric_limits<float>::infinity();
  for (const glm::vec3& eye : {glm::vec3(nan, 0, 0), glm::vec3(0, far, 0), glm::vec3(0, 0, 2e9f)}) {
    const Result<bool> moved = volumes.centre(eye);
    ASSERT_FALSE(moved);
    EXPECT_EQ(moved.error().code, ErrorCode::usage);
    EXPECT_NE(moved.error().message.find("the eye has a coordinate beyond " + decimal(kMaxCoordinate) + " m"),
              std::string::npos);
  }
  EXPECT_FALSE(volumes.move({}));
  const PartEdit edit{99};
  EXPECT_FALSE(volumes.edit({&edit, 1}));
  expectSame(volumes, before);
  for (const std::uint32_t cascades : {0u, 5u}) {
    const auto refused = NestedVolumes::create(level.geometry(), nested(cascades));
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("cascades"), std::string::npos);
  }
  // A far eye is a good one: volumes go as far as the outermost does.
  ASSERT_TRUE(volumes.centre({1e6f, -1e6f, 0}));
  const VolumeGrid &outer = volumes[0].grid(), &inner = volumes[1].grid();
  EXPECT_EQ(inner.shift.x + inner.cells.x, 2 * outer.cells.x);
  EXPECT_EQ(inner.shift.y, 0);
}

TEST(NestedVolumes, sameBytesAtAnyNumberOfThreads) {
  VoxelLevel level = hall();
  NestedOptions options = nested(3);
  const auto walk = [](NestedVolumes& volumes) {
    for (float x = 3.0f; x < 30.0f; x += 2.1f) ASSERT_TRUE(volumes.centre({x, 3, 4}));
  };
  NestedVolumes one = made(level, options);
  walk(one);
  for (const unsigned threads : {2u, 7u}) {
    options.outermost.parallelFor = [threads](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
      onThreads(threads, tasks, body);
    };
    NestedVolumes many = made(level, options);
    walk(many);
    expectSame(one, many);
  }
}

}  // namespace
}  // namespace relume
