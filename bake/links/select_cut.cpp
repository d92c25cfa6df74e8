// SPDX-License-Identifier: MIT
// See select_cut.h.
#include "bake/links/select_cut.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

using CutKey = LinkOptions::CutKey;

// Centre and radius of every node, the sky put on a sphere of the level's radius.
struct Shape {
  std::vector<glm::vec3> center;  // [m]
  std::vector<float> radius;      // [m]
};

Shape shapeWithSky(const Hierarchy& hierarchy, const NodeGeometry& geometry, std::uint32_t surfelCount) {
  Shape shape{geometry.center, geometry.radius};
  if (hierarchy.skyDirection.empty()) return shape;
  float level = 0.0f;
  for (const std::uint32_t root : hierarchy.groupRoot) {
    if (std::isfinite(geometry.radius[root]) && geometry.area[root] > 0.0f)
      level = std::max(level, geometry.radius[root]);
  }
  if (!(level > 0.0f)) level = 1.0f;

  const float patchRadius = 1.0f / std::sqrt(static_cast<float>(hierarchy.skyDirection.size()));
  std::vector<std::uint32_t> patches(hierarchy.nodeCount(), 0);
  for (std::uint32_t node = hierarchy.nodeCount(); node-- > 0;) {
    glm::vec3 mean(0.0f);
    if (hierarchy.isLeaf(node)) {
      if (hierarchy.sender(node) < surfelCount) continue;
      mean = hierarchy.skyDirection[hierarchy.sender(node) - surfelCount];
      patches[node] = 1;
    } else {
      const std::uint32_t a = hierarchy.child[node], b = a + 1;
      if (patches[a] == 0 || patches[b] == 0) continue;
      patches[node] = patches[a] + patches[b];
      mean = (shape.center[a] * static_cast<float>(patches[a]) + shape.center[b] * static_cast<float>(patches[b])) /
             (level * static_cast<float>(patches[node]));
    }
    shape.center[node] = mean * level;
    // Unit vectors lie sqrt(1 - |mean|²) from their mean, root mean square.
    shape.radius[node] = level * std::sqrt(std::max(1.0f - glm::dot(mean, mean), patchRadius * patchRadius));
  }
  return shape;
}

// No cluster mixes emitters and reflectors: a node emits when its leaves do.
std::vector<std::uint8_t> emittingNodes(const Hierarchy& hierarchy, std::span<const glm::vec3> emission) {
  std::vector<std::uint8_t> emits(hierarchy.nodeCount(), 0);
  for (std::uint32_t node = hierarchy.nodeCount(); node-- > 0;) {
    if (hierarchy.isLeaf(node)) {
      const std::uint32_t sender = hierarchy.sender(node);
      emits[node] = sender < emission.size() && glm::dot(emission[sender], glm::vec3(1.0f)) > 0.0f;
    } else {
      emits[node] = emits[hierarchy.child[node]] & emits[hierarchy.child[node] + 1];
    }
  }
  return emits;
}

// |C_a - w C_s|² of readError; a is the first child, nullptr when no ray reached it.
float readMismatch(const TouchedNode* a, const TouchedNode& s, float w) {
  constexpr float kOtherNormals = 0.3f;  // weight of bands 0 and 1 beside the irradiance
  constexpr float kBand0 = 1.0f / 12.566371f, kBand1 = 3.0f / 12.566371f;  // squares of y_0 and of y_1's constant
  const float received = (a ? a->received : 0.0f) - w * s.received;
  const float weight = (a ? a->weight : 0.0f) - w * s.weight;
  const glm::vec3 direction = (a ? a->direction : glm::vec3(0.0f)) - w * s.direction;
  return received * received + kOtherNormals * (kBand0 * weight * weight + kBand1 * glm::dot(direction, direction));
}

}  // namespace

std::vector<CutNode> cutNodes(const Hierarchy& hierarchy, const NodeGeometry& geometry, CutKey key,
                              std::span<const glm::vec3> emission) {
  std::vector<CutNode> nodes(hierarchy.nodeCount());
  if (key == CutKey::transfer) return nodes;
  const Shape shape = shapeWithSky(hierarchy, geometry, static_cast<std::uint32_t>(emission.size()));
  const std::vector<std::uint8_t> emits = emittingNodes(hierarchy, emission);
  const float surfelWidth = emission.empty() ? 0.0f : std::sqrt(geometry.area[hierarchy.leafNode[0]]);
  for (std::uint32_t node = 0; node < nodes.size(); ++node) {
    nodes[node].firstWeight = hierarchy.firstWeight[node];
    nodes[node].extent = shape.radius[node];
    if (key == CutKey::readError && !hierarchy.isLeaf(node)) {
      const std::uint32_t a = hierarchy.child[node], b = a + 1;
      nodes[node].extent = glm::length(shape.center[a] - shape.center[b]) + surfelWidth;
    }
    // transferRadius is linear in light, readError quadratic.
    if (emits[node]) nodes[node].extent *= key == CutKey::readError ? kEmitterWeight * kEmitterWeight : kEmitterWeight;
  }
  return nodes;
}

void cutKeys(const TouchedTree& tree, std::span<const CutNode> cutNode, CutKey key, std::vector<float>& keys) {
  const std::span<const TouchedNode> nodes = tree.nodes();
  keys.assign(nodes.size(), 0.0f);
  // Children come before their parents.
  for (std::size_t slot = tree.leaves().size(); slot < nodes.size(); ++slot) {
    const TouchedNode& s = nodes[slot];
    const CutNode& c = cutNode[s.node];
    switch (key) {
      case CutKey::transfer:
        keys[slot] = s.weight;
        break;
      case CutKey::transferRadius:
        keys[slot] = s.received * c.extent;
        break;
      case CutKey::readError:
        keys[slot] = readMismatch(s.child[0] == kNoSlot ? nullptr : &nodes[s.child[0]], s, c.firstWeight) * c.extent;
        for (const std::uint32_t child : s.child) {
          if (child != kNoSlot) keys[slot] += keys[child];
        }
        break;
    }
  }
}

void selectCut(const TouchedTree& tree, const Hierarchy& hierarchy, std::span<const float> keys, std::uint32_t maxNodes,
               std::vector<CutCandidate>& queue, std::vector<std::uint32_t>& cut) {
  // Largest key on top; equal keys by node.
  const auto below = [&](const CutCandidate& a, const CutCandidate& b) {
    return a.key != b.key ? a.key < b.key : tree[a.slot].node > tree[b.slot].node;
  };
  queue.clear();
  cut.clear();
  const auto add = [&](std::uint32_t slot) {
    // Skip nodes of which only one child is seen: its average holds less that is hidden.
    while (!tree.isLeaf(slot) && (tree[slot].child[0] == kNoSlot || tree[slot].child[1] == kNoSlot)) {
      slot = std::min(tree[slot].child[0], tree[slot].child[1]);
    }
    if (tree.isLeaf(slot)) {
      cut.push_back(slot);
      return;
    }
    queue.push_back({keys[slot], slot});
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
