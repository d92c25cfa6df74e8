// SPDX-License-Identifier: MIT
// What a host hands over for a voxel volume: triangles in the axes of their part, a surface for each of them, and where
// the parts stand. Data and no callbacks, so that the same input serves every backend and voxels are equal to the bit.
#pragma once

#include "relume/result.h"

#include <glm/mat4x3.hpp>
#include <glm/vec3.hpp>

#include <cstdint>
#include <span>

namespace relume {

struct VoxelSurface {
  glm::vec3 albedo{0.5f};    // [0..1]
  glm::vec3 emission{0.0f};  // [W/m²/sr] [0..1e9] of the front, and of the back where doubleSided
  float coverage = 1.0f;     // [0..1] share of the triangle that is there: leaves, fences
  bool doubleSided = false;  // emits from its back as well; both sides of any triangle reflect
};

struct VoxelMesh {
  std::span<const glm::vec3> position;     // [m] within 1e8 on each axis
  std::span<const glm::uvec3> triangle;    // vertex indices; the front is counter-clockwise
  std::span<const std::uint32_t> surface;  // [Size triangles] index of each triangle's surface
};

struct VoxelPart {
  std::uint32_t mesh = 0;
  glm::mat4x3 toWorld{1.0f};  // may mirror and may scale to nothing
  bool moves = false;         // placed anew by VoxelVolume::move()
};

// A level for a volume. Spans are read by create() and edit() alone, which keep what they need.
struct VoxelGeometry {
  std::span<const VoxelSurface> surfaces;
  std::span<const VoxelMesh> meshes;
  std::span<const VoxelPart> parts;
};

// usage: an index out of range, a span of the wrong size, a number that is not finite or out of its range; the message
// names surface, mesh, triangle or part.
Status checkGeometry(const VoxelGeometry& geometry);
// The same of one transform.
Status checkTransform(const glm::mat4x3& toWorld, std::size_t part);

}  // namespace relume
