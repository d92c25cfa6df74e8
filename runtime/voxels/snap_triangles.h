// SPDX-License-Identifier: MIT
// Triangles of a part as the voxeliser takes them: placed in the world, rounded to 1/64 voxel and split until no edge
// is longer than 8 voxels, so that all its tests fit 32 bits.
#pragma once

#include "relume/voxel_geometry.h"
#include "runtime/voxels/voxel_grid.h"

#include <array>
#include <cstdint>
#include <vector>

namespace relume {

// An edge is at most so long. [1/64 voxel]
inline constexpr int kMaxEdge = 8 * kVoxelSteps;

struct SnappedTriangle {
  std::array<std::array<std::int16_t, 3>, 3> corner{};  // [1/64 voxel] from the grid's corner
  std::array<std::int8_t, 3> normal{};                  // 127 times the unit normal
  std::uint32_t area = 0;                               // [1/64 voxel squared] twice the area, times the coverage, >= 1
  std::uint32_t surface = 0;
};

struct SnapCounts {
  std::size_t outside = 0;   // triangles out of the box
  std::size_t zeroArea = 0;  // triangles without area once they are rounded
  std::size_t split = 0;     // triangles that were cut
};

// Triangles that snapping may leave at most: beyond it a level is refused.
inline constexpr std::size_t kMaxSnapped = std::size_t{1} << 25;

// Triangles that do not reach into this box are left out. [1/64 voxel] Both ends are part of it.
struct SnapBox {
  glm::ivec3 low{0}, high{0};
  static SnapBox of(const VolumeGrid& grid) { return {glm::ivec3(0), kVoxelSteps * grid.voxels()}; }
};

// Whether a triangle of a surface with this coverage is there, by a hash of its number. [0..1]
bool isThere(float coverage, std::uint32_t triangle);

// Appends the triangles [begin, end) of a mesh that has passed checkGeometry(). Two triangles that share an edge split
// it at the same points: no cracks open. Triangles of a surface with coverage below 1 are kept by chance, the same ones
// each time. Returns false where there would be more than kMaxSnapped.
bool snapTriangles(const VolumeGrid& grid, const SnapBox& box, const VoxelMesh& mesh,
                   std::span<const VoxelSurface> surfaces, const glm::mat4x3& toWorld, std::uint32_t begin,
                   std::uint32_t end, std::vector<SnappedTriangle>& snapped, SnapCounts& counts);

}  // namespace relume
