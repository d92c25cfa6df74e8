// SPDX-License-Identifier: MIT
// The binary tree over the senders (PIC 4.3): leaves are surfels, then sky patches; inner nodes are clusters.
//
// Layout: breadth first, root at 0, the two children of a node adjacent, a parent always before its children. The
// nodes of one depth are one contiguous range (levelBegin), so pull is one pass a level, deepest first:
//   radiosity[i] = firstWeight[i] * radiosity[child[i]] + (1 - firstWeight[i]) * radiosity[child[i] + 1].
//
// Deviation from PIC 4.1: nodes hold radiosity [W/m²], not flux. With firstWeight = A_first / (A_first + A_second) it
// is the same number as the paper's flux over area; other weights (the light-independent importance of a child for the
// caches that will read the cluster) keep the energy that equal areas lose to hidden leaves.
//
// Senders come in groups that no cluster mixes: reflecting surfaces, emitters, sky. A group is a subtree; the nodes
// that merely join groups lie above every cut.
#pragma once

#include "relume/array.h"
#include "relume/vectors.h"

#include <cstdint>

namespace relume {

// Bit of Hierarchy::child that marks a leaf; the other bits are the index of the sender.
inline constexpr std::uint32_t kLeafBit = 0x80000000u;

struct Hierarchy {
  Array<std::uint32_t> child;  // [Size 2n-1] first child, or kLeafBit | sender; n = n_S + skyDirection.size()
                               // sender < n_S: that surfel; else sky patch (sender - n_S)
  Array<float> firstWeight;    // [Size 2n-1] [0..1] share of the first child in the parent's radiosity; 0 at leaves
  Array<std::uint32_t> levelBegin;  // [Size depth+1] level d is nodes levelBegin[d] .. levelBegin[d+1]-1
  Array<std::uint32_t> leafNode;    // [Size n] node of each sender
  Array<std::uint32_t> groupRoot;   // [Size 1..3] roots of the groups, ascending; every cut starts from these
  Array<glm::vec3> skyDirection;    // unit centres of equal solid angles 4 pi / size; empty when no cache sees the sky

  std::uint32_t nodeCount() const { return static_cast<std::uint32_t>(child.size()); }
  std::uint32_t senderCount() const { return static_cast<std::uint32_t>(leafNode.size()); }
  std::uint32_t levelCount() const {
    return levelBegin.empty() ? 0u : static_cast<std::uint32_t>(levelBegin.size() - 1);
  }
  bool isLeaf(std::uint32_t node) const { return (child[node] & kLeafBit) != 0; }
  std::uint32_t sender(std::uint32_t leaf) const { return child[leaf] & ~kLeafBit; }
};

}  // namespace relume
