// SPDX-License-Identifier: MIT
// See pull.h. A level is a sequential read of the level below and an ascending write.
#include "runtime/cpu/pull.h"

#include "runtime/cpu/chunks.h"

#include <cmath>

namespace relume::cpu {
namespace {

// Levels of fewer inner nodes are not worth a task: waking a thread takes as long as some ten thousand nodes.
constexpr std::uint32_t kGrain = 65536;

}  // namespace

PullTree::PullTree(const Hierarchy& hierarchy)
    : inner_(hierarchy.nodeCount(), kSurfelBlock,
             [&hierarchy](std::uint32_t node) { return !hierarchy.isLeaf(node); }) {
  weight_.reserve(inner_.size());
  for (std::uint32_t level = 0; level < hierarchy.levelCount(); ++level) {
    innerBegin_.push_back(static_cast<std::uint32_t>(weight_.size()));
    for (std::uint32_t node = hierarchy.levelBegin[level]; node < hierarchy.levelBegin[level + 1]; ++node) {
      if (!hierarchy.isLeaf(node))
        weight_.push_back(static_cast<std::uint16_t>(std::lrint(65534.0f * hierarchy.firstWeight[node])));
    }
  }
  innerBegin_.push_back(static_cast<std::uint32_t>(weight_.size()));
}

void PullTree::pull(const LightSurfelsKernel& kernel, std::span<std::uint32_t> node,
                    const ParallelFor& parallelFor) const {
  for (std::size_t level = innerBegin_.size() - 1; level-- > 0;) {
    const std::uint32_t begin = innerBegin_[level], end = innerBegin_[level + 1];
    forChunks(parallelFor, end - begin, kGrain, [&](std::uint32_t first, std::uint32_t last) {
      alignas(64) std::uint32_t at[kSurfelBlock + kAtRoom];
      for (std::uint32_t i = begin + first; i < begin + last; i += kSurfelBlock) {
        const std::uint32_t count = std::min(kSurfelBlock, begin + last - i);
        inner_.read(kernel, i, count, at);
        kernel.pull(node.data() + 1 + 2 * std::size_t{i}, weight_.data() + i, at, count, node.data());
      }
    });
  }
}

std::size_t PullTree::bytes() const {
  return inner_.bytes() + sizeof(std::uint16_t) * weight_.size() + sizeof(std::uint32_t) * innerBegin_.size();
}

}  // namespace relume::cpu
