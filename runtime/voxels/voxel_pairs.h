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
  std::uint32_t first = 0;           // number of the first voxel
  std::vector<std::uint32_t> begin;  // [Size voxels + 1] of each voxel's pairs
  std::vector<VoxelPair> pair;       // of a voxel by ascending triangle

  std::span<const VoxelPair> of(std::uint32_t voxel) const {
    const std::uint32_t i = voxel - first;
    return {pair.data() + begin[i], begin[i + 1] - begin[i]};
  }
};

// Of the voxels whose numbers are in [first, end). Twenty bytes a pair while it runs, eight after.
VoxelPairs findPairs(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles, std::uint32_t first,
                     std::uint32_t end, const ParallelFor& parallelFor, const VoxelLayer& layer);

}  // namespace relume
