// SPDX-License-Identifier: MIT
// The voxels of one set of triangles: a bit for each that is occupied, and for each of these what its two sides are.
// A layer holds what stands or what moves; a volume has one of both.
#pragma once

#include "relume/relighter.h"
#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/voxel_grid.h"
#include "runtime/voxels/voxel_side.h"

#include <glm/gtc/type_precision.hpp>

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

class SummedSurfaces;

struct SideEmission {
  std::uint32_t side = 0;
  glm::vec3 emission{0.0f};  // [W/m²/sr] not 0
};

struct VoxelLayer {
  std::vector<std::uint64_t> bits;       // [Size cells] brickBit() of each voxel; CRC's geometry volume
  std::vector<std::uint32_t> first;      // [Size cells] number of the cell's first occupied voxel
  std::vector<glm::i8vec3> axis;         // [Size kept] toward the front side, 127 times the unit vector
  std::vector<glm::u8vec3> voxel;        // [Size kept] its place: grids have up to 256 voxels along a side
  std::vector<VoxelSide> side;           // [Size 2 kept] front, back
  std::vector<SideEmission> emission;    // of the sides that emit, by ascending side
  std::uint32_t occupied = 0, kept = 0;  // voxels, and those of them that have sides

  bool has(const VolumeGrid& grid, const glm::ivec3& v) const {
    return (bits[grid.cellOf(v)] >> brickBit(v) & 1u) != 0;
  }
  // The number of an occupied voxel: those of the cell before, and the bits below its own.
  std::uint32_t numberOf(const VolumeGrid& grid, const glm::ivec3& v) const {
    const std::uint32_t cell = grid.cellOf(v);
    return first[cell] + countBefore(bits[cell], v);
  }
  // What emits of this side and of those after it.
  std::vector<SideEmission>::const_iterator emissionFrom(std::uint32_t s) const {
    return std::lower_bound(emission.begin(), emission.end(), s,
                            [](const SideEmission& a, std::uint32_t b) { return a.side < b; });
  }
  glm::vec3 emissionOf(std::uint32_t s) const {  // [W/m²/sr]
    const auto found = emissionFrom(s);
    return found != emission.end() && found->side == s ? found->emission : glm::vec3(0.0f);
  }
};

// Set the bits of all voxels that triangles overlap, the same at any number of threads. [Size bits: cells]
void addBits(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles, const ParallelFor& parallelFor,
             std::vector<std::uint64_t>& bits);
// A layer of these bits, without sides.
void voxelise(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles, const ParallelFor& parallelFor,
              VoxelLayer& layer);

// A layer in a grid that begins so many cells farther on: of the cells that both grids have, others are empty. All of
// its voxels are kept.
VoxelLayer moveLayer(const VoxelLayer& layer, const VolumeGrid& to, const glm::ivec3& by);

// Sides of the first `budget` occupied voxels, in the order of their numbers. Sums are of integers, so that they do not
// depend on the order in which threads add them.
void fillSides(const VolumeGrid& grid, std::span<const SnappedTriangle> triangles, const SummedSurfaces& surfaces,
               std::uint32_t budget, const ParallelFor& parallelFor, VoxelLayer& layer);

// The same layer but for the voxels of `dirty`, whose bits and sides are found anew. triangles: at least all that
// overlap such a voxel, in the order in which the whole layer has them. False, and nothing is changed, where the layer
// has or would have more voxels than the budget keeps. [Size dirty: cells]
bool patchSides(const VolumeGrid& grid, std::span<const std::uint64_t> dirty,
                std::span<const SnappedTriangle> triangles, const SummedSurfaces& surfaces, std::uint32_t budget,
                const ParallelFor& parallelFor, VoxelLayer& layer);

}  // namespace relume
