// SPDX-License-Identifier: MIT
// See select_cut.h.
#include "bake/links/select_cut.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace relume {
namespace {

using CutKey = LinkOptions::CutKey;

// Centre of every node [m]. The sky is placed on a sphere of the level's radius.
std::vector<glm::vec3> centersWithSky(const Hierarchy& hierarchy, const NodeGeometry& geometry,
                                      std::uint32_t surfelCount) {
  std::vector<glm::vec3> center = geometry.center;
  if (hierarchy.skyDirection.empty()) return center;
  const float level = levelRadius(hierarchy, geometry);

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
      mean = (center[a] * static_cast<float>(patches[a]) + center[b] * static_cast<float>(patches[b])) /
             (level * static_cast<float>(patches[node]));
    }
    center[node] = mean * level;
  }
  return center;
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

// |C|² of readError.
float square(float received, float weight, const glm::vec3& direction) {
  constexpr float kOtherNormals = 0.3f;  // weight of bands 0 and 1, added to the irradiance
  constexpr float kBand0 = 1.0f / 12.566371f, kBand1 = 3.0f / 12.566371f;  // squares of y_0 and of y_1's constant
  return received * received + kOtherNormals * (kBand0 * weight * weight + kBand1 * glm::dot(direction, direction));
}

// What a node that is seen through its first (0) or second (1) child only adds to CutNode::hidden.
double hiddenUnder(const CutNode& node, std::uint32_t child) {
  const double unseen = child == 0 ? 1.0 - double{node.firstWeight} : double{node.firstWeight};
  return unseen * unseen * double{node.extent};
}

// |C|² of all that a visible node sends.
float square(const VisibleNode& node) { return square(node.received, node.weight, node.direction); }

// Expected square error of reading node s as an average, from that of its two visible parts.
float averageError(const VisibleSubtree& tree, const VisibleNode& s, std::span<const CutNode> cutNode,
                   std::span<const float> averages) {
  const CutNode& average = cutNode[s.node];
  const VisibleNode& a = tree[s.child[0]];
  const float w = average.firstWeight;
  float error =
      square(a.received - w * s.received, a.weight - w * s.weight, a.direction - w * s.direction) * average.extent;
  for (const std::uint32_t k : {0u, 1u}) {
    const VisibleNode& part = tree[s.child[k]];
    // The nodes between s and the part are seen through one child only.
    const double between = cutNode[part.node].hidden - (average.hidden + hiddenUnder(average, k));
    error += averages[s.child[k]] + square(part) * static_cast<float>(between);
  }
  return error;
}

// Expected square error of giving all of s to one of its two parts.
float pickError(const VisibleSubtree& tree, const VisibleNode& s, std::uint32_t k, float extent,
                std::span<const float> keys) {
  constexpr float kMaxScale =
      4.0f;  // largest factor on a part's light: with more, a single surfel would show as a spot
  const VisibleNode &part = tree[s.child[k]], &other = tree[s.child[1 - k]];
  const float all = square(s), own = square(part);
  if (all > kMaxScale * kMaxScale * own) return std::numeric_limits<float>::infinity();
  return square(other) * extent + all / own * keys[s.child[k]];
}

}  // namespace

float levelRadius(const Hierarchy& hierarchy, const NodeGeometry& geometry) {
  float level = 0.0f;
  for (const std::uint32_t root : hierarchy.groupRoot) {
    if (std::isfinite(geometry.radius[root]) && geometry.area[root] > 0.0f)
      level = std::max(level, geometry.radius[root]);
  }
  return level > 0.0f ? level : 1.0f;
}

