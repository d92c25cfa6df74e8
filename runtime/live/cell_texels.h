// SPDX-License-Identifier: MIT
// The cells of a volume as shaders read them (shaders/lib/live_volume.glsl).
#pragma once

#include "runtime/live/cell_set.h"

#include <glm/vec4.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace relume {

// [Size cells] Bits of standing voxels that have sub-voxels in x and y; number of the first of them; its cache:
// slot * 64 + voxel, kInactive = none.
std::vector<glm::uvec4> cellTexels(const CellSet& cells);

// Of each of these voxels: bits of its sub-voxels in x and y, and in z CellSet::planeAt(), a byte each.
std::vector<glm::uvec4> subVoxelTexels(const CellSet& cells);

}  // namespace relume
