// SPDX-License-Identifier: MIT
// See select_cut.h. Keys: PIC's is the transfer f. The default is the irradiance a node could send, sum of w cosine,
// times its extent: light differs the more across a node the wider it is.
#include "bake/links/select_cut.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

// Root mean square distance of a sky node's directions from their mean, times `scale`. Leaves have one patch's own.
void setSkyExtents(const Hierarchy& hierarchy, std::uint32_t surfelCount, float scale, std::vector<float>& extent) {
  std::vector<glm::vec3> sum(hierarchy.nodeCount(), glm::vec3(0.0f));
  std::vector<std::uint32_t> count(hierarchy.nodeCount(), 0);
  const float patchRadius = 1.0f / std::sqrt(static_cast<float>(hierarchy.skyDirection.size()));
  for (std::uint32_t node = hierarchy.nodeCount(); node-- > 0;) {
    if (hierarchy.isLeaf(node)) {
      if (hierarchy.sender(node) < surfelCount) continue;
      sum[node] = hierarchy.skyDirection[hierarchy.sender(node) - surfelCount];
      count[node] = 1;
    } else {
      const std::uint32_t first = hierarchy.child[node];
      if (count[first] == 0 || count[first + 1] == 0) continue;
      sum[node] = sum[first] + sum[first + 1];
      count[node] = count[first] + count[first + 1];
    }
    const float mean = glm::length(sum[node]) / static_cast<float>(count[node]);
    extent[node] = scale * std::sqrt(std::max(1.0f - mean * mean, patchRadius * patchRadius));
  }
}

}  // namespace

std::vector<float> nodeExtents(const Hierarchy& hierarchy, const NodeGeometry& geometry, LinkOptions::CutKey key,
                               std::span<const glm::vec3> emission) {
  if (key == LinkOptions::CutKey::transfer) return std::vector<float>(hierarchy.nodeCount(), 1.0f);
  std::vector<float> extent = geometry.radius;
  const auto surfelCount = static_cast<std::uint32_t>(emission.size());
  if (!hierarchy.skyDirection.empty()) {
    // The level's radius: that of the largest group which is not the sky.
    float level = 0.0f;
    for (const std::uint32_t root : hierarchy.groupRoot) {
      if (std::isfinite(geometry.radius[root]) && geometry.area[root] > 0.0f) level = std::max(level, geometry.radius[root]);
    }
    setSkyExtents(hierarchy, surfelCount, level > 0.0f ? level : 1.0f, extent);
  }
  // No cluster mixes emitters and reflectors: a node emits when its leaves do.
  std::vector<std::uint8_t> emits(hierarchy.nodeCount(), 0);
  for (std::uint32_t node = hierarchy.nodeCount(); node-- > 0;) {
    if (hierarchy.isLeaf(node)) {
      const std::uint32_t sender = hierarchy.sender(node);
      emits[node] = sender < surfelCount && glm::dot(emission[sender], glm::vec3(1.0f)) > 0.0f;
    } else {
      emits[node] = emits[hierarchy.child[node]] & emits[hierarchy.child[node] + 1];
    }
    if (emits[node]) extent[node] *= kEmitterWeight;
  }
  return extent;
}

void selectCut(const TouchedTree& tree, const Hierarchy& hierarchy, std::span<const float> extent,
               LinkOptions::CutKey key, std::uint32_t maxNodes, std::vector<CutCandidate>& queue,
               std::vector<std::uint32_t>& cut) {
  // Largest key on top; equal keys by node.
  const auto below = [&](const CutCandidate& a, const CutCandidate& b) {
    return a.key != b.key ? a.key < b.key : tree[a.slot].node > tree[b.slot].node;
  };
  queue.clear();
  cut.clear();
  const auto add = [&](std::uint32_t slot) {
    // Skip nodes of which only one child is seen.
    while (!tree.isLeaf(slot) && (tree[slot].child[0] == kNoSlot || tree[slot].child[1] == kNoSlot)) {
      slot = std::min(tree[slot].child[0], tree[slot].child[1]);
    }
    if (tree.isLeaf(slot)) {
      cut.push_back(slot);
      return;
    }
    const TouchedNode& node = tree[slot];
    const float share = key == LinkOptions::CutKey::transfer ? node.weight : node.received * extent[node.node];
    queue.push_back({share, slot});
    std::push_heap(queue.begin(), queue.end(), below);
  };

  for (const std::uint32_t root : hierarchy.groupRoot) {
    if (const std::uint32_t slot = tree.find(root); slot != kNoSlot) add(slot);
  }
  while (!queue.empty() && queue.size() + cut.size() < maxNodes) {
    std::pop_heap(queue.begin(), queue.end(), below);
    const TouchedNode& node = tree[queue.back().slot];
    queue.pop_back();
    add(node.child[0]);
    add(node.child[1]);
  }

  for (const CutCandidate& candidate : queue) cut.push_back(candidate.slot);
  std::sort(cut.begin(), cut.end(), [&](std::uint32_t a, std::uint32_t b) { return tree[a].node < tree[b].node; });
}

}  // namespace relume
