// SPDX-License-Identifier: MIT
// Exact clustering against an O(n³) oracle.
#include "bake/hierarchy/cluster_search.h"
#include "bake/hierarchy/hierarchy.h"
#include "bake/hierarchy/metric.h"
#include "tests/hierarchy/make_surfels.h"
#include "tests/hierarchy/trees.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <set>
#include <string>

namespace relume {
namespace {

// Looks at all pairs before every merge.
ClusterTree agglomerateSlowly(const Surfels& surfels, const ClusteringOptions& options) {
  const ClusterMetric metric = metricFor(surfels, options);
  std::vector<ClusterSum> sums = leafSums(surfels, metric);
  std::set<std::uint32_t> living;
  for (std::uint32_t i = 0; i < surfels.count(); ++i) living.insert(i);
  ClusterTree tree;
  tree.leafCount = surfels.count();
  while (living.size() > 1) {
    float nearest = std::numeric_limits<float>::infinity();
    std::uint32_t first = 0, second = 0;
    for (auto a = living.begin(); a != living.end(); ++a) {
      for (auto b = std::next(a); b != living.end(); ++b) {
        const float d =
            clusterDistance(clusterPoint(sums[*a], metric), clusterPoint(sums[*b], metric), metric.balanceWeight);
        if (d < nearest) nearest = d, first = *a, second = *b;
      }
    }
    tree.first.push_back(first);
    tree.second.push_back(second);
    living.erase(first);
    living.erase(second);
    living.insert(static_cast<std::uint32_t>(sums.size()));
    sums.push_back(mergeClusters(sums[first], sums[second]));
  }
  return tree;
}

TEST(Metric, isThePapersDistanceForUnitNormals) {
  const Surfels surfels = makeSurfels(60, 3);
  for (const float normalWeight : {0.0f, 0.1f, 2.0f}) {
    ClusteringOptions options;
    options.normalWeight = normalWeight;
    const ClusterMetric metric = metricFor(surfels, options);
    std::vector<ClusterSum> sums = leafSums(surfels, metric);
    for (std::uint32_t i = 0; i < 40; ++i) sums.push_back(mergeClusters(sums[i], sums[2 * i]));
    for (const ClusterSum& a : sums) {
      for (const ClusterSum& b : sums) {
        const float d = clusterDistance(clusterPoint(a, metric), clusterPoint(b, metric), metric.balanceWeight);
        EXPECT_NEAR(d, printedDistance(a, b, options), 2e-6 * (1.0 + normalWeight));
        EXPECT_EQ(d, clusterDistance(clusterPoint(b, metric), clusterPoint(a, metric), metric.balanceWeight));
      }
    }
  }
}

TEST(Metric, mergedClusterIsTheMeanOfItsLeaves) {
  const Surfels surfels = makeSurfels(50, 9);
  std::vector<ClusterSum> sums = leafSums(surfels, metricFor(surfels, {}));
  ClusterSum all = sums[0];
  glm::dvec3 center(sums[0].center), normal(sums[0].normal);
  for (std::uint32_t i = 1; i < 50; ++i) {
    all = mergeClusters(all, sums[i]);
    center += sums[i].center;
    normal += sums[i].normal;
  }
  EXPECT_EQ(all.leaves, 50u);
  EXPECT_LT(glm::length(glm::dvec3(all.center) - center / 50.0), 1e-6);
  EXPECT_LT(glm::length(glm::dvec3(all.normal) - glm::normalize(normal)), 1e-5);
}

TEST(Agglomerate, makesTheOraclesMergesInTheOraclesOrder) {
  Context context;
  for (const std::uint32_t count : {2u, 3u, 5u, 17u, 33u, 120u, 300u}) {
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
      const Surfels surfels = makeSurfels(count, seed);
      const Result<ClusterTree> tree = agglomerate(surfels, allOf(surfels), {}, context);
      ASSERT_TRUE(tree);
      expectTree(*tree, count);
      const ClusterTree oracle = agglomerateSlowly(surfels, {});
      EXPECT_EQ(tree->first, oracle.first) << count << " surfels, seed " << seed;
      EXPECT_EQ(tree->second, oracle.second) << count << " surfels, seed " << seed;
    }
  }
}

TEST(Agglomerate, isExactForOtherWeights) {
  Context context;
  const Surfels surfels = makeSurfels(200, 5);
  for (const float normalWeight : {0.0f, 1.0f, 100.0f}) {
    for (const float balanceWeight : {0.0f, 0.5f}) {
      ClusteringOptions options;
      options.normalWeight = normalWeight;
      options.balanceWeight = balanceWeight;
      const Result<ClusterTree> tree = agglomerate(surfels, allOf(surfels), options, context);
      ASSERT_TRUE(tree);
      const ClusterTree oracle = agglomerateSlowly(surfels, options);
      EXPECT_EQ(tree->first, oracle.first) << normalWeight << " " << balanceWeight;
      EXPECT_EQ(tree->second, oracle.second) << normalWeight << " " << balanceWeight;
    }
  }
}

TEST(Agglomerate, mergesANearestPairAmongTies) {
  // A regular lattice, where nearly every distance has equals: which pair comes first is free, its distance is not.
  std::vector<glm::vec3> position, normal;
  for (int i = 0; i < 144; ++i) position.emplace_back(i % 12, 0, i / 12), normal.emplace_back(0, 1, 0);
  Surfels surfels;
  surfels.positionWorld = position;
  surfels.normal = normal;
  Context context;
  const Result<ClusterTree> tree = agglomerate(surfels, allOf(surfels), {}, context);
  ASSERT_TRUE(tree);
  expectTree(*tree, 144);

  const ClusterMetric metric = metricFor(surfels, {});
  std::vector<ClusterSum> sums = leafSums(surfels, metric);
  std::set<std::uint32_t> living;
  for (std::uint32_t i = 0; i < 144; ++i) living.insert(i);
  const auto distance = [&](std::uint32_t a, std::uint32_t b) {
    return clusterDistance(clusterPoint(sums[a], metric), clusterPoint(sums[b], metric), metric.balanceWeight);
  };
  for (std::uint32_t k = 0; k < 143; ++k) {
    float nearest = std::numeric_limits<float>::infinity();
    for (const std::uint32_t a : living) {
      for (const std::uint32_t b : living) nearest = a < b ? std::min(nearest, distance(a, b)) : nearest;
    }
    EXPECT_EQ(distance(tree->first[k], tree->second[k]), nearest) << k;
    living.erase(tree->first[k]);
    living.erase(tree->second[k]);
    living.insert(144 + k);
    sums.push_back(mergeClusters(sums[tree->first[k]], sums[tree->second[k]]));
  }
}

TEST(Agglomerate, coincidentSurfelsPairOff) {
  const std::uint32_t count = std::string(RELUME_SANITIZE).empty() ? 20000 : 4000;
  Surfels surfels;
  surfels.positionWorld = std::vector<glm::vec3>(count, glm::vec3(3, 4, 5));
  surfels.normal = std::vector<glm::vec3>(count, glm::vec3(0, 1, 0));
  Context context;
  const Result<ClusterTree> tree = agglomerate(surfels, allOf(surfels), {}, context);
  ASSERT_TRUE(tree);
  expectTree(*tree, count);
  std::vector<std::uint32_t> depth(2 * count - 1, 0);
  for (std::uint32_t k = 0; k + 1 < count; ++k) {
    depth[count + k] = 1 + std::max(depth[tree->first[k]], depth[tree->second[k]]);
  }
  EXPECT_LE(depth.back(), 20u);
}

TEST(Agglomerate, clustersOnlyTheMembers) {
  const Surfels surfels = makeSurfels(100, 4);
  const std::vector<std::uint32_t> members{90, 3, 17, 44};
  Context context;
  const Result<ClusterTree> tree = agglomerate(surfels, members, {}, context);
  ASSERT_TRUE(tree);
  expectTree(*tree, 4);
}

TEST(Agglomerate, oneMemberIsATreeWithoutMerges) {
  const Surfels surfels = makeSurfels(5, 4);
  const std::vector<std::uint32_t> members{2};
  Context context;
  const Result<ClusterTree> tree = agglomerate(surfels, members, {}, context);
  ASSERT_TRUE(tree);
  EXPECT_EQ(tree->leafCount, 1u);
  EXPECT_TRUE(tree->first.empty());
}

TEST(Agglomerate, refusesBadInput) {
  const Surfels surfels = makeSurfels(5, 4);
  Context context;
  EXPECT_EQ(agglomerate(surfels, {}, {}, context).error().code, ErrorCode::failed);
  const std::vector<std::uint32_t> beyond{0, 5};
  EXPECT_EQ(agglomerate(surfels, beyond, {}, context).error().code, ErrorCode::failed);
  for (const float weight : {-1.0f, std::numeric_limits<float>::quiet_NaN(), 1e30f}) {
    ClusteringOptions options;
    options.normalWeight = weight;
    EXPECT_EQ(agglomerate(surfels, allOf(surfels), options, context).error().code, ErrorCode::usage);
    options = {};
    options.balanceWeight = weight;
    EXPECT_EQ(agglomerate(surfels, allOf(surfels), options, context).error().code, ErrorCode::usage);
  }
}

TEST(Agglomerate, stopsWhenCancelled) {
  const Surfels surfels = makeSurfels(20000, 4);
  Context context;
  context.onProgress = [](std::string_view, double) { return false; };
  const Result<ClusterTree> tree = agglomerate(surfels, allOf(surfels), {}, context);
  ASSERT_FALSE(tree);
  EXPECT_EQ(tree.error().message, "cancelled");
}

TEST(Agglomerate, threadCountDoesNotChangeTheTree) {
  const Surfels surfels = makeSurfels(30000, 7);
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  const Result<ClusterTree> a = agglomerate(surfels, allOf(surfels), {}, one);
  const Result<ClusterTree> b = agglomerate(surfels, allOf(surfels), {}, two);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->first, b->first);
  EXPECT_EQ(a->second, b->second);
}

