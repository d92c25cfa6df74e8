// SPDX-License-Identifier: MIT
// See leaf_order.h. The range minimum uses a tree with 16 children per node: at most 30 values per level are read.
#include "bake/links/leaf_order.h"

#include <algorithm>

namespace relume {
namespace {

constexpr std::uint32_t kBranching = 16;

}  // namespace

LeafOrder::LeafOrder(const Hierarchy& hierarchy)
    : rank_(hierarchy.nodeCount(), 0), leaf_(hierarchy.senderCount(), 0), minNode_(1) {
  if (hierarchy.nodeCount() == 0) return;
  std::vector<std::uint32_t> leaves(hierarchy.nodeCount(), 1);
  for (std::uint32_t node = hierarchy.nodeCount(); node-- > 0;) {
    if (!hierarchy.isLeaf(node)) leaves[node] = leaves[hierarchy.child[node]] + leaves[hierarchy.child[node] + 1];
  }
  // rank_ of an inner node: that of its first leaf.
  minNode_[0].assign(leaf_.size(), 0);
  for (std::uint32_t node = 0; node < hierarchy.nodeCount(); ++node) {
    if (hierarchy.isLeaf(node)) {
      leaf_[rank_[node]] = node;
      continue;
    }
    const std::uint32_t first = hierarchy.child[node];
    rank_[first] = rank_[node];
    rank_[first + 1] = rank_[node] + leaves[first];
    minNode_[0][rank_[first + 1]] = node;
  }
  for (const std::uint32_t root : hierarchy.groupRoot) groupEnd_.push_back(rank_[root] + leaves[root]);
  std::sort(groupEnd_.begin(), groupEnd_.end());

  while (minNode_.back().size() > kBranching) {
    const std::vector<std::uint32_t>& below = minNode_.back();
    std::vector<std::uint32_t> above((below.size() + kBranching - 1) / kBranching);
    for (std::size_t i = 0; i < above.size(); ++i) {
      const auto begin = below.begin() + static_cast<std::ptrdiff_t>(i * kBranching);
      above[i] = *std::min_element(
          begin, begin + static_cast<std::ptrdiff_t>(std::min<std::size_t>(kBranching, below.size() - i * kBranching)));
    }
    minNode_.push_back(std::move(above));
  }
}

std::uint32_t LeafOrder::lowestCommonAncestor(std::uint32_t first, std::uint32_t second) const {
  std::uint32_t begin = first + 1, end = second + 1, found = 0xFFFFFFFFu;
  for (std::size_t level = 0; begin < end; ++level) {
    const std::uint32_t* lowest = minNode_[level].data();
    if (level + 1 == minNode_.size() || end - begin <= 2 * kBranching) {
      for (; begin < end; ++begin) found = std::min(found, lowest[begin]);
      break;
    }
    for (; begin % kBranching != 0; ++begin) found = std::min(found, lowest[begin]);
    for (; end % kBranching != 0; --end) found = std::min(found, lowest[end - 1]);
    begin /= kBranching;
    end /= kBranching;
  }
  return found;
}

}  // namespace relume
