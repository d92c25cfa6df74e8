// SPDX-License-Identifier: MIT
// See touched_tree.h.
#include "bake/links/touched_tree.h"

namespace relume {

TreeShape treeShape(const Hierarchy& hierarchy) {
  TreeShape shape;
  shape.parent.assign(hierarchy.nodeCount(), 0);
  shape.level.assign(hierarchy.nodeCount(), 0);
  shape.levelCount = 1;
  // A parent comes before its children.
  for (std::uint32_t node = 0; node < hierarchy.nodeCount(); ++node) {
    if (hierarchy.isLeaf(node)) continue;
    for (const std::uint32_t child : {hierarchy.child[node], hierarchy.child[node] + 1}) {
      shape.parent[child] = node;
      shape.level[child] = static_cast<std::uint16_t>(shape.level[node] + 1);
      shape.levelCount = shape.level[child] + 1u;
    }
  }
  return shape;
}

TouchedTree::TouchedTree(const Hierarchy& hierarchy, const TreeShape& shape)
    : hierarchy_(hierarchy), shape_(shape), slotOf_(hierarchy.nodeCount(), 0), level_(shape.levelCount) {}

std::uint32_t TouchedTree::find(std::uint32_t node) const {
  const std::uint32_t slot = slotOf_[node];
  return slot < nodes_.size() && nodes_[slot].node == node ? slot : kNoSlot;
}

std::uint32_t TouchedTree::touch(std::uint32_t node) {
  if (const std::uint32_t slot = find(node); slot != kNoSlot) return slot;
  const auto slot = static_cast<std::uint32_t>(nodes_.size());
  slotOf_[node] = slot;
  nodes_.push_back({});
  nodes_.back().node = node;
  level_[shape_.level[node]].push_back(slot);
  return slot;
}

void TouchedTree::build(std::span<const Arrival> arrivals, float receivedScale) {
  nodes_.clear();
  for (auto& level : level_) level.clear();

  // Bin the rays to leaves. Neighbouring rays often end in the same one.
  std::uint32_t slot = 0;
  for (const Arrival& arrival : arrivals) {
    if (nodes_.empty() || nodes_[slot].node != arrival.leaf) slot = touch(arrival.leaf);
    TouchedNode& leaf = nodes_[slot];
    leaf.rays += 1;
    leaf.weight += arrival.weight;
    leaf.received += arrival.weight * arrival.cosine * receivedScale;
    leaf.direction += arrival.weight * arrival.direction;
  }
  leafCount_ = static_cast<std::uint32_t>(nodes_.size());

  // Sum up, deepest level first. A parent has at most two summands: their order does not change the sum.
  for (std::size_t depth = level_.size() - 1; depth > 0; --depth) {
    for (const std::uint32_t child : level_[depth]) {
      const std::uint32_t parent = touch(shape_.parent[nodes_[child].node]);
      const TouchedNode& from = nodes_[child];
      TouchedNode& to = nodes_[parent];
      to.child[from.node - hierarchy_.child[to.node]] = child;
      to.rays += from.rays;
      to.weight += from.weight;
      to.received += from.received;
      to.direction += from.direction;
    }
  }
}

}  // namespace relume
