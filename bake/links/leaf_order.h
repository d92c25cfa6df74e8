// SPDX-License-Identifier: MIT
// The leaves of the hierarchy depth first, so that a subtree is a range of ranks, and where two of them meet.
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
  // The lowest node that holds both leaves. [first < second: ranks]
  std::uint32_t meet(std::uint32_t first, std::uint32_t second) const;
  // Ranks after the last leaf of each group (reflectors, emitters, sky), ascending.
  const std::vector<std::uint32_t>& groupEnds() const { return groupEnd_; }

 private:
  std::vector<std::uint32_t> rank_;  // [Size nodes]
  std::vector<std::uint32_t> leaf_;  // [Size leaves]
  // level 0: the node where leaves r-1 and r meet; level i+1: the least of 16 of level i. A parent comes before its
  // children, so the least node of a range is where its ends meet.
  std::vector<std::vector<std::uint32_t>> least_;
  std::vector<std::uint32_t> groupEnd_;
};

}  // namespace relume
