// SPDX-License-Identifier: MIT
// Bounds of runs of a mesh's triangles: what lies out of a box is passed over without its vertices being placed, as
// most of a level is when a few voxels of it are found anew.
#pragma once

#include "runtime/voxels/snap_triangles.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/mat4x3.hpp>
#include <glm/vec3.hpp>

#include <cstdint>

namespace relume {

inline constexpr std::uint32_t kTrianglesOfRun = 512;

struct TriangleRun {
  glm::vec3 min{0.0f}, max{0.0f};  // of its vertices, as the mesh has them
  std::uint32_t firstByte = 0, firstSurface = 0;
};

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
