// SPDX-License-Identifier: MIT
// The cells of a volume as shaders read them (shaders/lib/live_volume.glsl).
#pragma once

#include "runtime/live/cell_set.h"

#include <glm/vec4.hpp>

#include <cstdint>
#include <vector>

namespace relume {

// [Size cells] Bits of standing voxels in x and y; number of the first of them; its cache: slot * 64 + voxel, kInactive
// = none.
std::vector<glm::uvec4> cellTexels(const CellSet& cells);

}  // namespace relume
