// SPDX-License-Identifier: MIT
// The voxels of one set of triangles: a bit for each that is occupied, and for each of these what its two sides are.
// A layer holds what stands or what moves; a volume has one of both.
#pragma once

#include "relume/relighter.h"
#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/summed_surfaces.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/gtc/type_precision.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// A place of the surfaces in a voxel at which direct light is found. [1/64 voxel from the voxel's middle; 127 times the
// unit normal]
struct SideSample {
  std::array<std::int8_t, 3> place{}, normal{};
  std::uint8_t count = 0;  // how many of the four it stands for; 0 = none
};

// One side of an occupied voxel: means over the triangles that face it, by area and by how squarely they do. Where none
// does, the back of those that face the other side.
struct VoxelSide {
  glm::vec3 positionWorld{0.0f};  // [m] in front of all that faces this side, so that light reaches it
  glm::vec3 normal{0.0f};         // unit
  glm::vec3 albedo{0.0f};
  glm::vec3 emission{0.0f};  // [W/m²/sr]
  // On the surfaces nearest to four places spread over the voxel; light and shadow vary within it.
  std::array<SideSample, 4> sample{};
  float area = 0.0f;  // [m²] of triangles that face it; 0 = their backs alone
};

struct VoxelLayer {
  std::vector<std::uint64_t> bits;       // [Size cells] brickBit() of each voxel; CRC's geometry volume
  std::vector<std::uint32_t> first;      // [Size cells] number of the cell's first occupied voxel
  std::vector<glm::vec3> axis;           // [Size kept] unit: toward the front side
  std::vector<glm::u8vec3> voxel;        // [Size kept] its place: grids have up to 256 voxels along a side
  std::vector<VoxelSide> side;           // [Size 2 kept] front, back
  std::uint32_t occupied = 0, kept = 0;  // voxels, and those of them that have sides

  bool has(const VolumeGrid& grid, const glm::ivec3& v) const {
    return (bits[grid.cellOf(v)] >> brickBit(v) & 1u) != 0;
  }
  // The number of an occupied voxel: those of the cell before, and the bits below its own.
  std::uint32_t numberOf(const VolumeGrid& grid, const glm::ivec3& v) const {
    const std::uint32_t cell = grid.cellOf(v);
    return first[cell] + countBefore(bits[cell], v);
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
