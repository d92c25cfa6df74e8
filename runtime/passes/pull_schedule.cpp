// SPDX-License-Identifier: MIT
// See pull_schedule.h. What is above the groups' subtrees goes in rounds by the nodes' height over them, not by depth:
// a good half of what is left is ready each time (docs/notes/gpu.md).
#include "runtime/passes/pull_schedule.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace relume::gpu {
namespace {

// Per node: inner nodes from it downward; the longest way down to a leaf; inner nodes before it.
struct Shape {
  std::pmr::vector<std::uint32_t> inner, height, number;
};

// A parent comes before its children.
Shape measure(const Hierarchy& hierarchy, std::pmr::memory_resource* memory) {
  const std::uint32_t nodes = hierarchy.nodeCount();
  Shape shape{std::pmr::vector<std::uint32_t>(nodes, 0, memory), std::pmr::vector<std::uint32_t>(nodes, 0, memory),
              std::pmr::vector<std::uint32_t>(nodes, 0, memory)};
  for (std::uint32_t i = nodes; i-- > 0;) {
    if (hierarchy.isLeaf(i)) continue;
    const std::uint32_t child = hierarchy.child[i];
    shape.inner[i] = 1 + shape.inner[child] + shape.inner[child + 1];
    shape.height[i] = 1 + std::max(shape.height[child], shape.height[child + 1]);
  }
  for (std::uint32_t i = 0, inner = 0; i < nodes; inner += !hierarchy.isLeaf(i++)) shape.number[i] = inner;
  return shape;
}

// Close a group: its nodes, ascending, are a run in each level.
void addGroup(const Hierarchy& hierarchy, const Shape& shape, std::pmr::vector<std::uint32_t>& nodes,
              PullSchedule& schedule) {
  std::sort(nodes.begin(), nodes.end());
  const std::size_t first = schedule.run.size();
  std::size_t level = 0;
  for (const std::uint32_t node : nodes) {
    const bool deeper = schedule.run.size() == first || node >= hierarchy.levelBegin[level + 1];
    if (deeper) {
      while (node >= hierarchy.levelBegin[level + 1]) ++level;
      schedule.run.push_back({shape.number[node], 0, node});
    }
    PullSchedule::Run& run = schedule.run.back();
    schedule.word[run.firstInner + run.count++] |= (node - run.firstNode) << 16;
  }
  std::reverse(schedule.run.begin() + static_cast<std::ptrdiff_t>(first), schedule.run.end());
  schedule.groupBegin.push_back(static_cast<std::uint32_t>(schedule.run.size()));
  nodes.clear();
}

void addTop(const Shape& shape, std::span<std::uint32_t> nodes, PullSchedule& schedule) {
  std::sort(nodes.begin(), nodes.end(), [&](std::uint32_t a, std::uint32_t b) {
    return shape.height[a] != shape.height[b] ? shape.height[a] < shape.height[b] : a < b;
  });
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (i == 0 || shape.height[nodes[i]] != shape.height[nodes[i - 1]])
      schedule.roundBegin.push_back(static_cast<std::uint32_t>(schedule.run.size()));
    schedule.run.push_back({shape.number[nodes[i]], 1, nodes[i]});
  }
  schedule.roundBegin.push_back(static_cast<std::uint32_t>(schedule.run.size()));
}

}  // namespace

PullSchedule makePullSchedule(const Hierarchy& hierarchy, std::uint32_t nodesPerGroup,
                              std::pmr::memory_resource* memory) {
  PullSchedule schedule(memory);
  schedule.groupBegin.push_back(0);
  const Shape shape = measure(hierarchy, memory);
  for (std::uint32_t node = 0; node < hierarchy.nodeCount(); ++node) {
    if (hierarchy.isLeaf(node)) continue;
    const float weight = hierarchy.firstWeight[node] * float{gl::kRelumePullWeightOne};
    schedule.word.push_back(static_cast<std::uint32_t>(std::lrint(weight)));
  }

  // Fill groups with the largest subtrees that fit, depth first. A node that is above them ends a group, since it lies
  // between the runs of what is before it and of what comes after it.
  std::pmr::vector<std::uint32_t> group(memory), above(memory), stack(memory);
  if (hierarchy.nodeCount() > 0) stack.push_back(0);
  while (!stack.empty()) {
    const std::uint32_t node = stack.back();
    stack.pop_back();
    if (hierarchy.isLeaf(node)) continue;
    const bool isAbove = shape.inner[node] > nodesPerGroup;
    if (!group.empty() && (isAbove || group.size() + shape.inner[node] > nodesPerGroup))
      addGroup(hierarchy, shape, group, schedule);
    if (isAbove) {
      above.push_back(node);
      stack.push_back(hierarchy.child[node] + 1);
      stack.push_back(hierarchy.child[node]);
      continue;
    }
    std::size_t next = group.size();
    for (group.push_back(node); next < group.size(); ++next) {
      for (const std::uint32_t child : {hierarchy.child[group[next]], hierarchy.child[group[next]] + 1}) {
        if (!hierarchy.isLeaf(child)) group.push_back(child);
      }
    }
  }
  if (!group.empty()) addGroup(hierarchy, shape, group, schedule);
  addTop(shape, above, schedule);
  return schedule;
}

}  // namespace relume::gpu
