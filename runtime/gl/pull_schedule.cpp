// SPDX-License-Identifier: MIT
// See pull_schedule.h. Rounds follow a node's height over its deepest leaf, not its depth: a good half of what is left
// is ready each time (docs/GPU.md), so that the first rounds are wide and few are narrow.
#include "runtime/gl/pull_schedule.h"

#include <algorithm>

namespace relume::gl {
namespace {

// Per node: inner nodes from it downward, and the longest way down to a leaf; both 0 at leaves.
struct Shape {
  std::vector<std::uint32_t> inner, height;
};

// A parent comes before its children.
Shape measure(const Hierarchy& hierarchy) {
  const std::uint32_t nodes = hierarchy.nodeCount();
  Shape shape{std::vector<std::uint32_t>(nodes, 0), std::vector<std::uint32_t>(nodes, 0)};
  for (std::uint32_t i = nodes; i-- > 0;) {
    if (hierarchy.isLeaf(i)) continue;
    const std::uint32_t child = hierarchy.child[i];
    shape.inner[i] = 1 + shape.inner[child] + shape.inner[child + 1];
    shape.height[i] = 1 + std::max(shape.height[child], shape.height[child + 1]);
  }
  return shape;
}

// Append the inner nodes from `root` downward.
void collect(const Hierarchy& hierarchy, std::uint32_t root, std::vector<std::uint32_t>& nodes) {
  if (hierarchy.isLeaf(root)) return;
  std::size_t next = nodes.size();
  for (nodes.push_back(root); next < nodes.size(); ++next) {
    for (const std::uint32_t child : {hierarchy.child[nodes[next]], hierarchy.child[nodes[next]] + 1}) {
      if (!hierarchy.isLeaf(child)) nodes.push_back(child);
    }
  }
}

// Close a group: order its nodes by height, a round each.
void addGroup(const Hierarchy& hierarchy, const Shape& shape, std::vector<std::uint32_t>& nodes,
              PullSchedule& schedule) {
  std::sort(nodes.begin(), nodes.end(), [&](std::uint32_t a, std::uint32_t b) {
    return shape.height[a] != shape.height[b] ? shape.height[a] < shape.height[b] : a < b;
  });
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (i > 0 && shape.height[nodes[i]] != shape.height[nodes[i - 1]]) {
      schedule.roundBegin.push_back(static_cast<std::uint32_t>(schedule.node.size()));
    }
    schedule.node.push_back({nodes[i], hierarchy.child[nodes[i]], hierarchy.firstWeight[nodes[i]]});
  }
  schedule.roundBegin.push_back(static_cast<std::uint32_t>(schedule.node.size()));
  schedule.groupBegin.push_back(static_cast<std::uint32_t>(schedule.roundBegin.size() - 1));
  nodes.clear();
}

}  // namespace

PullSchedule makePullSchedule(const Hierarchy& hierarchy, std::uint32_t nodesPerGroup) {
  PullSchedule schedule;
  schedule.roundBegin.push_back(0);
  schedule.groupBegin.push_back(0);
  const Shape shape = measure(hierarchy);

  // Fill groups with the largest subtrees that fit, in depth-first order, so that a group's nodes lie close.
  std::vector<std::uint32_t> group, above, stack;
  if (hierarchy.nodeCount() > 0) stack.push_back(0);
  while (!stack.empty()) {
    const std::uint32_t node = stack.back();
    stack.pop_back();
    if (hierarchy.isLeaf(node)) continue;
    if (shape.inner[node] > nodesPerGroup) {
      above.push_back(node);
      stack.push_back(hierarchy.child[node] + 1);
      stack.push_back(hierarchy.child[node]);
      continue;
    }
    if (!group.empty() && group.size() + shape.inner[node] > nodesPerGroup) addGroup(hierarchy, shape, group, schedule);
    collect(hierarchy, node, group);
  }
  if (!group.empty()) addGroup(hierarchy, shape, group, schedule);
  addGroup(hierarchy, shape, above, schedule);
  return schedule;
}

}  // namespace relume::gl
