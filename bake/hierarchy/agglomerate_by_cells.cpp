// SPDX-License-Identifier: MIT
// Approximate agglomerative clustering (Gu, He, Fatahalian, Blelloch: Efficient BVH Construction via Approximate
// Agglomerative Clustering, HPG 2013) in the space of metric.h. Space is halved at the middles of fixed cells until few
// surfels are left in each. In a cell the nearest pair is merged until only so many clusters are left
// (clustersLeft()); with those of its other half they are the clusters of the next larger cell.
//
// What a cell hands on follows from its surfels alone, so that each thread takes a cell.
#include "bake/base/parallel.h"
#include "bake/hierarchy/hierarchy.h"
#include "bake/hierarchy/metric.h"
#include "bake/hierarchy/nearest_pairs.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numeric>
#include <span>
#include <vector>

namespace relume {
namespace {

constexpr std::uint32_t kFewSurfels = 64;      // in a cell that is not halved
constexpr std::uint32_t kCellOfThread = 4096;  // [surfels] in a cell that one thread clusters, at most
constexpr float kCellsAlong = 1u << 20;        // finest cells along each axis of the metric's space
constexpr std::size_t kPlacesPerChunk = 4096;

// How many clusters a cell of so many surfels hands on to the next larger one. More cost time, by their square, and
// come nearer to merging the nearest pair of all (docs/notes/cuts.md). Never more than its halves hand on together.
// Rounded where no number of surfels comes near a half, since pow() may differ in its last digit between libraries.
std::uint32_t clustersLeft(std::uint32_t surfels) {
  constexpr double kScale = 9.0, kExponent = 0.4;
  const double left = kScale * std::pow(static_cast<double>(surfels), kExponent);
  return std::min(surfels, static_cast<std::uint32_t>(std::lround(left)));
}

// Those of a cell, and of all cells within.
std::uint32_t mergesWithin(std::uint32_t surfels) { return surfels - clustersLeft(surfels); }

// Where a surfel lies along the axes of the metric that cells are halved by, in finest cells: position and normal. What
// surfels see parts them in the metric alone.
constexpr std::size_t kHalvedAxes = 6;
using Place = std::array<std::uint32_t, kHalvedAxes>;

// A cell that holds what one thread clusters, or more.
struct Cell {
  std::uint32_t begin = 0, end = 0;     // of its surfels, in the order of cells
  std::uint32_t firstMerge = 0;         // its merges and those of all cells within have the numbers from here on
  std::uint32_t halves = 0;             // the first of its two halves; 0 = one thread clusters all of it
  std::vector<std::uint32_t> clusters;  // that are left
  std::uint32_t surfels() const { return end - begin; }
};

class CellClustering {
 public:
  CellClustering(std::vector<ClusterSum> leaves, const ClusterMetric& metric, Context& context);
  // No tree where the context is cancelled.
  ClusterTree run();

 private:
  std::uint32_t halve(std::uint32_t begin, std::uint32_t end);
  void halveCells();
  std::vector<std::uint32_t> cluster(std::uint32_t begin, std::uint32_t end, std::uint32_t firstMerge,
                                     NearestPairs& pairs);
  void join(Cell& cell);
  void mergeUntil(std::uint32_t left, std::uint32_t firstMerge, NearestPairs& pairs,
                  std::vector<std::uint32_t>& clusters);

  const ClusterMetric& metric_;
  Context& context_;
  ClusterTree tree_;
  std::vector<ClusterSum> sums_;         // [Size 2 n - 1] of leaves, then of merges
  std::vector<Place> places_;            // [Size n]
  std::vector<std::uint32_t> order_;     // [Size n] leaves by cell
  std::vector<Cell> cells_;              // larger ones first
  std::vector<std::size_t> levelBegin_;  // of the cells that were halved so often; then their number
};

CellClustering::CellClustering(std::vector<ClusterSum> leaves, const ClusterMetric& metric, Context& context)
    : metric_(metric), context_(context), sums_(std::move(leaves)), places_(sums_.size()), order_(sums_.size()) {
  const std::size_t count = sums_.size();
  tree_.leafCount = static_cast<std::uint32_t>(count);
  tree_.first.resize(count - 1);
  tree_.second.resize(count - 1);
  std::iota(order_.begin(), order_.end(), 0u);
  const float half = std::max(0.5f, metric.normalScale);  // from the middle of these axes to their ends
  parallelChunks(context, "", count, kPlacesPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const ClusterPoint point = clusterPoint(sums_[i], metric);
      for (std::size_t k = 0; k < kHalvedAxes; ++k) {
        const float share = std::clamp(0.5f * (point.p[k] / half + 1.0f), 0.0f, 1.0f);
        places_[i][k] = static_cast<std::uint32_t>(share * (kCellsAlong - 1.0f));
      }
    }
  });
  sums_.resize(2 * count - 1);
}

// Put the surfels of a cell's first half before those of the second, and find where these begin. The coarsest plane
// that parts them decides, the first axis among equals; those of one finest cell are halved by number.
std::uint32_t CellClustering::halve(std::uint32_t begin, std::uint32_t end) {
  Place low = places_[order_[begin]], high = low;
  for (std::uint32_t i = begin + 1; i < end; ++i) {
    const Place& place = places_[order_[i]];
    for (std::size_t k = 0; k < place.size(); ++k) {
      low[k] = std::min(low[k], place[k]);
      high[k] = std::max(high[k], place[k]);
    }
  }
  std::size_t axis = 0;
  std::uint32_t plane = 0;
  for (std::size_t k = 0; k < low.size(); ++k) {
    const std::uint32_t coarsest = std::bit_floor(low[k] ^ high[k]);
    if (coarsest > plane) plane = coarsest, axis = k;
  }
  if (plane == 0) return begin + (end - begin) / 2;
  const auto middle = std::stable_partition(order_.begin() + begin, order_.begin() + end,
                                            [&](std::uint32_t i) { return (places_[i][axis] & plane) == 0; });
  return static_cast<std::uint32_t>(middle - order_.begin());
}

