// SPDX-License-Identifier: MIT
// Triangles of a part as the voxeliser takes them: placed in the world, rounded to 1/64 voxel and split until no edge
// is longer than 8 voxels, so that all its tests fit 32 bits.
#pragma once

#include "relume/voxel_geometry.h"
#include "runtime/voxels/step_place.h"
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

// Triangles of one part, one after the other. Two that share an edge split it at the same points: no cracks open.
class TriangleSnapper {
 public:
  TriangleSnapper(const VolumeGrid& grid, const SnapBox& box, const glm::mat4x3& toWorld);

  glm::ivec3 stepsOf(const glm::vec3& position) const {
    return place_.stepsOf(position);
  }  // as SnappedTriangle::corner
  // Appends a triangle with these corners, counter-clockwise where its mesh has its front. Returns false where there
  // would be more than kMaxSnapped.
  bool add(const std::array<glm::ivec3, 3>& corners, std::uint32_t surface, std::vector<SnappedTriangle>& snapped,
           SnapCounts& counts);

 private:
  bool isOutside(const std::array<glm::ivec3, 3>& t) const;

  StepPlace place_;
  SnapBox box_;
  std::vector<std::array<glm::ivec3, 3>> stack_;
};

// visit(position) of each corner of each triangle, of a mesh that has passed checkVoxelMesh(). Bounds of a mesh are
// those of its corners, not of all its vertices: sub-meshes may share a vertex buffer, of which each uses a part.
template <class Visit>
void forCorners(const VoxelMesh& mesh, const Visit& visit) {
  for (const glm::uvec3& index : mesh.triangle) {
    for (int k = 0; k < 3; ++k) visit(mesh.position[index[k]]);
  }
}

// All triangles of a mesh that has passed checkGeometry(), whatever their surfaces cover.
bool snapTriangles(const VolumeGrid& grid, const SnapBox& box, const VoxelMesh& mesh, const glm::mat4x3& toWorld,
                   std::vector<SnappedTriangle>& snapped, SnapCounts& counts);

}  // namespace relume
