// SPDX-License-Identifier: MIT
// The cells of a volume as shaders read them (shaders/lib/live_volume.glsl).
#pragma once

#include "runtime/live/cell_set.h"

#include <glm/vec4.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace relume {

// [Size cells] Bits of standing voxels in x and y; number of the first of them; its cache: slot * 64 + voxel, kInactive
// = none.
std::vector<glm::uvec4> cellTexels(const CellSet& cells);

// CellSet::planeOf() of all standing voxels, zero of those that were dropped: who is in one stays there.
std::vector<std::array<std::int8_t, 4>> cellPlanes(const CellSet& cells);

}  // namespace relume
