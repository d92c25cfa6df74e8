// SPDX-License-Identifier: MIT
// See cluster_search.h. The bound of a box is computed in the same order of operations as the metric itself. So a bound
// never exceeds the distance that it bounds, and the search is exact to the last bit on every instruction set.
#include "bake/hierarchy/cluster_search.h"

#include "bake/base/wide_clones.h"

#include <algorithm>
#include <array>

namespace relume {
namespace {

using Node = ClusterSearch::Node;
using Leaf = ClusterSearch::Leaf;
using Entry = ClusterSearch::Entry;
using Tree = ClusterSearch::Tree;
using Nearest = ClusterSearch::Nearest;

constexpr int kDimensions = kClusterDimensions;
constexpr int kWidth = ClusterSearch::kWidth;
constexpr int kLeafSize = ClusterSearch::kLeafSize;
// A coordinate whose square is finite but larger than any distance.
constexpr float kFarAway = 1e17f;
constexpr float kNoDistance = 1e30f;
constexpr int kStackSize = 512;

struct Visit {
  float bound;
  std::uint32_t child;
};

inline void scanLeaf(const Leaf& leaf, const ClusterPoint& q, std::uint32_t self, float balanceWeight, Nearest& best) {
  alignas(64) float d[kLeafSize];
  for (int i = 0; i < kLeafSize; ++i) {
    float sum = 0.0f;
    for (int k = 0; k < kDimensions; ++k) sum += (q.p[k] - leaf.p[k][i]) * (q.p[k] - leaf.p[k][i]);
    const float up = q.area * leaf.inverseArea[i], down = leaf.area[i] * q.inverseArea;
    const float ratio = up < down ? up : down;
    d[i] = sum + balanceWeight * (1.0f - (ratio < 1.0f ? ratio : 1.0f));
  }
  for (int i = 0; i < kLeafSize; ++i) {
    if (d[i] > best.distance || leaf.id[i] == self) continue;
    if (d[i] < best.distance || leaf.id[i] - self < best.id - self) best = {d[i], leaf.id[i]};
  }
}

inline void boundChildren(const Node& node, const ClusterPoint& q, float balanceWeight, float* bound) {
  for (int i = 0; i < kWidth; ++i) {
    float sum = 0.0f;
    for (int k = 0; k < kDimensions; ++k) {
      const float below = node.low[k][i] - q.p[k], above = q.p[k] - node.high[k][i];
      const float outside = below > above ? below : above;
      const float t = outside > 0.0f ? outside : 0.0f;
      sum += t * t;
    }
    const float up = q.area * node.inverseAreaLow[i], down = node.areaHigh[i] * q.inverseArea;
    const float ratio = up < down ? up : down;
    bound[i] = sum + balanceWeight * (1.0f - (ratio < 1.0f ? ratio : 1.0f));
  }
}

// Prefetch what is visited next.
inline void prefetchChild(const Node* nodes, const Leaf* leaves, std::uint32_t child) {
  const bool isLeaf = (child & ClusterSearch::kLeafChild) != 0;
  const std::uint32_t index = child & ~ClusterSearch::kLeafChild;
  const char* line =
      isLeaf ? reinterpret_cast<const char*>(&leaves[index]) : reinterpret_cast<const char*>(&nodes[index]);
  for (std::size_t at = 0; at < sizeof(Node); at += 64) __builtin_prefetch(line + at);
}

// Whether some id of a range comes before `best` on the circle that begins after `self`.
inline bool mayComeBefore(std::uint32_t smallest, std::uint32_t largest, std::uint32_t best, std::uint32_t self) {
  const std::uint32_t next = smallest > self || largest < self ? smallest - self : 1;
  return next < best - self;
}

RELUME_WIDE_CLONES
Nearest findNearest(const Node* nodes, const Leaf* leaves, std::uint32_t ownLeaf, const ClusterPoint& q,
                    std::uint32_t self, float balanceWeight) {
  // Begin with the cluster's own leaf: the neighbour found there excludes most of the rest.
  Nearest best{kNoDistance, kNoCluster};
  scanLeaf(leaves[ownLeaf], q, self, balanceWeight, best);

  std::array<Visit, kStackSize> stack;
  int top = 0;
  stack[top++] = {0.0f, 0u};
  while (top > 0) {
    const Visit visit = stack[--top];
    if (visit.bound > best.distance) continue;
    if (visit.child & ClusterSearch::kLeafChild) {
      const std::uint32_t leaf = visit.child & ~ClusterSearch::kLeafChild;
      if (leaf != ownLeaf) scanLeaf(leaves[leaf], q, self, balanceWeight, best);
      continue;
    }

    // Push the children that may hold a nearer cluster, or one as near that comes first by id. The nearest goes on top.
    const Node& node = nodes[visit.child];
    alignas(64) float bound[kWidth];
    boundChildren(node, q, balanceWeight, bound);
    const int base = top;
    for (int i = 0; i < kWidth; ++i) {
      if (bound[i] > best.distance) continue;
      if (bound[i] == best.distance && !mayComeBefore(node.smallestId[i], node.largestId[i], best.id, self)) continue;
      int at = top++;
      for (; at > base && stack[at - 1].bound < bound[i]; --at) stack[at] = stack[at - 1];
      stack[at] = {bound[i], node.child[i]};
    }
    if (top > base) prefetchChild(nodes, leaves, stack[top - 1].child);
  }
  return best;
}

// Split the entries into about two halves across the dimension in which the metric is widest. Entries of equal value
// stay together, so that parallel planes, and clusters of different sizes, are separated. Returns the first of the
// second half.
std::size_t splitEntries(std::span<Entry> entries, float balanceWeight) {
  std::array<float, kDimensions + 1> low, high;
  low.fill(kNoDistance);
  high.fill(-kNoDistance);
  for (const Entry& e : entries) {
    for (int k = 0; k < kDimensions; ++k) {
      low[k] = std::min(low[k], e.point.p[k]);
      high[k] = std::max(high[k], e.point.p[k]);
    }
    low[kDimensions] = std::min(low[kDimensions], e.point.area);
    high[kDimensions] = std::max(high[kDimensions], e.point.area);
  }
  int axis = 0;
  float widest = -1.0f;
  for (int k = 0; k <= kDimensions; ++k) {
    const float span = k < kDimensions ? (high[k] - low[k]) * (high[k] - low[k])
                                       : balanceWeight * (1.0f - low[kDimensions] / high[kDimensions]);
    if (span > widest) widest = span, axis = k;
  }

  const auto key = [axis](const Entry& e) { return axis < kDimensions ? e.point.p[axis] : e.point.area; };
  const std::size_t middle = entries.size() / 2;
  std::nth_element(entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(middle), entries.end(),
                   [&](const Entry& a, const Entry& b) {
                     const float x = key(a), y = key(b);
                     return x < y || (x == y && a.id < b.id);
                   });
  const float value = key(entries[middle]);
  const auto first = entries.begin(), last = entries.end(), at = first + static_cast<std::ptrdiff_t>(middle);
  const auto below = std::partition(first, at, [&](const Entry& e) { return key(e) < value; });
  const auto above = std::partition(at, last, [&](const Entry& e) { return key(e) == value; });
  if (below == first && above == last) return middle;
  const bool up = below == first || (above != last && above - at < at - below);
  return static_cast<std::size_t>((up ? above : below) - first);
}

void setChildBounds(Node& node, int i, std::span<const Entry> entries) {
  float areaLow = kNoDistance, areaHigh = 0.0f;
  node.smallestId[i] = kNoCluster;
  node.largestId[i] = 0;
  for (int k = 0; k < kDimensions; ++k) node.low[k][i] = kNoDistance, node.high[k][i] = -kNoDistance;
  for (const Entry& e : entries) {
    for (int k = 0; k < kDimensions; ++k) {
      node.low[k][i] = std::min(node.low[k][i], e.point.p[k]);
      node.high[k][i] = std::max(node.high[k][i], e.point.p[k]);
    }
    areaLow = std::min(areaLow, e.point.area);
    areaHigh = std::max(areaHigh, e.point.area);
    node.smallestId[i] = std::min(node.smallestId[i], e.id);
    node.largestId[i] = std::max(node.largestId[i], e.id);
  }
  node.inverseAreaLow[i] = 1.0f / areaLow;
  node.areaHigh[i] = areaHigh;
}

void setChildEmpty(Node& node, int i) {
  for (int k = 0; k < kDimensions; ++k) node.low[k][i] = node.high[k][i] = kFarAway;
  node.inverseAreaLow[i] = node.areaHigh[i] = 1.0f;
  node.smallestId[i] = node.largestId[i] = kNoCluster;
  node.child[i] = ClusterSearch::kNoChild;
}

void setLane(Leaf& leaf, std::uint32_t lane, const ClusterPoint& point, std::uint32_t id) {
  for (int k = 0; k < kDimensions; ++k) leaf.p[k][lane] = point.p[k];
  leaf.area[lane] = point.area;
  leaf.inverseArea[lane] = point.inverseArea;
  leaf.id[lane] = id;
}

constexpr ClusterPoint farPoint() {
  ClusterPoint point;
  point.p.fill(kFarAway);
  return point;
}
constexpr ClusterPoint kFarPoint = farPoint();

ClusterPoint laneAt(const Leaf& leaf, std::uint32_t lane) {
  ClusterPoint point;
  for (int k = 0; k < kDimensions; ++k) point.p[k] = leaf.p[k][lane];
  point.area = leaf.area[lane];
  point.inverseArea = leaf.inverseArea[lane];
  return point;
}

// Halve the largest part until there are eight, or all fit into leaves. Returns how many there are.
int splitIntoChildren(std::span<Entry> entries, float balanceWeight, std::array<std::span<Entry>, kWidth>& parts) {
  int count = 1;
  parts[0] = entries;
  while (count < kWidth) {
    int largest = 0;
    for (int i = 1; i < count; ++i) {
      if (parts[i].size() > parts[largest].size()) largest = i;
    }
    if (parts[largest].size() <= static_cast<std::size_t>(kLeafSize)) break;
    const std::span<Entry> whole = parts[largest];
    const std::size_t middle = splitEntries(whole, balanceWeight);
    parts[largest] = whole.first(middle);
    parts[count++] = whole.subspan(middle);
  }
  return count;
}

std::uint32_t buildLeaf(Tree& tree, std::span<const Entry> entries, std::uint32_t parent, std::uint32_t parentChild) {
  const auto index = static_cast<std::uint32_t>(tree.leaves.size());
  Leaf& leaf = tree.leaves.emplace_back();
  leaf.parent = parent;
  leaf.parentChild = parentChild;
  for (std::uint32_t lane = 0; lane < kLeafSize; ++lane) {
    const bool used = lane < entries.size();
    setLane(leaf, lane, used ? entries[lane].point : kFarPoint, used ? entries[lane].id : kNoCluster);
  }
  return index | ClusterSearch::kLeafChild;
}

std::uint32_t buildNode(Tree& tree, std::span<Entry> entries, std::uint32_t parent, std::uint32_t parentChild,
                        float balanceWeight) {
  std::array<std::span<Entry>, kWidth> parts;
  const int count = splitIntoChildren(entries, balanceWeight, parts);
  const auto index = static_cast<std::uint32_t>(tree.nodes.size());
  tree.nodes.emplace_back();
  tree.nodes[index].parent = parent;
  tree.nodes[index].parentChild = parentChild;
  for (int i = 0; i < kWidth; ++i) {
    if (i >= count) {
      setChildEmpty(tree.nodes[index], i);
      continue;
    }
    const auto at = static_cast<std::uint32_t>(i);
    const bool isLeaf = parts[i].size() <= static_cast<std::size_t>(kLeafSize);
    const std::uint32_t child =
        isLeaf ? buildLeaf(tree, parts[i], index, at) : buildNode(tree, parts[i], index, at, balanceWeight);
    tree.nodes[index].child[i] = child;
    setChildBounds(tree.nodes[index], i, parts[i]);
  }
  return index;
}

}  // namespace

ClusterSearch::ClusterSearch(std::span<const Entry> clusters, std::uint32_t idCount, float balanceWeight)
    : slot_(idCount, kDead), balanceWeight_(balanceWeight) {
  std::vector<Entry> entries(clusters.begin(), clusters.end());
  build(entries);
}

ClusterSearch::Nearest ClusterSearch::nearest(std::uint32_t id) const {
  const std::uint32_t slot = slot_[id];
  const std::uint32_t leaf = slot / kLeafSize;
  const ClusterPoint point = laneAt(tree_.leaves[leaf], slot % kLeafSize);
  return findNearest(tree_.nodes.data(), tree_.leaves.data(), leaf, point, id, balanceWeight_);
}

void ClusterSearch::merge(std::uint32_t a, std::uint32_t b, const Entry& merged) {
  // Take the slot of the larger child, so that bounds grow little. The other's slot stays empty.
  const std::uint32_t slotA = slot_[a], slotB = slot_[b];
  const float areaA = tree_.leaves[slotA / kLeafSize].area[slotA % kLeafSize];
  const float areaB = tree_.leaves[slotB / kLeafSize].area[slotB % kLeafSize];
  const std::uint32_t kept = areaA >= areaB ? slotA : slotB, dropped = kept == slotA ? slotB : slotA;
  slot_[a] = slot_[b] = kDead;
  slot_[merged.id] = kept;
  setLane(tree_.leaves[dropped / kLeafSize], dropped % kLeafSize, kFarPoint, kNoCluster);
  setLane(tree_.leaves[kept / kLeafSize], kept % kLeafSize, merged.point, merged.id);
  grow(tree_.leaves[kept / kLeafSize], merged);

  if (--living_ * 3 >= built_ * 2 || living_ < 2) return;
  std::vector<Entry> entries;
  entries.reserve(living_);
  for (const Leaf& leaf : tree_.leaves) {
    for (std::uint32_t lane = 0; lane < kLeafSize; ++lane) {
      if (leaf.id[lane] != kNoCluster) entries.push_back({laneAt(leaf, lane), leaf.id[lane]});
    }
  }
  build(entries);
}

void ClusterSearch::grow(const Leaf& leaf, const Entry& entry) {
  const ClusterPoint& point = entry.point;
  for (std::uint32_t parent = leaf.parent, i = leaf.parentChild; parent != kNoChild;) {
    Node& node = tree_.nodes[parent];
    for (int k = 0; k < kDimensions; ++k) {
      node.low[k][i] = std::min(node.low[k][i], point.p[k]);
      node.high[k][i] = std::max(node.high[k][i], point.p[k]);
    }
    node.inverseAreaLow[i] = std::max(node.inverseAreaLow[i], point.inverseArea);
    node.areaHigh[i] = std::max(node.areaHigh[i], point.area);
    node.smallestId[i] = std::min(node.smallestId[i], entry.id);
    node.largestId[i] = std::max(node.largestId[i], entry.id);
    i = node.parentChild;
    parent = node.parent;
  }
}

void ClusterSearch::build(std::vector<Entry>& entries) {
  built_ = living_ = entries.size();
  tree_.nodes.clear();
  tree_.leaves.clear();
  buildNode(tree_, entries, kNoChild, 0, balanceWeight_);
  for (std::size_t i = 0; i < tree_.leaves.size(); ++i) {
    for (std::uint32_t lane = 0; lane < kLeafSize; ++lane) {
      const std::uint32_t id = tree_.leaves[i].id[lane];
      if (id != kNoCluster) slot_[id] = static_cast<std::uint32_t>(i) * kLeafSize + lane;
    }
  }
}

}  // namespace relume
