// SPDX-License-Identifier: MIT
// See visible_subtree.h. Marking the visible leaves by bits sorts them. The lowest common ancestors of neighbouring
// leaves then form a Cartesian tree, which is built from left to right with a stack.
#include "bake/links/visible_subtree.h"

#include <algorithm>
#include <bit>

namespace relume {

VisibleSubtree::VisibleSubtree(const LeafOrder& order)
    : order_(order), slotOf_(order.count(), 0), visibleLeaf_((order.count() + 63) / 64, 0) {}

void VisibleSubtree::build(std::span<const Arrival> arrivals, float receivedScale) {
  nodes_.clear();
  roots_.clear();
  binArrivals(arrivals, receivedScale);
  joinLeaves();
}

void VisibleSubtree::binArrivals(std::span<const Arrival> arrivals, float receivedScale) {
  std::size_t firstWord = visibleLeaf_.size(), lastWord = 0;
  slotOfArrival_.resize(arrivals.size());
  for (std::size_t i = 0; i < arrivals.size(); ++i) {
    const std::uint32_t rank = order_.rank(arrivals[i].leaf);
    slotOfArrival_[i] = rank;
    const std::size_t word = rank / 64;
    visibleLeaf_[word] |= std::uint64_t{1} << (rank % 64);
    firstWord = std::min(firstWord, word);
    lastWord = std::max(lastWord, word);
  }
  for (std::size_t word = firstWord; word < visibleLeaf_.size() && word <= lastWord; ++word) {
    for (std::uint64_t bits = visibleLeaf_[word]; bits != 0; bits &= bits - 1) {
      const auto rank = static_cast<std::uint32_t>(word * 64 + static_cast<std::size_t>(std::countr_zero(bits)));
      const auto slot = static_cast<std::uint32_t>(nodes_.size());
      slotOf_[rank] = slot;
      VisibleNode& leaf = nodes_.emplace_back();
      leaf.node = order_.leaf(rank);
      leaf.firstLeaf = slot;
      leaf.endLeaf = slot + 1;
    }
    visibleLeaf_[word] = 0;
  }
  leafCount_ = static_cast<std::uint32_t>(nodes_.size());

  for (std::size_t i = 0; i < arrivals.size(); ++i) {
    const Arrival& arrival = arrivals[i];
    std::uint32_t& slot = slotOfArrival_[i];  // so far, the leaf's rank
    slot = slotOf_[slot];
    VisibleNode& leaf = nodes_[slot];
    leaf.weight += arrival.weight;
    leaf.received += arrival.weight * arrival.cosine * receivedScale;
    leaf.direction += arrival.weight * arrival.direction;
  }
}

std::uint32_t VisibleSubtree::join(std::uint32_t node, std::uint32_t first, std::uint32_t second) {
  const VisibleNode &a = nodes_[first], &b = nodes_[second];
  const VisibleNode sum{node,
                        {first, second},
                        a.firstLeaf,
                        b.endLeaf,
                        a.weight + b.weight,
                        a.received + b.received,
                        a.direction + b.direction};
  nodes_.push_back(sum);
  return static_cast<std::uint32_t>(nodes_.size() - 1);
}

void VisibleSubtree::joinLeaves() {
  std::size_t group = 0;
  for (std::uint32_t begin = 0; begin < leafCount_;) {
    // The leaves of one group.
    std::uint32_t rank = order_.rank(nodes_[begin].node);
    while (rank >= order_.groupEnds()[group]) ++group;
    std::uint32_t last = begin, slot = begin + 1;
    for (; slot < leafCount_; ++slot) {
      const std::uint32_t next = order_.rank(nodes_[slot].node);
      if (next >= order_.groupEnds()[group]) break;
      // Close the nodes that end before this leaf, and open the lowest common ancestor of this leaf and the one before.
      const std::uint32_t ancestor = order_.lowestCommonAncestor(rank, next);
      while (!open_.empty() && open_.back().node > ancestor) {
        last = join(open_.back().node, open_.back().first, last);
        open_.pop_back();
      }
      open_.push_back({ancestor, last});
      last = slot;
      rank = next;
    }
    for (; !open_.empty(); open_.pop_back()) last = join(open_.back().node, open_.back().first, last);
    roots_.push_back(last);
    begin = slot;
  }
}

}  // namespace relume
