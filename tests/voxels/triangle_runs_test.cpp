// SPDX-License-Identifier: MIT
// Runs of triangles that are passed over: none has a triangle that reaches into the box.
#include "runtime/voxels/triangle_runs.h"

#include <gtest/gtest.h>
#include <glm/mat3x3.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace relume {
namespace {

struct SmallTriangles {
  std::vector<glm::vec3> position;
  std::vector<glm::uvec3> triangle;
  std::vector<std::uint32_t> surface;
  std::array<VoxelSurface, 2> surfaces{};

  // In a box of that size; each run is some 0.1 of it wide. Half of them are leaves, of which a part is there.
  SmallTriangles(std::uint32_t count, float size, std::mt19937& random) {
    std::uniform_real_distribution<float> uniform(-0.5f, 0.5f);
    const auto somewhere = [&] { return glm::vec3(uniform(random), uniform(random), uniform(random)); };
    surfaces[1].coverage = 0.4f;
    glm::vec3 middle(0.0f);
    for (std::uint32_t t = 0; t < count; ++t) {
      if (t % kTrianglesOfRun == 0) middle = somewhere();
      const std::uint32_t first = 3 * t;
      for (int k = 0; k < 3; ++k) position.push_back(size * (middle + 0.1f * somewhere()));
      triangle.push_back({first, first + 1, first + 2});
      surface.push_back(t % 2);
    }
  }
  VoxelMesh mesh() const { return {position, triangle, surface}; }
};

glm::mat4x3 someTransform(float scale, float distance, std::mt19937& random) {
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  glm::mat4x3 toWorld;
  for (int c = 0; c < 4; ++c) {
    for (int k = 0; k < 3; ++k) toWorld[c][k] = (c < 3 ? scale : distance) * uniform(random);
  }
  return toWorld;
}

TEST(TriangleRuns, thatArePassedOverHaveNothingInTheBox) {
  std::mt19937 random(5);
  std::uniform_int_distribution<int> step(0, 16 * kBrickSide * kVoxelSteps);
  VolumeGrid grid;
  grid.voxel = 0.1f;
  grid.cells = glm::ivec3(16);
  std::uint32_t passedOver = 0, looked = 0;
  for (int trial = 0; trial < 60; ++trial) {
    // The last run has fewer triangles than the others.
    const SmallTriangles made(10 * kTrianglesOfRun + 17, 5.0f, random);
    const std::vector<TriangleRun> runs = findRuns(made.mesh(), made.surfaces);
    ASSERT_EQ(runs.size(), 11u);
    const VolumeGrid moved = shifted(grid, {trial % 5 - 2, trial % 3 - 1, trial % 7 - 3});
    SnapBox box;
    for (int k = 0; k < 3; ++k) {
      const int a = step(random), b = step(random);
      box.low[k] = std::min(a, b);
      box.high[k] = std::max(a, b);
    }
    const glm::mat4x3 toWorld = someTransform(1.0f, 4.0f, random);
    const RunsOutside isOutside(moved, box, toWorld);
    for (std::uint32_t r = 0; r < runs.size(); ++r) {
      ++looked;
      if (!isOutside(runs[r])) continue;
      ++passedOver;
      const std::uint32_t begin = r * kTrianglesOfRun,
                          end = std::min<std::uint32_t>(begin + kTrianglesOfRun,
                                                        static_cast<std::uint32_t>(made.triangle.size()));
      std::vector<SnappedTriangle> snapped;
      SnapCounts counts;
      ASSERT_TRUE(snapTriangles(moved, box, made.mesh(), made.surfaces, toWorld, begin, end, snapped, counts));
      EXPECT_TRUE(snapped.empty());
      EXPECT_EQ(counts.outside, runs[r].there);
    }
  }
  // Boxes are a third of the grid along each axis, and the levels larger than it.
  EXPECT_GT(passedOver, looked / 2);
  EXPECT_LT(passedOver, looked);
}

// Snapping holds back what is too far off, and where sums of such places lie is not told by their bounds.
TEST(TriangleRuns, tooFarOffAreLookedAt) {
  std::mt19937 random(6);
  const SmallTriangles made(kTrianglesOfRun, 5.0f, random);
  const std::vector<TriangleRun> runs = findRuns(made.mesh(), made.surfaces);
  VolumeGrid grid;
  grid.cells = glm::ivec3(8);
  for (const float scale : {1e9f, 1e20f, 1e38f}) {
    glm::mat4x3 toWorld(1.0f);
    toWorld[0] *= scale;
    EXPECT_FALSE(RunsOutside(grid, SnapBox::of(grid), toWorld)(runs[0])) << scale;
  }
  glm::mat4x3 beside(1.0f);
  beside[3] = glm::vec3(1000.0f, 0.0f, 0.0f);
  EXPECT_TRUE(RunsOutside(grid, SnapBox::of(grid), beside)(runs[0]));
}

}  // namespace
}  // namespace relume
