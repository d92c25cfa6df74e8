// SPDX-License-Identifier: MIT
// Clustering cell by cell against the exact one: the same tree of few surfels, nearly as good a one of many, and one
// that stays where nothing was edited.
#include "tests/hierarchy/make_surfels.h"
#include "tests/hierarchy/trees.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <limits>
#include <vector>

namespace relume {
namespace {

constexpr std::uint32_t kMany = 30000;  // more than one thread takes

ClusterTree treeOf(const Surfels& surfels, int threads = 2) {
  Context context;
  context.threads = threads;
  const Result<ClusterTree> tree = agglomerateByCells(surfels, allOf(surfels), {}, context);
  EXPECT_TRUE(tree);
  return tree ? *tree : ClusterTree{};
}

std::uint32_t depthOf(const ClusterTree& tree) {
  std::vector<std::uint32_t> depth(2 * tree.leafCount - 1, 0);
  for (std::uint32_t k = 0; k + 1 < tree.leafCount; ++k) {
    depth[tree.leafCount + k] = 1 + std::max(depth[tree.first[k]], depth[tree.second[k]]);
  }
  return depth.back();
}

// For each merge, a number that tells which leaves it has.
std::vector<std::uint64_t> leavesOf(const ClusterTree& tree) {
  std::vector<std::uint64_t> leaves(2 * tree.leafCount - 1);
  for (std::uint32_t i = 0; i < tree.leafCount; ++i) leaves[i] = mix64(i + 1);
  for (std::uint32_t k = 0; k + 1 < tree.leafCount; ++k) {
    leaves[tree.leafCount + k] = leaves[tree.first[k]] + leaves[tree.second[k]];
  }
  leaves.erase(leaves.begin(), leaves.begin() + tree.leafCount);
  std::sort(leaves.begin(), leaves.end());
  return leaves;
}

// Of the merges of both, those of the same leaves.
double sharedMerges(const ClusterTree& a, const ClusterTree& b) {
  const std::vector<std::uint64_t> of = leavesOf(a), other = leavesOf(b);
  std::vector<std::uint64_t> both;
  std::set_intersection(of.begin(), of.end(), other.begin(), other.end(), std::back_inserter(both));
  return static_cast<double>(both.size()) / static_cast<double>(of.size());
}

TEST(AgglomerateByCells, isExactForFewSurfels) {
  Context context;
  for (const std::uint32_t count : {2u, 3u, 5u, 17u, 64u}) {
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
      const Surfels surfels = makeSurfels(count, seed);
      const Result<ClusterTree> exact = agglomerate(surfels, allOf(surfels), {}, context);
      ASSERT_TRUE(exact);
      EXPECT_EQ(sharedMerges(treeOf(surfels), *exact), 1.0) << count << " surfels, seed " << seed;
    }
  }
}

TEST(AgglomerateByCells, isATreeOfAllMembers) {
  for (const std::uint32_t count : {2u, 33u, 100u, 4096u, 4097u, kMany}) {
    const Surfels surfels = makeSurfels(count, 6);
    expectTree(treeOf(surfels), count);
  }
  const Surfels surfels = makeSurfels(100, 4);
  const std::vector<std::uint32_t> members{90, 3, 17, 44}, one{2};
  Context context;
  const Result<ClusterTree> some = agglomerateByCells(surfels, members, {}, context);
  ASSERT_TRUE(some);
  expectTree(*some, 4);
  const Result<ClusterTree> alone = agglomerateByCells(surfels, one, {}, context);
  ASSERT_TRUE(alone);
  EXPECT_EQ(alone->leafCount, 1u);
  EXPECT_TRUE(alone->first.empty());
}

TEST(AgglomerateByCells, costsLittleMoreThanTheExactTree) {
  Context context;  // figures at hand: 0.999 to 1.024 of it
  for (const std::uint32_t count : {1000u, 8192u}) {
    const Surfels surfels = makeSurfels(count, 11);
    const Result<ClusterTree> exact = agglomerate(surfels, allOf(surfels), {}, context);
    ASSERT_TRUE(exact);
    const double cost = treeCost(surfels, treeOf(surfels), {}), least = treeCost(surfels, *exact, {});
    EXPECT_LT(cost, 1.05 * least) << count << ' ' << cost / least;
  }
}

TEST(AgglomerateByCells, threadCountDoesNotChangeTheTree) {
  const Surfels surfels = makeSurfels(kMany, 7);
  const ClusterTree one = treeOf(surfels, 1);
  for (const int threads : {2, 7}) {
    const ClusterTree tree = treeOf(surfels, threads);
    EXPECT_TRUE(tree.first == one.first && tree.second == one.second) << threads << " threads";
  }
}

// A box of a hall that goes elsewhere takes its clusters along, and leaves most others.
TEST(AgglomerateByCells, anEditLeavesMostClusters) {
  Surfels surfels = makeSurfels(kMany, 5);
  const ClusterTree before = treeOf(surfels);
  std::vector<glm::vec3> position = surfels.positionWorld.toVector();
  const glm::vec3 centre = position[0];
  std::size_t moved = 0;
  for (glm::vec3& p : position) {
    if (glm::length(p - centre) > 1.5f) continue;
    p += glm::vec3(0.05f, 0.02f, 0.03f);
    ++moved;
  }
  ASSERT_GT(moved, 10u);
  ASSERT_LT(moved, kMany / 30);
  surfels.positionWorld = position;
  EXPECT_GT(sharedMerges(before, treeOf(surfels)), 0.9);
}

TEST(AgglomerateByCells, coincidentSurfelsPairOff) {
  const std::uint32_t count = 20000;
  Surfels surfels;
  surfels.positionWorld = std::vector<glm::vec3>(count, glm::vec3(3, 4, 5));
  surfels.normal = std::vector<glm::vec3>(count, glm::vec3(0, 1, 0));
  const ClusterTree tree = treeOf(surfels);
  expectTree(tree, count);
  EXPECT_LE(depthOf(tree), 24u);
}

TEST(AgglomerateByCells, refusesBadInput) {
  const Surfels surfels = makeSurfels(5, 4);
  Context context;
  EXPECT_EQ(agglomerateByCells(surfels, {}, {}, context).error().code, ErrorCode::failed);
  const std::vector<std::uint32_t> beyond{0, 5};
  EXPECT_EQ(agglomerateByCells(surfels, beyond, {}, context).error().code, ErrorCode::failed);
  ClusteringOptions options;
  options.outlookWeight = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(agglomerateByCells(surfels, allOf(surfels), options, context).error().code, ErrorCode::usage);
}

TEST(AgglomerateByCells, stopsWhenCancelled) {
  const Surfels surfels = makeSurfels(kMany, 4);
  Context context;
  context.onProgress = [](std::string_view, double) { return false; };
  const Result<ClusterTree> tree = agglomerateByCells(surfels, allOf(surfels), {}, context);
  ASSERT_FALSE(tree);
  EXPECT_EQ(tree.error().message, "cancelled");
}

}  // namespace
}  // namespace relume
