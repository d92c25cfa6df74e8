// SPDX-License-Identifier: MIT
// Which triangles overlap which voxels of a layer, and with what share of their area: by voxel, so that each voxel's
// sums are one thread's.
#pragma once

#include "relume/relighter.h"
#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/voxel_grid.h"
#include "runtime/voxels/voxel_layer.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

struct VoxelPair {
  std::uint32_t triangle = 0;
  // Of SnappedTriangle::area, in 1/16, at least 1. [below 2^27: edges are at most 8 voxels]
  std::uint32_t share : 31 = 0;
  std::uint32_t touches : 1 = 0;  // the triangle lies on the voxel's face, and its area is in the next one
};

struct VoxelPairs {
  std::vector<std::uint32_t> begin;  // [Size kept + 1] of each voxel's pairs
  std::vector<VoxelPair> pair;       // of a voxel by ascending triangle

  std::span<const VoxelPair> of(std::uint32_t voxel) const {
    return {pair.data() + begin[voxel], begin[voxel + 1] - begin[voxel]};
  }
};

// Of the triangles [first, end) and those voxels of the layer that are kept. Twelve bytes a pair while it runs.
VoxelPairs findPairs(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles, std::uint32_t first,
                     std::uint32_t end, const ParallelFor& parallelFor, const VoxelLayer& layer);

}  // namespace relume
