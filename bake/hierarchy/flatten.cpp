// SPDX-License-Identifier: MIT
// Lays the tree out breadth first, so that the runtime's pull (PIC Fig. 2, step 3) is one pass per level over
// contiguous memory, and knows each node's geometry.
#include "bake/hierarchy/flatten.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume {
namespace {

// A node of the forest: of group `group`'s tree, or the join of groups 0 .. group when `join`.
struct Source {
  std::uint32_t group = 0;
  std::uint32_t node = 0;
  bool join = false;
};

// Leaves under every node of a tree.
std::vector<std::uint32_t> countLeaves(const ClusterTree& tree) {
  std::vector<std::uint32_t> leaves(tree.leafCount + tree.first.size(), 1);
  for (std::size_t k = 0; k < tree.first.size(); ++k) {
    leaves[tree.leafCount + k] = leaves[tree.first[k]] + leaves[tree.second[k]];
  }
  return leaves;
}

std::uint32_t rootOf(const ClusterTree& tree) {
  return tree.leafCount + static_cast<std::uint32_t>(tree.first.size()) - 1;
}

}  // namespace

Hierarchy flatten(std::span<const ClusterGroup> groups) {
  std::vector<std::vector<std::uint32_t>> leaves;
  std::uint32_t leafCount = 0;
  for (const ClusterGroup& group : groups) {
    leaves.push_back(countLeaves(group.tree));
    leafCount += group.tree.leafCount;
  }
  const auto rootSource = [&](std::uint32_t group) { return Source{group, rootOf(groups[group].tree), false}; };
  const auto joinSource = [&](std::uint32_t group) { return group == 0 ? rootSource(0) : Source{group, 0, true}; };
  const auto leavesOf = [&](const Source& source) {
    if (!source.join) return leaves[source.group][source.node];
    std::uint32_t sum = 0;
    for (std::uint32_t g = 0; g <= source.group; ++g) sum += groups[g].tree.leafCount;
    return sum;
  };

  // Go through the nodes in the order of the output; children are appended as their parents come up.
  const std::size_t nodeCount = 2 * std::size_t{leafCount} - 1;
  std::vector<Source> order;
  std::vector<std::uint32_t> child(nodeCount), leafNode(leafCount), levelBegin, groupRoot;
  std::vector<float> firstWeight(nodeCount, 0.0f);
  order.reserve(nodeCount);
  order.push_back(joinSource(static_cast<std::uint32_t>(groups.size()) - 1));
  for (std::size_t i = 0, levelEnd = 0; i < order.size(); ++i) {
    if (i == levelEnd) {
      levelBegin.push_back(static_cast<std::uint32_t>(i));
      levelEnd = order.size();
    }
    const Source source = order[i];
    const auto node = static_cast<std::uint32_t>(i);
    const ClusterGroup& group = groups[source.group];
    if (!source.join && source.node == rootOf(group.tree)) groupRoot.push_back(node);
    if (!source.join && source.node < group.tree.leafCount) {
      child[i] = kLeafBit | group.sender[source.node];
      leafNode[group.sender[source.node]] = node;
      continue;
    }
    const std::uint32_t merge = source.join ? 0 : source.node - group.tree.leafCount;
    const Source first =
        source.join ? joinSource(source.group - 1) : Source{source.group, group.tree.first[merge], false};
    const Source second =
        source.join ? rootSource(source.group) : Source{source.group, group.tree.second[merge], false};
    child[i] = static_cast<std::uint32_t>(order.size());
    firstWeight[i] = static_cast<float>(static_cast<double>(leavesOf(first)) / leavesOf(source));
    order.push_back(first);
    order.push_back(second);
  }
  levelBegin.push_back(static_cast<std::uint32_t>(nodeCount));

  Hierarchy hierarchy;
  hierarchy.child = std::move(child);
  hierarchy.firstWeight = std::move(firstWeight);
  hierarchy.levelBegin = std::move(levelBegin);
  hierarchy.leafNode = std::move(leafNode);
  hierarchy.groupRoot = std::move(groupRoot);
  return hierarchy;
}

NodeGeometry nodeGeometry(const Hierarchy& hierarchy, const Surfels& surfels) {
  const std::uint32_t nodes = hierarchy.nodeCount();
  NodeGeometry geometry;
  geometry.center.resize(nodes);
  geometry.normal.resize(nodes);
  geometry.area.resize(nodes);
  geometry.radius.resize(nodes);

  // Sum upwards, children before parents: second moments about the center by Chan's update, which does not cancel.
  struct Sum {
    glm::dvec3 center{0.0}, normal{0.0};
    double leaves = 1.0, moment = 0.0;
    bool sky = false, surface = false;
  };
  std::vector<Sum> sums(nodes);
  for (std::uint32_t node = nodes; node-- > 0;) {
    Sum& sum = sums[node];
    if (hierarchy.isLeaf(node)) {
      const std::uint32_t sender = hierarchy.sender(node);
      sum.sky = sender >= surfels.count();
      sum.surface = !sum.sky;
      sum.center = sum.sky ? hierarchy.skyDirection[sender - surfels.count()] : surfels.positionWorld[sender];
      if (sum.surface) sum.normal = surfels.normal[sender];
      geometry.area[node] = sum.sky ? 0.0f : surfels.areaEach;
    } else {
      const std::uint32_t first = hierarchy.child[node];
      const Sum &a = sums[first], &b = sums[first + 1];
      sum.leaves = a.leaves + b.leaves;
      const glm::dvec3 apart = b.center - a.center;
      sum.center = a.center + (b.leaves / sum.leaves) * apart;
      sum.normal = a.normal + b.normal;
      sum.moment = a.moment + b.moment + a.leaves * b.leaves / sum.leaves * glm::dot(apart, apart);
      sum.sky = a.sky || b.sky;
      sum.surface = a.surface || b.surface;
      geometry.area[node] = geometry.area[first] + geometry.area[first + 1];
    }
    const double length = glm::length(sum.normal);
    geometry.center[node] = sum.center;
    geometry.normal[node] = length > 1e-9 * sum.leaves ? glm::vec3(sum.normal / length) : glm::vec3(0.0f);
    geometry.radius[node] = sum.sky && sum.surface ? std::numeric_limits<float>::infinity()
                                                   : static_cast<float>(std::sqrt(sum.moment / sum.leaves));
  }
  return geometry;
}

}  // namespace relume
