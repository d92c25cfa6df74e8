// SPDX-License-Identifier: MIT
// What a cluster tree must be, and what it costs.
#pragma once

#include "bake/hierarchy/hierarchy.h"
#include "bake/hierarchy/metric.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace relume {

// PIC 4.3 as printed, between clusters of unit normals.
inline double printedDistance(const ClusterSum& a, const ClusterSum& b, const ClusteringOptions& options) {
  const glm::dvec3 apart = glm::dvec3(a.center) - glm::dvec3(b.center);
  const double larger = std::max(a.leaves, b.leaves), smaller = std::min(a.leaves, b.leaves);
  return glm::dot(apart, apart) + options.normalWeight * (1.0 - glm::dot(glm::dvec3(a.normal), glm::dvec3(b.normal))) +
         options.balanceWeight * (larger - smaller) / larger;
}

inline ClusterMetric metricFor(const Surfels& surfels, const ClusteringOptions& options) {
  glm::vec3 low(1e30f), high(-1e30f);
  for (const glm::vec3& p : surfels.positionWorld) low = glm::min(low, p), high = glm::max(high, p);
  const float extent = glm::length(high - low);
  return {0.5f * (low + high), extent > 0.0f ? 1.0f / extent : 0.0f, std::sqrt(0.5f * options.normalWeight),
          std::sqrt(options.outlookWeight), options.balanceWeight};
}

inline std::vector<ClusterSum> leafSums(const Surfels& surfels, const ClusterMetric& metric) {
  std::vector<ClusterSum> sums;
  for (std::uint32_t i = 0; i < surfels.count(); ++i) {
    sums.push_back(
        {(surfels.positionWorld[i] - metric.origin) * metric.inverseExtent, surfels.normal[i], surfels.normal[i], 1});
  }
  return sums;
}

inline void expectTree(const ClusterTree& tree, std::uint32_t leafCount) {
  ASSERT_EQ(tree.leafCount, leafCount);
  ASSERT_EQ(tree.first.size(), leafCount - 1);
  std::vector<int> used(2 * leafCount - 1, 0);
  for (std::uint32_t k = 0; k + 1 < leafCount; ++k) {
    ASSERT_LT(tree.first[k], leafCount + k);
    ASSERT_LT(tree.second[k], leafCount + k);
    ++used[tree.first[k]];
    ++used[tree.second[k]];
  }
  for (std::uint32_t i = 0; i + 1 < used.size(); ++i) EXPECT_EQ(used[i], 1) << i;
}

// Total of the printed metric over all merges: what a tree costs.
inline double treeCost(const Surfels& surfels, const ClusterTree& tree, const ClusteringOptions& options) {
  std::vector<ClusterSum> sums = leafSums(surfels, metricFor(surfels, options));
  double cost = 0.0;
  for (std::size_t k = 0; k < tree.first.size(); ++k) {
    cost += printedDistance(sums[tree.first[k]], sums[tree.second[k]], options);
    sums.push_back(mergeClusters(sums[tree.first[k]], sums[tree.second[k]]));
  }
  return cost;
}

}  // namespace relume
