// SPDX-License-Identifier: MIT
// What of a volume is other than it was, cell by cell: that its grid has moved, that parts have, or were edited. Far
// from it caches and what sees them stay (cell_set.h).
#pragma once

#include "relume/relighter.h"
#include "runtime/voxels/voxel_grid.h"
#include "runtime/voxels/voxel_layer.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Mix into the number of each cell what of a layer tells where caches stand: its voxels and their sides. The same for
// cells whose content is the same, wherever the grid is. [Size content: cells]
void addContent(const VoxelLayer& layer, const ParallelFor& parallelFor, std::span<std::uint64_t> content);

inline constexpr int kFarthestChange = 6;  // [cells] as far as changes are looked for

struct CellChanges {
  glm::ivec3 by{0};                    // cells from the grid before to the grid now
  std::vector<std::uint8_t> distance;  // [Size cells] to what has changed, along the axis in which it is largest,
                                       // kFarthestChange + 1 at most

  // Whether what lies within so many cells of a cell of the grid now is the same. [reach: 0..kFarthestChange]
  bool seesTheSame(const VolumeGrid& grid, const glm::ivec3& cell, int reach) const;
};

// The grids share their cells (VolumeGrid::sharesCells()); contents: by addContent(). [Size cells]
CellChanges changesSince(const VolumeGrid& before, std::span<const std::uint64_t> contentBefore, const VolumeGrid& grid,
                         std::span<const std::uint64_t> content);

}  // namespace relume
