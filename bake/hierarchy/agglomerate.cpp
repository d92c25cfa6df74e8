// SPDX-License-Identifier: MIT
// Exact agglomerative clustering of surfels (PIC 4.3, after the generic algorithm of Müllner 2011): always merges the
// two clusters that are nearest under the metric of metric.h; ties break by index.
//
// The metric is not reducible (ERRATA of PIC 4.3): chains of nearest neighbours would give another, worse tree, and a
// merge may be nearer than the one before. So a heap holds a lower bound for every cluster: the distance to its nearest
// neighbour when that was last looked up. A new cluster looks up its own neighbour, so that the top of the heap is the
// nearest pair of all if both of its clusters still exist. If the neighbour does not, it is looked up again.
#include "bake/base/parallel.h"
#include "bake/hierarchy/cluster_search.h"
#include "bake/hierarchy/hierarchy.h"

#include <algorithm>
#include <array>

namespace relume {
namespace {

// A pair of clusters, sorted by their distance. `owner` is the cluster that looked up the other.
struct Candidate {
  float distance = 0.0f;
  std::uint32_t low = 0, high = 0;
  std::uint32_t owner = 0;
};

bool before(const Candidate& a, const Candidate& b) {
  if (a.distance != b.distance) return a.distance < b.distance;
  return a.low != b.low ? a.low < b.low : a.high < b.high;
}

// A heap with four children per node and the first candidate on top. Siblings share a cache line. The lines of all
// nodes that may come next are prefetched before the comparisons that choose one.
class CandidateHeap {
 public:
  explicit CandidateHeap(std::span<const Candidate> items) : family_((items.size() + 6) / 4), count_(items.size()) {
    for (std::size_t i = 0; i < count_; ++i) at(i) = items[i];
    for (std::size_t i = count_ / 4 + 1; i-- > 0;) sink(i);
  }
  const Candidate& top() const { return at(0); }
  // Prefetch the candidates of which one will be on top after this one.
  std::span<const Candidate> next() const {
    return count_ > 1 ? std::span(family_[1].item).first(std::min<std::size_t>(count_ - 1, 4))
                      : std::span<const Candidate>();
  }
  void replaceTop(const Candidate& item) {
    at(0) = item;
    sink(0);
  }
  void pop() {
    at(0) = at(count_ - 1);
    --count_;
    sink(0);
  }

 private:
  struct alignas(64) Family {
    std::array<Candidate, 4> item;
  };
  static_assert(sizeof(Family) == 64);

  // The root is the last of family 0; the children of item i are family i + 1.
  Candidate& at(std::size_t i) { return family_[(i + 3) / 4].item[(i + 3) % 4]; }
  const Candidate& at(std::size_t i) const { return family_[(i + 3) / 4].item[(i + 3) % 4]; }

  void sink(std::size_t from) {
    if (from >= count_) return;
    const Candidate item = at(from);
    for (std::size_t begin = 4 * from + 1; begin < count_; begin = 4 * from + 1) {
      for (std::size_t family = begin + 1; family < begin + 5 && family < family_.size(); ++family) {
        __builtin_prefetch(&family_[family]);
      }
      const std::size_t end = std::min(begin + 4, count_);
      std::size_t best = begin;
      for (std::size_t i = begin + 1; i < end; ++i) {
        if (before(at(i), at(best))) best = i;
      }
      if (!before(at(best), item)) break;
      at(from) = at(best);
      from = best;
    }
    at(from) = item;
  }

  std::vector<Family> family_;
  std::size_t count_;
};

Candidate candidateOf(const ClusterSearch& search, std::uint32_t owner) {
  const ClusterSearch::Nearest nearest = search.nearest(owner);
  return {nearest.distance, std::min(owner, nearest.id), std::max(owner, nearest.id), owner};
}

}  // namespace

Result<ClusterTree> agglomerate(const Surfels& surfels, std::span<const std::uint32_t> members,
                                const ClusteringOptions& options, Context& context,
                                std::span<const glm::vec3> centroids) {
  if (const Status ok = checkClusterInput(surfels, members, options); !ok) return ok.error();
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
    sums[i] = leafOf(surfels, members[i], centroids, metric);
    entries[i] = {clusterPoint(sums[i], metric), i};
  }
  ClusterSearch search(entries, 2 * leafCount - 1, metric.balanceWeight);
  if (context.cancelled()) return cancelledError();

  // Look up the nearest neighbour of each.
  std::vector<Candidate> candidates(leafCount);
  parallelChunks(context, "", leafCount, 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) candidates[i] = candidateOf(search, static_cast<std::uint32_t>(i));
  });
  if (context.cancelled()) return cancelledError();
  CandidateHeap heap(candidates);
  candidates = {};

  // Merge the nearest pair until one cluster is left.
  const std::uint32_t reportEvery = std::max(1024u, leafCount / 64);
  for (std::uint32_t merged = leafCount; merged < 2 * leafCount - 1;) {
    const Candidate pair = heap.top();
    for (const Candidate& next : heap.next()) {
      search.prefetch(next.owner);
      __builtin_prefetch(&sums[next.low]);
      __builtin_prefetch(&sums[next.high]);
    }
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
    if (context.cancelled()) return cancelledError();
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
