// SPDX-License-Identifier: MIT
#include "bake/visibility/voxel_tree.h"

#include "bake/base/random.h"
#include "bake/visibility/surface_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
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
  Context context;
  std::size_t visited = 0, all = 0;
  const auto found = [&](const VoxelTree& by, std::size_t& visits) {
    std::multiset<std::uint64_t> hits;
    const double parts = forEachPart(corners, area, grid.size, by, 0, context, [&](const glm::vec3& p, double weight) {
      EXPECT_EQ(weight, 1.0);
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

// The voxels that points of a triangle, drawn evenly, lie in.
std::vector<VoxelHits> voxelsOf(const std::array<glm::vec3, 3>& corners, const VoxelGrid& grid, std::uint32_t points) {
  std::vector<VoxelHits> voxels;
  for (std::uint32_t i = 0; i < points; ++i) {
    RandomStream random(5, 1, i);
    const float edge = std::sqrt(random.uniform()), b = edge * random.uniform();
    voxels.push_back(grid.voxel(0, pointOf(corners, {edge - b, b}), crossOf(corners)));
  }
  const auto byKey = [](const VoxelHits& a, const VoxelHits& b) { return a.key < b.key; };
  std::sort(voxels.begin(), voxels.end(), byKey);
  const auto same = [](const VoxelHits& a, const VoxelHits& b) { return a.key == b.key; };
  voxels.erase(std::unique(voxels.begin(), voxels.end(), same), voxels.end());
  return voxels;
}

// A needle with its tip at an end, and one with the middle corner in the middle.
const std::array<glm::vec3, 3> kNeedles[] = {{glm::vec3{3, 1, 2}, {63, 31, 22}, {63, 31.6f, 21}},
                                             {glm::vec3{3, 1, 2}, {63, 31, 22}, {33, 16.6f, 11.5f}}};

// Each voxel gets that share of the needle which lies in it, and all shares make one.
TEST(VoxelTree, partsOfANeedleWeighAsMuchAsTheirArea) {
  for (const auto& corners : kNeedles) {
    const float area = 0.5f * glm::length(crossOf(corners));
    ASSERT_TRUE(isNeedle(corners, area));
    const VoxelGrid grid{{-1, -1, -1}, 0.1f};
    const std::vector<VoxelHits> voxels = voxelsOf(corners, grid, 200000);
    const VoxelIndex index(voxels);
    const VoxelTree tree(grid, voxels, 1);
    Context context;
    std::vector<double> found(voxels.size()), truth(voxels.size());
    double sum = 0.0;
    const double all = forEachPart(corners, area, grid.size, tree, 0, context, [&](const glm::vec3& p, double weight) {
      sum += weight;
      if (const std::size_t at = index.find(grid.key(0, p, crossOf(corners))); at < found.size()) found[at] += weight;
    });
    EXPECT_EQ(all, 1.0);
    EXPECT_NEAR(sum, 1.0, 1e-5) << "no point fell on the very tips";
    constexpr std::uint32_t kDraws = 1000000;
    for (std::uint32_t i = 0; i < kDraws; ++i) {
      RandomStream random(6, 1, i);
      const float edge = std::sqrt(random.uniform()), b = edge * random.uniform();
      const std::uint64_t key = grid.key(0, pointOf(corners, {edge - b, b}), crossOf(corners));
      if (const std::size_t at = index.find(key); at < truth.size()) truth[at] += 1.0 / kDraws;
    }
    double error = 0.0;
    for (std::size_t i = 0; i < truth.size(); ++i) error += std::abs(found[i] - truth[i]);
    EXPECT_LT(error, 0.25) << "of all the area is in the wrong voxel";
  }
}

// A needle of 100 km by a metre costs as much as it has voxels.
TEST(VoxelTree, aLongNeedleCostsWhatItsVoxelsCost) {
  const std::array<glm::vec3, 3> corners{glm::vec3{0, 1e5f, 1}, {1, 0, 0}, {1, 1e5f, 0}};
  const float area = 0.5f * glm::length(crossOf(corners));
  const VoxelGrid grid{{-0.016f, -0.016f, -0.016f}, 0.044f};
  const std::vector<VoxelHits> voxels = voxelsOf(corners, grid, 1000);
  const VoxelIndex index(voxels);
  const VoxelTree tree(grid, voxels, 0);
  Context context;
  std::size_t visits = 0;
  std::set<std::uint64_t> met;
  const auto visit = [&](const glm::vec3& p, double) {
    ++visits;
    const std::uint64_t key = grid.key(0, p, crossOf(corners));
    if (index.contains(key)) met.insert(key);
  };
  forEachPart(corners, area, grid.size, tree, 0, context, visit);
  EXPECT_LT(visits, 64 * voxels.size());
  EXPECT_GT(10 * met.size(), 9 * voxels.size()) << "points far out are a sixth of a voxel apart, so some are missed";
  context.cancel();
  visits = 0;
  forEachPart(corners, area, grid.size, tree, 0, context, visit);
  EXPECT_LT(visits, 4096u);
}

}  // namespace
}  // namespace relume
