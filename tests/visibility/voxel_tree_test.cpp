// SPDX-License-Identifier: MIT
#include "bake/visibility/voxel_tree.h"

#include "bake/base/random.h"
#include "bake/visibility/surface_parts.h"

#include <gtest/gtest.h>

#include <set>

namespace relume {
namespace {

// Voxels at random places, far apart and near each other.
std::vector<VoxelHits> someVoxels(const VoxelGrid& grid, std::vector<glm::vec3>& positions) {
  std::vector<VoxelHits> voxels;
  for (std::uint32_t i = 0; i < 200; ++i) {
    RandomStream random(7, 1, i);
    const float scale = std::pow(10.0f, 5.0f * random.uniform());
    const glm::vec3 p = scale * (2.0f * glm::vec3(random.uniform(), random.uniform(), random.uniform()) - 1.0f);
    positions.push_back(p);
    voxels.push_back(grid.voxel(i % 3, p, {0, i % 2 ? 1.0f : -1.0f, 0}));
  }
  return voxels;
}

TEST(VoxelTree, neverDeniesABoxThatHoldsAVoxel) {
  const VoxelGrid grid{{-3.1f, 0.7f, 12.0f}, 0.37f};
  std::vector<glm::vec3> positions;
  const VoxelTree tree(grid, someVoxels(grid, positions), 0);
  for (std::uint32_t i = 0; i < positions.size(); ++i) {
    for (std::uint32_t k = 0; k < 50; ++k) {
      RandomStream random(8, i, k);
      const float size = std::pow(10.0f, 8.0f * random.uniform() - 3.0f);
      const glm::vec3 low = positions[i] - size * glm::vec3(random.uniform(), random.uniform(), random.uniform());
      const glm::vec3 high = glm::max(low + size, positions[i]);
      EXPECT_TRUE(tree.meets(i % 3, {0, 1, 0}, low, high));
      EXPECT_FALSE(tree.meets(i % 3 + 3, {0, 1, 0}, low, high)) << "another instance's";
      EXPECT_FALSE(tree.meets(i % 3, {1, 0, 0}, low, high)) << "of another direction";
    }
  }
}

TEST(VoxelTree, deniesBoxesFarFromEveryVoxel) {
  const VoxelGrid grid{{0, 0, 0}, 0.5f};
  const std::vector<VoxelHits> voxels{grid.voxel(0, {0.2f, 0, 0.2f}, {0, 1, 0})};
  const VoxelTree tree(grid, voxels, 0), near(grid, voxels, 1);
  EXPECT_FALSE(tree.meets(0, {0, 1, 0}, {5000, 0, 5000}, {5010, 0, 5010}));
  EXPECT_FALSE(tree.meets(0, {0, 1, 0}, {2.1f, 0, 0}, {2.4f, 0, 0.1f}));
  EXPECT_TRUE(near.meets(0, {0, 1, 0}, {0.6f, 0, 0}, {0.7f, 0, 0.1f})) << "within reach";
}

// What a large triangle's parts find in the voxels is what going through all of them finds.
TEST(VoxelTree, findsTheSamePartsAsLookingAtAll) {
  const std::array<glm::vec3, 3> corners{glm::vec3{-40, 0, -30}, {-30, 3, 60}, {50, -2, 10}};
  const glm::vec3 normal = crossOf(corners);
  const float area = 0.5f * glm::length(normal);
  const VoxelGrid grid{{-41, -3, -31}, 0.4f};
  std::vector<VoxelHits> voxels;
  for (std::uint32_t i = 0; i < 60; ++i) {
    RandomStream random(3, 1, i);
    glm::vec2 b(0.2f * random.uniform() * random.uniform(), 0.4f + 0.1f * random.uniform());
    if (i % 10 == 0) b = {random.uniform() * 0.5f, random.uniform() * 0.5f};
    voxels.push_back(grid.voxel(0, pointOf(corners, b), normal));
  }
  const VoxelTree tree(grid, voxels, 0);
  std::set<std::uint64_t> keys;
  for (const VoxelHits& c : voxels) keys.insert(c.key);
  std::size_t visited = 0, all = 0;
  const auto found = [&](const VoxelTree& by, std::size_t& visits) {
    std::multiset<std::uint64_t> hits;
    const double parts = forEachPart(corners, area, grid.size, by, 0, [&](const glm::vec3& p) {
      ++visits;
      const std::uint64_t key = grid.key(0, p, normal);
      if (keys.count(key)) hits.insert(key);
    });
    EXPECT_GT(parts, 9e4);
    return hits;
  };
  EXPECT_EQ(found(tree, visited), found(VoxelTree(), all));
  EXPECT_LT(5 * visited, all);
}

}  // namespace
}  // namespace relume
