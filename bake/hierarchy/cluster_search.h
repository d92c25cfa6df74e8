// SPDX-License-Identifier: MIT
// Nearest cluster under the metric of PIC 4.3 while clusters merge: a bounding hierarchy over the dimensions of
// metric.h and the range of areas, eight children a node, leaves of up to sixteen clusters. A merged cluster takes the
// slot of one of its children; bounds only grow, so they stay bounds; the whole is built anew once a third is dead.
#pragma once

#include <cstdint>
#include <span>
#include <vector>
#include "bake/hierarchy/metric.h"

namespace relume {

inline constexpr std::uint32_t kNoCluster = 0xFFFFFFFFu;

class ClusterSearch {
 public:
  struct Entry {
    ClusterPoint point;
    std::uint32_t id = kNoCluster;
  };
  struct Nearest {
    float distance = 0.0f;
    std::uint32_t id = kNoCluster;  // kNoCluster when there is no other cluster
  };

  // idCount: ids are below it, those of clusters to come included.
  ClusterSearch(std::span<const Entry> clusters, std::uint32_t idCount, float balanceWeight);

  // The nearest other cluster of a living one; among equals the next id, in the circle of all ids, after its own: then
  // heaps of coincident clusters pair off instead of all choosing the same. Thread-safe against itself.
  Nearest nearest(std::uint32_t id) const;

  // Cluster `merged` replaces `a` and `b`.
  void merge(std::uint32_t a, std::uint32_t b, const Entry& merged);

  bool alive(std::uint32_t id) const { return slot_[id] != kDead; }

  // Ask for the memory in which a cluster's next search begins. Changes nothing.
  void prefetch(std::uint32_t id) const {
    if (!alive(id)) return;
    const auto* line = reinterpret_cast<const char*>(&tree_.leaves[slot_[id] / kLeafSize]);
    for (std::size_t at = 0; at < sizeof(Leaf); at += 64) __builtin_prefetch(line + at);
  }

  static constexpr int kWidth = 8;      // children of a node
  static constexpr int kLeafSize = 16;  // clusters of a leaf
  static constexpr std::uint32_t kDead = 0xFFFFFFFFu;
  static constexpr std::uint32_t kLeafChild = 0x80000000u;  // bit of Node::child: a leaf, not a node
  static constexpr std::uint32_t kNoChild = 0xFFFFFFFFu;

  struct alignas(64) Node {
    float low[kClusterDimensions][kWidth], high[kClusterDimensions][kWidth];
    float inverseAreaLow[kWidth], areaHigh[kWidth];
    std::uint32_t smallestId[kWidth], largestId[kWidth];
    std::uint32_t child[kWidth];
    std::uint32_t parent;       // node, kNoChild at the root
    std::uint32_t parentChild;  // which child of it
  };
  struct alignas(64) Leaf {
    float p[kClusterDimensions][kLeafSize];
    float area[kLeafSize], inverseArea[kLeafSize];
    std::uint32_t id[kLeafSize];
    std::uint32_t parent, parentChild;
  };
  struct Tree {
    std::vector<Node> nodes;
    std::vector<Leaf> leaves;
  };

 private:
  void build(std::vector<Entry>& entries);
  void grow(const Leaf& leaf, const Entry& entry);

  Tree tree_;
  std::vector<std::uint32_t> slot_;  // of each id: leaf * kLeafSize + lane, or kDead
  std::size_t built_ = 0;            // clusters at the last build
  std::size_t living_ = 0;
  float balanceWeight_ = 0.0f;
};

}  // namespace relume
