// SPDX-License-Identifier: MIT
// See pull.h. The two children of a node are adjacent, so a level is a sequential read of the level below and a
// sequential write.
#include "runtime/cpu/pull.h"

#include "runtime/cpu/chunks.h"

namespace relume::cpu {
namespace {

// Levels smaller than this are not worth a task.
constexpr std::uint32_t kGrain = 8192;

typedef float Float4 __attribute__((vector_size(16)));

void pullRange(const std::uint32_t* child, const float* firstWeight, glm::vec4* node, std::uint32_t begin,
               std::uint32_t end) {
  auto* color = reinterpret_cast<float*>(node);
  const auto load = [color](std::uint32_t i) {
    Float4 v;
    __builtin_memcpy(&v, color + 4 * std::size_t{i}, sizeof v);
    return v;
  };
  for (std::uint32_t i = begin; i < end; ++i) {
    if (child[i] & kLeafBit) continue;
    const Float4 first = load(child[i]), second = load(child[i] + 1);
    const Float4 mean = second + firstWeight[i] * (first - second);
    __builtin_memcpy(color + 4 * std::size_t{i}, &mean, sizeof mean);
  }
}

}  // namespace

void pull(const Hierarchy& hierarchy, std::span<glm::vec4> node, const ParallelFor& parallelFor) {
  for (std::uint32_t level = hierarchy.levelCount(); level-- > 0;) {
    const std::uint32_t begin = hierarchy.levelBegin[level], end = hierarchy.levelBegin[level + 1];
    forChunks(parallelFor, end - begin, kGrain, [&](std::uint32_t first, std::uint32_t last) {
      pullRange(hierarchy.child.data(), hierarchy.firstWeight.data(), node.data(), begin + first, begin + last);
    });
  }
}

}  // namespace relume::cpu
