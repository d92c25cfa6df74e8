// SPDX-License-Identifier: MIT
// What rays meet of a layer of triangles, at a quarter of a voxel: 4 x 4 x 4 sub-voxels each, by the thin test of
// overlap.h, so that no ray passes a closed surface, and what is thinner than a voxel hides no more of it than it
// fills.
//
// A voxel that has sub-voxels need not be occupied itself: a surface may cut off its corner. Light is then that of the
// voxel beside the corner (VoxelLayer::numberBehind()).
#pragma once

#include "relume/relighter.h"
#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

struct SubVoxels {
  std::vector<std::uint64_t> bits;   // [Size cells] brickBit() of each voxel that has some
  std::vector<std::uint32_t> first;  // [Size cells] number of the cell's first such voxel
  std::vector<std::uint64_t> of;     // [Size such voxels] brickBit() of each sub-voxel that a triangle overlaps

  // Of any voxel of the grid.
  std::uint64_t in(const VolumeGrid& grid, const glm::ivec3& v) const {
    const std::uint32_t cell = grid.cellOf(v);
    return bits[cell] >> brickBit(v) & 1u ? of[first[cell] + countBefore(bits[cell], v)] : 0;
  }
  // The same in a grid that begins so many cells farther on: of the cells that both grids have, others are empty.
  SubVoxels moved(const VolumeGrid& to, const glm::ivec3& by) const;
  // The same but for the voxels of `dirty`, which are those of `patch`. [Size dirty: cells]
  SubVoxels patched(std::span<const std::uint64_t> dirty, const SubVoxels& patch) const;

  std::size_t bytes() const {
    return sizeof(bits[0]) * bits.size() + sizeof(first[0]) * first.size() + sizeof(of[0]) * of.size();
  }
  bool operator==(const SubVoxels&) const = default;
};

// The same at any number of threads.
SubVoxels findSubVoxels(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles,
                        const ParallelFor& parallelFor);

}  // namespace relume
