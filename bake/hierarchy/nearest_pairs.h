// SPDX-License-Identifier: MIT
// Merges the nearest pair of a few clusters under the metric of metric.h, again and again, by looking at all of them.
// For one thread; keeps its memory from call to call.
#pragma once

#include "bake/hierarchy/metric.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace relume {

class NearestPairs {
 public:
  // Until so many are left: clusters are indices of sums, and merge(a, b) makes a cluster of two and returns its own.
  // Among pairs as near, the first in the order of `clusters`; that order stays, but for the last, which takes the
  // place of one that was merged.
  template <class Merge>
  void mergeUntil(std::size_t left, std::vector<std::uint32_t>& clusters, std::span<const ClusterSum> sums,
                  const ClusterMetric& metric, const Merge& merge) {
    if (clusters.size() <= left) return;
    begin(clusters, sums, metric);
    while (count_ > left) {
      const auto [a, b] = nearestPair();
      clusters[a] = merge(clusters[a], clusters[b]);
      clusters[b] = clusters[count_ - 1];
      replace(a, b, clusterPoint(sums[clusters[a]], metric));
    }
    clusters.resize(left);
  }

 private:
  static constexpr std::uint32_t kGone = 0xFFFFFFFFu;

  void begin(std::span<const std::uint32_t> clusters, std::span<const ClusterSum> sums, const ClusterMetric& metric);
  // a < b
  std::pair<std::size_t, std::size_t> nearestPair();
  // The point takes the place of a, the last one that of b.
  void replace(std::size_t a, std::size_t b, const ClusterPoint& point);
  void set(std::size_t at, const ClusterPoint& point);
  void findNearest(std::size_t at);

  std::size_t count_ = 0;
  float balanceWeight_ = 0.0f;
  std::array<std::vector<float>, kClusterDimensions> p_;
  std::vector<float> area_, inverseArea_;
  std::vector<float> distance_;         // to the nearest other; where that is gone, no more than to the one now
  std::vector<std::uint32_t> nearest_;  // kGone: it was merged
  std::vector<float> toEach_;
};

}  // namespace relume
