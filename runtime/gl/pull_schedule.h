// SPDX-License-Identifier: MIT
// In which order the GPU averages radiosity up the hierarchy: whole subtrees to a work group each, then what is above
// them to one more. Two dispatches and one barrier between them, whatever the depth (PIC 4.1: a dispatch a level).
#pragma once

#include "formats/hierarchy.h"
#include "shaders/shared/layout.h"

#include <cstdint>
#include <vector>

namespace relume::gl {

// Inner nodes of the hierarchy, each once. A work group goes through rounds; the nodes of a round do not depend on one
// another, but on earlier rounds of the group. The last group depends on all others.
struct PullSchedule {
  std::vector<RelumePullNode> node;      // [Size inner nodes]
  std::vector<std::uint32_t> roundBegin; // [Size rounds + 1] round r is node[roundBegin[r]] .. node[roundBegin[r + 1] - 1]
  std::vector<std::uint32_t> groupBegin; // [Size groups + 1] group g has the rounds groupBegin[g] .. groupBegin[g + 1] - 1

  std::uint32_t groupCount() const { return static_cast<std::uint32_t>(groupBegin.size() - 1); }
};

// [nodesPerGroup >= 1] inner nodes that a group gets at most; the last one may get more. At least one group.
PullSchedule makePullSchedule(const Hierarchy& hierarchy, std::uint32_t nodesPerGroup);

}  // namespace relume::gl