TEST(ClusterSearch, findsTheNearestWhileClustersMerge) {
  // Random merges, not nearest ones, so that bounds grow wide and every rebuild is passed.
  const std::uint32_t count = 1500;
  const Surfels surfels = makeSurfels(count, 21);
  const ClusterMetric metric = metricFor(surfels, {});
  std::vector<ClusterSum> sums = leafSums(surfels, metric);
  std::vector<ClusterSearch::Entry> entries;
  std::vector<std::uint32_t> living;
  for (std::uint32_t i = 0; i < count; ++i) {
    entries.push_back({clusterPoint(sums[i], metric), i});
    living.push_back(i);
  }
  ClusterSearch search(entries, 2 * count - 1, metric.balanceWeight);
  RandomStream random(5, 6, 7);
  for (std::uint32_t merged = count; merged < 2 * count - 1; ++merged) {
    const std::uint32_t asked = living[random.below(static_cast<std::uint32_t>(living.size()))];
    ClusterSearch::Nearest expected{std::numeric_limits<float>::infinity(), kNoCluster};
    for (const std::uint32_t other : living) {
      if (other == asked) continue;
      const float d = clusterDistance(entries[asked].point, entries[other].point, metric.balanceWeight);
      if (d < expected.distance || (d == expected.distance && other - asked < expected.id - asked))
        expected = {d, other};
    }
    const ClusterSearch::Nearest found = search.nearest(asked);
    ASSERT_EQ(found.id, expected.id) << merged;
    ASSERT_EQ(found.distance, expected.distance) << merged;

    std::swap(living[random.below(static_cast<std::uint32_t>(living.size()))], living.back());
    const std::uint32_t a = living.back();
    living.pop_back();
    const std::uint32_t at = random.below(static_cast<std::uint32_t>(living.size()));
    const std::uint32_t b = living[at];
    sums.push_back(mergeClusters(sums[a], sums[b]));
    entries.push_back({clusterPoint(sums[merged], metric), merged});
    search.merge(a, b, entries[merged]);
    EXPECT_FALSE(search.alive(a) || search.alive(b));
    living[at] = merged;
  }
  EXPECT_EQ(search.nearest(living[0]).id, kNoCluster);
}

