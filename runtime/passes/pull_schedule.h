// SPDX-License-Identifier: MIT
// In which order the GPU averages radiosity up the hierarchy: whole subtrees to a work group each, then what is above
// them to one more. Two dispatches and one barrier between them, whatever the depth (PIC 4.1: a dispatch a level).
//
// Nodes lie breadth first, so that the children of inner node number k are 1 + 2 k and 2 + 2 k (runtime/cpu/pull.h),
// and subtrees that follow one another depth first are a run of inner nodes in every level. A group therefore needs to
// know where its runs begin, and of each inner node its weight and how far behind its run's first node it lies.
#pragma once

#include "relume/hierarchy.h"
#include "shaders/shared/layout.h"

#include <array>
#include <cstdint>
#include <memory_resource>
#include <vector>

namespace relume::gpu {

struct PullSchedule {
  explicit PullSchedule(std::pmr::memory_resource* memory)
      : word(memory), run(memory), groupBegin(memory), roundBegin(memory) {}

  // Inner nodes [firstInner, firstInner + count) of one level; firstNode is the node of the first.
  struct Run {
    std::uint32_t firstInner, count, firstNode;
  };
  std::pmr::vector<std::uint32_t>
      word;  // [Size inner nodes] by number: weight of the first child over gl::kRelumePullWeightOne,
             // and above it the node's distance from firstNode (0 at the top)
  // Deepest runs of a group first: each depends on those before it. Then the runs of one node each of the top, which
  // depend on all groups.
  std::pmr::vector<Run> run;
  std::pmr::vector<std::uint32_t>
      groupBegin;  // [Size groups + 1] group g has the runs groupBegin[g] .. groupBegin[g + 1] - 1
  std::pmr::vector<std::uint32_t> roundBegin;  // [Size rounds of the top + 1] likewise; runs of a round do not depend
                                               // on one another, but on earlier rounds

  std::uint32_t groupCount() const { return static_cast<std::uint32_t>(groupBegin.size() - 1); }
  std::uint32_t roundCount() const { return static_cast<std::uint32_t>(roundBegin.size() - 1); }
};

// Nodes of a hierarchy and inner nodes of a group at most, so that a run fits 8 bytes.
constexpr std::uint32_t kMaxPulledNodes = 1u << gl::kRelumePullNodeBits;
constexpr std::uint32_t kMaxGroupNodes = (1u << (64 - 2 * gl::kRelumePullNodeBits)) - 1;

// As pull.comp reads it.
inline std::array<std::uint32_t, 2> packRun(const PullSchedule::Run& run) {
  constexpr std::uint32_t kLow = 32 - gl::kRelumePullNodeBits, kMask = (1u << kLow) - 1;
  return {run.firstNode | (run.count & kMask) << gl::kRelumePullNodeBits,
          run.firstInner | run.count >> kLow << gl::kRelumePullNodeBits};
}

// [nodesPerGroup 1..kMaxGroupNodes] inner nodes that a group gets at most. memory: keeps the schedule.
PullSchedule makePullSchedule(const Hierarchy& hierarchy, std::uint32_t nodesPerGroup,
                              std::pmr::memory_resource* memory);

}  // namespace relume::gpu
