// SPDX-License-Identifier: MIT
// What one cache sees, summed up the hierarchy (PIC 4.5): the leaves its rays hit and their ancestors, and nothing
// else. A dense sum over all nodes for every cache would cost more than the rays.
#pragma once

#include "bake/links/gather.h"
#include "formats/hierarchy.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kNoSlot = 0xFFFFFFFFu;

// What the hierarchy does not store: the way up.
struct TreeShape {
  std::vector<std::uint32_t> parent;  // [Size nodes] the root's is 0
  std::vector<std::uint16_t> level;   // [Size nodes]
  std::uint32_t levelCount = 0;
};

TreeShape treeShape(const Hierarchy& hierarchy);

// A node that some ray of the cache reached. Sums are over the rays that end in its leaves.
struct TouchedNode {
  std::uint32_t node = 0;
  std::array<std::uint32_t, 2> child{kNoSlot, kNoSlot};  // slots of the touched children
  std::uint32_t rays = 0;
  float weight = 0.0f;        // sum w: visible solid angle / pi; times y_0 it is the link's f
  float received = 0.0f;      // share of the light a white furnace would send: surface caches sum w cosine (all nodes
                              // together: 1), grid caches sum w / 4
  glm::vec3 direction{0.0f};  // sum w omega
};

// The touched part of the tree, for one cache at a time; memory is kept. Not thread-safe: one a thread.
class TouchedTree {
 public:
  TouchedTree(const Hierarchy& hierarchy, const TreeShape& shape);

  // Replace the content by these arrivals, summed up to the root. received scale: see TouchedNode::received.
  void build(std::span<const Arrival> arrivals, float receivedScale);

  std::span<const TouchedNode> nodes() const {
    return nodes_;
  }  // touched leaves first,
     // children before parents
  std::span<const TouchedNode> leaves() const { return nodes().first(leafCount_); }
  const TouchedNode& operator[](std::uint32_t slot) const { return nodes_[slot]; }
  // Slot of a node, kNoSlot when no ray reached it.
  std::uint32_t find(std::uint32_t node) const;
  bool isLeaf(std::uint32_t slot) const { return slot < leafCount_; }

 private:
  std::uint32_t touch(std::uint32_t node);

  const Hierarchy& hierarchy_;
  const TreeShape& shape_;
  std::vector<TouchedNode> nodes_;
  std::vector<std::uint32_t> slotOf_;              // [Size nodes] valid where nodes_[slotOf_[n]].node == n
  std::vector<std::vector<std::uint32_t>> level_;  // [Size levels] slots of the touched nodes of a level
  std::uint32_t leafCount_ = 0;
};

}  // namespace relume