std::vector<CutNode> cutNodes(const Hierarchy& hierarchy, const NodeGeometry& geometry, CutKey key,
                              std::span<const glm::vec3> emission) {
  std::vector<CutNode> nodes(hierarchy.nodeCount());
  if (key == CutKey::transfer) return nodes;
  const std::vector<glm::vec3> center =
      centersWithSky(hierarchy, geometry, static_cast<std::uint32_t>(emission.size()));
  const std::vector<std::uint8_t> emits = emittingNodes(hierarchy, emission);
  const float surfelWidth = emission.empty() ? 0.0f : std::sqrt(geometry.area[hierarchy.leafNode[0]]);
  for (std::uint32_t node = 0; node < nodes.size(); ++node) {
    nodes[node].firstWeight = hierarchy.firstWeight[node];
    if (hierarchy.isLeaf(node)) continue;
    const std::uint32_t a = hierarchy.child[node], b = a + 1;
    nodes[node].extent = glm::length(center[a] - center[b]) + surfelWidth;
    if (emits[node]) nodes[node].extent *= kEmitterWeight * kEmitterWeight;  // the key is quadratic in light
  }
  sumHidden(hierarchy, nodes);
  return nodes;
}

void sumHidden(const Hierarchy& hierarchy, std::span<CutNode> nodes) {
  for (std::uint32_t node = 0; node < nodes.size(); ++node) {
    if (hierarchy.isLeaf(node)) continue;
    const std::uint32_t child = hierarchy.child[node];
    for (const std::uint32_t k : {0u, 1u}) nodes[child + k].hidden = nodes[node].hidden + hiddenUnder(nodes[node], k);
  }
}

void cutKeys(const VisibleSubtree& tree, std::span<const CutNode> cutNode, CutKey key, CutKeys& keys) {
  const std::span<const VisibleNode> nodes = tree.nodes();
  keys.key.assign(nodes.size(), 0.0f);
  keys.average.assign(nodes.size(), 0.0f);
  keys.reads.resize(nodes.size());
  std::iota(keys.reads.begin(), keys.reads.end(), 0u);
  // Children come before their parents.
  for (std::size_t slot = tree.leaves().size(); slot < nodes.size(); ++slot) {
    const VisibleNode& s = nodes[slot];
    if (key == CutKey::transfer) {
      keys.key[slot] = s.weight;
      continue;
    }
    keys.key[slot] = keys.average[slot] = averageError(tree, s, cutNode, keys.average);
    for (const std::uint32_t k : {0u, 1u}) {
      const float error = pickError(tree, s, k, cutNode[s.node].extent, keys.key);
      if (error >= keys.key[slot]) continue;
      keys.key[slot] = error;
      keys.reads[slot] = keys.reads[s.child[k]];
    }
  }
}

void selectCut(const VisibleSubtree& tree, const CutKeys& keys, const CutLimit& limit, std::vector<CutCandidate>& queue,
               std::vector<CutLink>& cut) {
  // The largest key goes on top; equal keys are sorted by node.
  const auto below = [&](const CutCandidate& a, const CutCandidate& b) {
    return a.key != b.key ? a.key < b.key : tree[a.slot].node > tree[b.slot].node;
  };
  queue.clear();
  cut.clear();
  double keySum = 0.0;
  const auto add = [&](std::uint32_t slot) {
    if (tree.isLeaf(slot)) {
      cut.push_back({slot, slot});
      return;
    }
    keySum += double{keys.key[slot]};
    queue.push_back({keys.key[slot], slot});
    std::push_heap(queue.begin(), queue.end(), below);
  };

  for (const std::uint32_t root : tree.roots()) add(root);
  while (!queue.empty() && queue.size() + cut.size() < limit.maxNodes && queue.front().key > limit.minKey &&
         (limit.maxKeySum == 0.0f || keySum > double{limit.maxKeySum})) {
    std::pop_heap(queue.begin(), queue.end(), below);
    const CutCandidate top = queue.back();
    queue.pop_back();
    keySum -= double{top.key};
    add(tree[top.slot].child[0]);
    add(tree[top.slot].child[1]);
  }

  for (const CutCandidate& candidate : queue) cut.push_back({candidate.slot, keys.reads[candidate.slot]});
  std::sort(cut.begin(), cut.end(),
            [&](const CutLink& a, const CutLink& b) { return tree[a.reads].node < tree[b.reads].node; });
}

}  // namespace relume
