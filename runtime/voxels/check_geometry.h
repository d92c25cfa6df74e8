// SPDX-License-Identifier: MIT
// What of a level that is handed over cannot be voxelised, and what ends for want of memory.
#pragma once

#include "relume/result.h"
#include "relume/voxel_geometry.h"

#include <cstddef>

namespace relume {

// usage: an index out of range, a span of the wrong size, a number that is not finite or out of its range; the message
// names surface, mesh, triangle or part.
Status checkGeometry(const VoxelGeometry& geometry);
// The same of one surface or mesh, whose name the message lacks: callers have names of their own.
Status checkVoxelSurface(const VoxelSurface& surface);
Status checkVoxelMesh(const VoxelMesh& mesh, std::size_t surfaces);
// The same of one transform.
Status checkTransform(const glm::mat4x3& toWorld, std::size_t part);
// Of volumes and what is in them.
Error noMemoryForVoxels();

}  // namespace relume
