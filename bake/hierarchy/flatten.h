// SPDX-License-Identifier: MIT
// Lays a tree of clusters out breadth first, siblings adjacent (include/relume/hierarchy.h).
#pragma once

#include "bake/hierarchy/hierarchy.h"

#include <span>
#include <vector>

namespace relume {

// One group of senders and the tree over them. Leaf i of the tree is sender[i].
struct ClusterGroup {
  ClusterTree tree;
  std::vector<std::uint32_t> sender;
};

// Joins the groups' trees, in their order, under one root: ((g0, g1), g2). firstWeight is the share of the leaves,
// which are all of one size within a group. skyDirection stays empty. [Size groups >= 1, every sender in exactly one]
Hierarchy flatten(std::span<const ClusterGroup> groups);

}  // namespace relume
