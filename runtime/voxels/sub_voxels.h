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

// brickBit() of each sub-voxel that a triangle overlaps, of voxels by number. A level has far fewer shapes than voxels:
// each is kept once, unless there are so many that this does not pay.
class SubVoxelShapes {
 public:
  SubVoxelShapes() = default;
  explicit SubVoxelShapes(std::vector<std::uint64_t> ofVoxels);

  std::uint64_t operator[](std::size_t voxel) const { return number_.empty() ? shape_[voxel] : shape_[number_[voxel]]; }
  std::size_t size() const { return number_.empty() ? shape_.size() : number_.size(); }  // [voxels]
  std::vector<std::uint64_t> ofVoxels() const;                                           // as they came
  std::size_t bytes() const { return sizeof(shape_[0]) * shape_.size() + sizeof(number_[0]) * number_.size(); }
  bool operator==(const SubVoxelShapes&) const = default;

 private:
  std::vector<std::uint64_t> shape_;   // in the order in which voxels have them first
  std::vector<std::uint16_t> number_;  // of each voxel's shape; none: each voxel has one of its own
};

struct SubVoxels {
  std::vector<std::uint64_t> bits;   // [Size cells] brickBit() of each voxel that has some
  std::vector<std::uint32_t> first;  // [Size cells] number of the cell's first such voxel
  SubVoxelShapes of;                 // [Size such voxels]

  // Of any voxel of the grid.
  std::uint64_t in(const VolumeGrid& grid, const glm::ivec3& v) const {
    const std::uint32_t cell = grid.cellOf(v);
    return bits[cell] >> brickBit(v) & 1u ? of[first[cell] + countBefore(bits[cell], v)] : 0;
  }
  // The same in a grid that begins so many cells farther on: of the cells that both grids have, others are empty.
  SubVoxels moved(const VolumeGrid& to, const glm::ivec3& by) const;
  // The same but for the voxels of `dirty`, which are those of `patch`. [Size dirty: cells]
  SubVoxels patched(std::span<const std::uint64_t> dirty, const SubVoxels& patch) const;

  std::size_t bytes() const { return sizeof(bits[0]) * bits.size() + sizeof(first[0]) * first.size() + of.bytes(); }
  bool operator==(const SubVoxels&) const = default;
};

// The same at any number of threads.
SubVoxels findSubVoxels(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles,
                        const ParallelFor& parallelFor);

}  // namespace relume
