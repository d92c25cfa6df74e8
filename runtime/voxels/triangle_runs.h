// SPDX-License-Identifier: MIT
// Bounds of runs of a mesh's triangles: what lies out of a box is passed over without its vertices being placed, as
// most of a level is when a few voxels of it are found anew.
#pragma once

#include "relume/voxel_geometry.h"
#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/mat4x3.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kTrianglesOfRun = 64;

struct TriangleRun {
  glm::vec3 min{0.0f}, max{0.0f};  // as the mesh's vertices
  std::uint32_t there = 0;         // how many of its triangles are: isThere()
};

// [Size triangles / kTrianglesOfRun, rounded up] of a mesh that has passed checkGeometry().
std::vector<TriangleRun> findRuns(const VoxelMesh& mesh, std::span<const VoxelSurface> surfaces);

// Which runs of a placed mesh have no triangle that reaches into a box. May say no of one that is out of it.
class RunsOutside {
 public:
  // toWorld: checkTransform()
  RunsOutside(const VolumeGrid& grid, const SnapBox& box, const glm::mat4x3& toWorld);
  bool operator()(const TriangleRun& run) const;

 private:
  // Steps of a vertex, from the grid's corner: factor * vertex + offset. [axis][coordinate]
  double factor_[3][3], offset_[3];
  double low_[3], high_[3];
};

}  // namespace relume