// Halve the level until each cell is one thread's.
void CellClustering::halveCells() {
  cells_.push_back({0, tree_.leafCount, 0, 0, {}});
  levelBegin_ = {0, 1};
  while (levelBegin_.back() > levelBegin_[levelBegin_.size() - 2] && !context_.cancelled()) {
    const std::size_t first = levelBegin_[levelBegin_.size() - 2], count = levelBegin_.back() - first;
    std::vector<std::uint32_t> middle(count, 0);
    parallelChunks(context_, "", count, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Cell& cell = cells_[first + i];
        if (cell.surfels() > kCellOfThread) middle[i] = halve(cell.begin, cell.end);
      }
    });
    for (std::size_t i = 0; i < count; ++i) {
      if (middle[i] == 0) continue;
      const std::uint32_t begin = cells_[first + i].begin, end = cells_[first + i].end;
      const std::uint32_t firstMerge = cells_[first + i].firstMerge;
      cells_[first + i].halves = static_cast<std::uint32_t>(cells_.size());
      cells_.push_back({begin, middle[i], firstMerge, 0, {}});
      cells_.push_back({middle[i], end, firstMerge + mergesWithin(middle[i] - begin), 0, {}});
    }
    levelBegin_.push_back(cells_.size());
  }
}

// The clusters that are left of a cell of one thread.
std::vector<std::uint32_t> CellClustering::cluster(std::uint32_t begin, std::uint32_t end, std::uint32_t firstMerge,
                                                   NearestPairs& pairs) {
  std::vector<std::uint32_t> clusters;
  if (end - begin <= kFewSurfels) {
    clusters.assign(order_.begin() + begin, order_.begin() + end);
  } else {
    const std::uint32_t middle = halve(begin, end);
    clusters = cluster(begin, middle, firstMerge, pairs);
    firstMerge += mergesWithin(middle - begin);
    const std::vector<std::uint32_t> others = cluster(middle, end, firstMerge, pairs);
    firstMerge += mergesWithin(end - middle);
    clusters.insert(clusters.end(), others.begin(), others.end());
  }
  mergeUntil(clustersLeft(end - begin), firstMerge, pairs, clusters);
  return clusters;
}

// Merge what is left of a cell's halves.
void CellClustering::join(Cell& cell) {
  Cell &first = cells_[cell.halves], &second = cells_[cell.halves + 1];
  cell.clusters = std::move(first.clusters);
  cell.clusters.insert(cell.clusters.end(), second.clusters.begin(), second.clusters.end());
  second.clusters = {};
  NearestPairs pairs;
  mergeUntil(clustersLeft(cell.surfels()),
             cell.firstMerge + mergesWithin(first.surfels()) + mergesWithin(second.surfels()), pairs, cell.clusters);
}

void CellClustering::mergeUntil(std::uint32_t left, std::uint32_t firstMerge, NearestPairs& pairs,
                                std::vector<std::uint32_t>& clusters) {
  pairs.mergeUntil(left, clusters, sums_, metric_, [&](std::uint32_t a, std::uint32_t b) {
    const std::uint32_t merged = tree_.leafCount + firstMerge;
    tree_.first[firstMerge] = a;
    tree_.second[firstMerge++] = b;
    sums_[merged] = mergeClusters(sums_[a], sums_[b]);
    return merged;
  });
}

ClusterTree CellClustering::run() {
  halveCells();
  std::vector<std::uint32_t> ofThreads;
  for (std::uint32_t i = 0; i < cells_.size(); ++i) {
    if (cells_[i].halves == 0) ofThreads.push_back(i);
  }
  parallelChunks(context_, "clustering", ofThreads.size(), 1, [&](std::size_t begin, std::size_t end) {
    NearestPairs pairs;
    for (std::size_t i = begin; i < end; ++i) {
      Cell& cell = cells_[ofThreads[i]];
      cell.clusters = cluster(cell.begin, cell.end, cell.firstMerge, pairs);
    }
  });
  places_ = {};
  for (std::size_t level = levelBegin_.size() - 1; level-- > 0;) {
    const std::size_t first = levelBegin_[level];
    parallelChunks(context_, "", levelBegin_[level + 1] - first, 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = first + begin; i < first + end; ++i) {
        if (cells_[i].halves > 0) join(cells_[i]);
      }
    });
  }
  if (context_.cancelled()) return {};
  NearestPairs pairs;
  mergeUntil(1, mergesWithin(tree_.leafCount), pairs, cells_[0].clusters);
  return std::move(tree_);
}

}  // namespace

Result<ClusterTree> agglomerateByCells(const Surfels& surfels, std::span<const std::uint32_t> members,
                                       const ClusteringOptions& options, Context& context,
                                       std::span<const glm::vec3> centroids) {
  if (const Status ok = checkClusterInput(surfels, members, options); !ok) return ok.error();
  const ClusterMetric metric = metricOf(surfels, options);
  std::vector<ClusterSum> leaves;
  leaves.reserve(2 * members.size() - 1);
  for (const std::uint32_t member : members) leaves.push_back(leafOf(surfels, member, centroids, metric));
  ClusterTree tree = CellClustering(std::move(leaves), metric, context).run();
  if (context.cancelled()) return cancelledError();
  return tree;
}

}  // namespace relume
