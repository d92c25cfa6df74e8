// SPDX-License-Identifier: MIT
// Exact agglomerative clustering of surfels (PIC 4.3, after the generic algorithm of Müllner 2011): always merges the
// two clusters that are nearest under the metric of metric.h; ties break by index.
//
// The metric is not reducible (ERRATA of PIC 4.3): chains of nearest neighbours would give another, worse tree, and a
// merge may be nearer than the one before. So a heap holds, for every cluster, a lower bound: its nearest neighbour
// when it was last looked up. A cluster born later looks up its own, so the heap's top is the nearest pair of all as
// soon as both of its clusters live; where the neighbour is dead, it is looked up again.
#include "bake/hierarchy/cluster_search.h"
#include "bake/hierarchy/hierarchy.h"
#include "bake/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <string>

namespace relume {
namespace {

constexpr float kMaxWeight = 1e6f;

Status checkInput(const Surfels& surfels, std::span<const std::uint32_t> members, const ClusteringOptions& options) {
  const auto inRange = [](float w) { return w >= 0.0f && w <= kMaxWeight; };
  if (!inRange(options.normalWeight) || !inRange(options.balanceWeight)) {
    return Error{ErrorCode::usage, "clustering weights must be in [0, 1e6], found normalWeight " +
                                       std::to_string(options.normalWeight) + ", balanceWeight " +
                                       std::to_string(options.balanceWeight)};
  }
  if (members.empty()) return Error{ErrorCode::failed, "clustering needs at least one surfel"};
  for (const std::uint32_t member : members) {
    if (member >= surfels.count()) {
      return Error{ErrorCode::failed, "clustering: surfel " + std::to_string(member) + " of " +
                                          std::to_string(surfels.count()) + " does not exist"};
    }
  }
  return done();
}

ClusterMetric metricOf(const Surfels& surfels, const ClusteringOptions& options) {
  glm::vec3 low = surfels.positionWorld[0], high = low;
  for (const glm::vec3& p : surfels.positionWorld) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  ClusterMetric metric;
  const float extent = glm::length(high - low);
  metric.origin = 0.5f * (low + high);
  metric.inverseExtent = extent > 0.0f ? 1.0f / extent : 0.0f;
  metric.normalScale = std::sqrt(0.5f * options.normalWeight);
  metric.balanceWeight = options.balanceWeight;
  return metric;
}

// A pair of clusters, nearest first; `owner` is the one that looked for the other.
struct Candidate {
  float distance = 0.0f;
  std::uint32_t low = 0, high = 0;
  std::uint32_t owner = 0;
};

bool before(const Candidate& a, const Candidate& b) {
  if (a.distance != b.distance) return a.distance < b.distance;
  return a.low != b.low ? a.low < b.low : a.high < b.high;
}

// A heap of four children a node with the first candidate on top.
class CandidateHeap {
 public:
  explicit CandidateHeap(std::vector<Candidate> items) : items_(std::move(items)) {
    for (std::size_t i = items_.size() / 4 + 1; i-- > 0;) sink(i);
  }
  bool empty() const { return items_.empty(); }
  const Candidate& top() const { return items_.front(); }
  void replaceTop(const Candidate& item) {
    items_.front() = item;
    sink(0);
  }
  void pop() {
    items_.front() = items_.back();
    items_.pop_back();
    sink(0);
  }

 private:
  void sink(std::size_t at) {
    const std::size_t n = items_.size();
    if (at >= n) return;
    const Candidate item = items_[at];
    for (;;) {
      const std::size_t begin = 4 * at + 1, end = std::min(begin + 4, n);
      if (begin >= n) break;
      std::size_t best = begin;
      for (std::size_t i = begin + 1; i < end; ++i) {
        if (before(items_[i], items_[best])) best = i;
      }
      if (!before(items_[best], item)) break;
      items_[at] = items_[best];
      at = best;
    }
    items_[at] = item;
  }

  std::vector<Candidate> items_;
};

Candidate candidateOf(const ClusterSearch& search, std::uint32_t owner) {
  const ClusterSearch::Nearest nearest = search.nearest(owner);
  return {nearest.distance, std::min(owner, nearest.id), std::max(owner, nearest.id), owner};
}

}  // namespace

Result<ClusterTree> agglomerate(const Surfels& surfels, std::span<const std::uint32_t> members,
                                const ClusteringOptions& options, Context& context) {
  if (const Status ok = checkInput(surfels, members, options); !ok) return ok.error();
  const auto leafCount = static_cast<std::uint32_t>(members.size());
  ClusterTree tree;
  tree.leafCount = leafCount;
  if (leafCount == 1) return tree;
  tree.first.reserve(leafCount - 1);
  tree.second.reserve(leafCount - 1);

  // Every surfel is a cluster.
  const ClusterMetric metric = metricOf(surfels, options);
  std::vector<ClusterSum> sums(2 * std::size_t{leafCount} - 1);
  std::vector<ClusterSearch::Entry> entries(leafCount);
  for (std::uint32_t i = 0; i < leafCount; ++i) {
    const glm::vec3 normal = surfels.normal[members[i]];
    sums[i] = {(surfels.positionWorld[members[i]] - metric.origin) * metric.inverseExtent, normal, normal, 1};
    entries[i] = {clusterPoint(sums[i], metric), i};
  }
  ClusterSearch search(entries, 2 * leafCount - 1, metric.balanceWeight);

  // Look up the nearest neighbour of each.
  std::vector<Candidate> candidates(leafCount);
  parallelChunks(context, "", leafCount, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) candidates[i] = candidateOf(search, static_cast<std::uint32_t>(i));
  });
  if (context.cancelled()) return cancelledError();
  CandidateHeap heap(std::move(candidates));

  // Merge the nearest pair until one cluster is left.
  const std::uint32_t reportEvery = std::max(1024u, leafCount / 64);
  for (std::uint32_t merged = leafCount; merged < 2 * leafCount - 1;) {
    const Candidate pair = heap.top();
    if (!search.alive(pair.owner)) {
      heap.pop();
      continue;
    }
    const std::uint32_t other = pair.owner == pair.low ? pair.high : pair.low;
    if (!search.alive(other)) {
      heap.replaceTop(candidateOf(search, pair.owner));
      continue;
    }
    tree.first.push_back(pair.low);
    tree.second.push_back(pair.high);
    sums[merged] = mergeClusters(sums[pair.low], sums[pair.high]);
    search.merge(pair.low, pair.high, {clusterPoint(sums[merged], metric), merged});
    if (++merged == 2 * leafCount - 1) break;
    heap.replaceTop(candidateOf(search, merged - 1));
    if (merged % reportEvery == 0 &&
        !context.progress("clustering", static_cast<double>(merged - leafCount) / static_cast<double>(leafCount))) {
      return cancelledError();
    }
  }
  return tree;
}

}  // namespace relume
