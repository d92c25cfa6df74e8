// SPDX-License-Identifier: MIT
// The part of the hierarchy that one cache sees, with sums over its rays (PIC 4.5): the leaves that its rays hit, and
// the lowest common ancestors of any two of them. A node with a single visible child is left out, because its sums are
// its child's. Summing over all nodes of the hierarchy for every cache would cost more than its rays; so would a walk
// up from every leaf.
#pragma once

#include "bake/links/gather.h"
#include "bake/links/leaf_order.h"
#include "relume/hierarchy.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kNoSlot = 0xFFFFFFFFu;

// A leaf that some ray of the cache reached, or a node both of whose children hold such leaves. Sums are over the rays
// that end in its leaves.
struct VisibleNode {
  std::uint32_t node = 0;
  std::array<std::uint32_t, 2> child{kNoSlot, kNoSlot};  // slots of what is visible under its first and second child
  std::uint32_t firstLeaf = 0, endLeaf = 0;              // slots of its leaves
  float weight = 0.0f;        // sum w: visible solid angle / pi; times y_0 it is the link's f
  float received = 0.0f;      // share of the light a white furnace would send: surface caches sum w cosine (all nodes
                              // together: 1), grid caches sum w / 4
  glm::vec3 direction{0.0f};  // sum w omega
};

// The visible subtree of one cache at a time; memory is kept from cache to cache. Not thread-safe: use one per thread.
class VisibleSubtree {
 public:
  explicit VisibleSubtree(const LeafOrder& order);

  // Replace the content by these arrivals, summed up to the groups' roots. received scale: see VisibleNode::received.
  void build(std::span<const Arrival> arrivals, float receivedScale);

  // Visible leaves first, depth first; then the others, children before parents.
  std::span<const VisibleNode> nodes() const { return nodes_; }
  std::span<const VisibleNode> leaves() const { return nodes().first(leafCount_); }
  // Slots of the topmost nodes, one for every visible group.
  std::span<const std::uint32_t> roots() const { return roots_; }
  const VisibleNode& operator[](std::uint32_t slot) const { return nodes_[slot]; }
  bool isLeaf(std::uint32_t slot) const { return slot < leafCount_; }
  // [Size arrivals] slot of the leaf that each arrival of build() ends in.
  std::span<const std::uint32_t> slotOfArrival() const { return slotOfArrival_; }

 private:
  void binArrivals(std::span<const Arrival> arrivals, float receivedScale);
  void joinLeaves();
  std::uint32_t join(std::uint32_t node, std::uint32_t first, std::uint32_t second);

  struct Open {
    std::uint32_t node, first;  // a node whose second part is not complete, and the slot of its first
  };

  const LeafOrder& order_;
  std::vector<VisibleNode> nodes_;
  std::vector<std::uint32_t> slotOf_;  // [Size leaves] by rank; valid for the visible ones
  std::vector<std::uint32_t> slotOfArrival_;
  std::vector<std::uint64_t> visibleLeaf_;  // a bit per rank; all zero between builds
  std::vector<std::uint32_t> roots_;
  std::vector<Open> open_;
  std::uint32_t leafCount_ = 0;
};

}  // namespace relume
