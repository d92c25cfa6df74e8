// SPDX-License-Identifier: MIT
// In which order the GPU averages radiosity up the hierarchy: whole subtrees to a work group each, then what is above
// them to one more. Two dispatches and one barrier between them, whatever the depth (PIC 4.1: a dispatch a level).
#pragma once

#include "formats/hierarchy.h"
#include "shaders/shared/layout.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace relume::gl {

// Inner nodes of the hierarchy, each once. A work group goes through rounds; the nodes of a round do not depend on one
// another, but on earlier rounds of the group. The last group depends on all others.
struct PullSchedule {
  struct Node {
    std::uint32_t node, firstChild;
    float firstWeight;  // [0..1] share of the first child in the node's radiosity
  };
  std::vector<Node> node;  // [Size inner nodes]
  std::vector<std::uint32_t>
      roundBegin;  // [Size rounds + 1] round r is node[roundBegin[r]] .. node[roundBegin[r + 1] - 1]
  std::vector<std::uint32_t>
      groupBegin;  // [Size groups + 1] group g has the rounds groupBegin[g] .. groupBegin[g + 1] - 1

  std::uint32_t groupCount() const { return static_cast<std::uint32_t>(groupBegin.size() - 1); }
};

// Nodes of a hierarchy at most, so that one that is pulled fits 8 bytes.
constexpr std::uint32_t kMostPulledNodes = 1u << kRelumePullNodeBits;

// As pull.comp reads it: node k of the inner ones has its children at 1 + 2 k and 2 + 2 k (runtime/cpu/pull.h).
inline std::array<std::uint32_t, 2> packPullNode(const PullSchedule::Node& node) {
  const auto weight = static_cast<std::uint32_t>(std::lrint(node.firstWeight * float{kRelumePullWeightOne}));
  return {node.node | weight << kRelumePullNodeBits,
          (node.firstChild >> 1) | weight >> (32 - kRelumePullNodeBits) << (kRelumePullNodeBits - 1)};
}

// [nodesPerGroup >= 1] inner nodes that a group gets at most; the last one may get more. At least one group.
PullSchedule makePullSchedule(const Hierarchy& hierarchy, std::uint32_t nodesPerGroup);

}  // namespace relume::gl
