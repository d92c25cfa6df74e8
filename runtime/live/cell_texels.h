// SPDX-License-Identifier: MIT
// The cells of a volume as shaders read them (shaders/lib/live_volume.glsl).
#pragma once

#include "runtime/live/cell_set.h"

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <vector>

namespace relume {

// Bits of a brick as shaders read them, the lower ones first.
inline glm::uvec2 wordsOf(std::uint64_t bits) {
  return {static_cast<std::uint32_t>(bits), static_cast<std::uint32_t>(bits >> 32)};
}

// [Size cells] Bits of standing voxels that have sub-voxels in x and y; number of the first of them; its cache:
// slot * 64 + voxel, kInactive = none.
std::vector<glm::uvec4> cellTexels(const CellSet& cells);

// Of each of these voxels: bits of its sub-voxels in x and y, and in z CellSet::planeAt(), a byte each.
std::vector<glm::uvec4> subVoxelTexels(const CellSet& cells);

}  // namespace relume
