// SPDX-License-Identifier: MIT
// See pull.h. A level is a sequential read of the level below and an ascending write. The tree is cut below its top
// into parts that are pulled on their own, for several threads.
#include "runtime/cpu/pull.h"

#include "runtime/shared/chunks.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace relume::cpu {
namespace {

// Inner nodes of a part, and parts from which on waking a thread costs less than it saves.
constexpr std::uint32_t kPartNodes = 16384;
constexpr std::uint32_t kMinParts = 4, kMaxParts = 64;

}  // namespace

PullTree::PullTree(const Hierarchy& hierarchy, std::pmr::memory_resource* memory)
    : inner_(
          hierarchy.nodeCount(), kSurfelBlock, [&hierarchy](std::uint32_t node) { return !hierarchy.isLeaf(node); },
          memory),
      weight_(memory),
      innerBegin_(memory),
      bound_(memory) {
  weight_.reserve(inner_.size());
  std::pmr::vector<std::uint32_t> innerBefore(hierarchy.nodeCount() + 1, 0, memory);
  for (std::uint32_t level = 0; level < hierarchy.levelCount(); ++level) {
    innerBegin_.push_back(static_cast<std::uint32_t>(weight_.size()));
    for (std::uint32_t node = hierarchy.levelBegin[level]; node < hierarchy.levelBegin[level + 1]; ++node) {
      if (!hierarchy.isLeaf(node))
        weight_.push_back(static_cast<std::uint16_t>(std::lrint(65534.0f * hierarchy.firstWeight[node])));
      innerBefore[node + 1] = static_cast<std::uint32_t>(weight_.size());
    }
  }
  innerBegin_.push_back(static_cast<std::uint32_t>(weight_.size()));
  cutUp(hierarchy, innerBefore);
}

// Children of neighbours are neighbours: what lies under a run of nodes of one level is a run of every level below.
void PullTree::cutUp(const Hierarchy& hierarchy, std::span<const std::uint32_t> innerBefore) {
  const std::uint32_t levels = hierarchy.levelCount(), wanted = std::min(inner_.size() / kPartNodes, kMaxParts);
  if (wanted < kMinParts) return;
  // The first level with a few nodes for every part.
  while (cut_ < levels && hierarchy.levelBegin[cut_ + 1] - hierarchy.levelBegin[cut_] < 4 * wanted) ++cut_;
  if (cut_ == levels) return;

  const std::uint32_t begin = hierarchy.levelBegin[cut_], end = hierarchy.levelBegin[cut_ + 1];
  std::pmr::vector<std::uint32_t> nodes(hierarchy.nodeCount(), 1, bound_.get_allocator());  // of the subtrees
  for (std::uint32_t node = hierarchy.nodeCount(); node-- > begin;) {
    if (!hierarchy.isLeaf(node)) nodes[node] += nodes[hierarchy.child[node]] + nodes[hierarchy.child[node] + 1];
  }
  std::uint64_t all = 0, here = 0;
  for (std::uint32_t node = begin; node < end; ++node) all += nodes[node];
  const auto addBound = [&](std::uint32_t node) {
    for (std::uint32_t level = cut_; level < levels; ++level) {
      bound_.push_back(innerBefore[node]);
      node = 1 + 2 * bound_.back();
    }
  };
  for (std::uint32_t node = begin; node < end; here += nodes[node++]) {
    if (here * wanted >= parts_ * all) {
      addBound(node);
      ++parts_;
    }
  }
  addBound(end);
}

void PullTree::pullNodes(const LightSurfelsKernel& kernel, std::span<std::uint32_t> node, std::uint32_t begin,
                         std::uint32_t end) const {
  alignas(64) std::uint32_t at[kSurfelBlock + kAtRoom];
  for (std::uint32_t i = begin; i < end; i += kSurfelBlock) {
    const std::uint32_t count = std::min(kSurfelBlock, end - i);
    inner_.read(kernel, i, count, at);
    kernel.pull(node.data() + 1 + 2 * std::size_t{i}, weight_.data() + i, at, count, node.data());
  }
}

void PullTree::pull(const LightSurfelsKernel& kernel, std::span<std::uint32_t> node,
                    const ParallelFor& parallelFor) const {
  const auto levels = static_cast<std::uint32_t>(innerBegin_.size()) - 1, below = levels - cut_;
  // Whole levels are the longest runs: parts are for several threads.
  const bool inParts = parallelFor && parts_ > 0;
  if (inParts) {
    const auto pullPart = [&](std::uint32_t part) {
      for (std::uint32_t level = below; level-- > 0;) {
        pullNodes(kernel, node, bound_[part * below + level], bound_[(part + 1) * below + level]);
      }
    };
    runTasks(parallelFor, parts_, std::cref(pullPart));
  }
  for (std::uint32_t level = inParts ? cut_ : levels; level-- > 0;) {
    pullNodes(kernel, node, innerBegin_[level], innerBegin_[level + 1]);
  }
}

std::size_t PullTree::bytes() const {
  return inner_.bytes() + sizeof(std::uint16_t) * weight_.size() +
         sizeof(std::uint32_t) * (innerBegin_.size() + bound_.size());
}

}  // namespace relume::cpu
