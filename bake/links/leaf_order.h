// SPDX-License-Identifier: MIT
// The leaves of the hierarchy in depth-first order, so that a subtree is a range of ranks, and the lowest common
// ancestor of any two of them.
#pragma once

#include "relume/hierarchy.h"

#include <cstdint>
#include <vector>

namespace relume {

class LeafOrder {
 public:
  explicit LeafOrder(const Hierarchy& hierarchy);

  std::uint32_t count() const { return static_cast<std::uint32_t>(leaf_.size()); }
  std::uint32_t rank(std::uint32_t leaf) const { return rank_[leaf]; }  // of a leaf's node
  std::uint32_t leaf(std::uint32_t rank) const { return leaf_[rank]; }  // node
  // The lowest node that has both leaves below it. [first < second: ranks]
  std::uint32_t lowestCommonAncestor(std::uint32_t first, std::uint32_t second) const;
  // Ranks after the last leaf of each group (reflectors, emitters, sky), ascending.
  const std::vector<std::uint32_t>& groupEnds() const { return groupEnd_; }

 private:
  std::vector<std::uint32_t> rank_;  // [Size nodes]
  std::vector<std::uint32_t> leaf_;  // [Size leaves]
  // Level 0: the lowest common ancestor of leaves r-1 and r; level i+1: the minimum of each 16 entries of level i. A
  // parent has a smaller index than its children, so the minimum over a range is the lowest common ancestor of its
  // ends.
  std::vector<std::vector<std::uint32_t>> minNode_;
  std::vector<std::uint32_t> groupEnd_;
};

}  // namespace relume