TEST(ClusterSearch, findsTheNearestAmongTiedValues) {
  // Few values along each dimension, most points on the first of them: splits between equal values are uneven. And all
  // points on one, so that there are no halves.
  constexpr std::uint32_t kCount = 3000;
  for (const std::uint32_t values : {40u, 1u}) {
    std::vector<ClusterSearch::Entry> entries;
    for (std::uint32_t i = 0; i < kCount; ++i) {
      RandomStream random(8, 9, i);
      ClusterPoint point;
      for (float& p : point.p) p = 0.1f * static_cast<float>(random.below(8) > 5 ? random.below(values) : 0);
      point.area = random.below(8) > 5 && values > 1 ? static_cast<float>(1 + random.below(5)) : 1.0f;
      point.inverseArea = 1.0f / point.area;
      entries.push_back({point, i});
    }
    const ClusterSearch search(entries, kCount, 0.02f);
    for (std::uint32_t asked = 0; asked < kCount; asked += 7) {
      ClusterSearch::Nearest expected{std::numeric_limits<float>::infinity(), kNoCluster};
      for (std::uint32_t other = 0; other < kCount; ++other) {
        if (other == asked) continue;
        const float d = clusterDistance(entries[asked].point, entries[other].point, 0.02f);
        if (d < expected.distance || (d == expected.distance && other - asked < expected.id - asked))
          expected = {d, other};
      }
      const ClusterSearch::Nearest found = search.nearest(asked);
      ASSERT_EQ(found.id, expected.id) << asked;
      ASSERT_EQ(found.distance, expected.distance) << asked;
    }
  }
}

}  // namespace
}  // namespace relume
