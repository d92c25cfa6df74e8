// SPDX-License-Identifier: MIT
// What a host hands over of a level that is lit without a bake (live_light.h): triangles in the axes of their part, a
// surface for each of them, and where the parts stand. Data and no callbacks, so that the same input serves every
// backend.
#pragma once

#include "relume/vectors.h"

#include <cstdint>
#include <span>

namespace relume {

struct VoxelSurface {
  glm::vec3 albedo{0.5f};    // [0..1]
  glm::vec3 emission{0.0f};  // [W/m²/sr] [0..1e9] of the front, and of the back where doubleSided
  // [0..1] Leaves, fences: the share of this surface's triangles that are there, each of them whole, by a hash of their
  // numbers. Cut what is larger into triangles of about a voxel: of two that make a fence both or none may be there.
  float coverage = 1.0f;
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
  bool moves = false;         // placed anew by move(), every frame if need be
};

// A level. Spans are read while it is handed over; what is needed of them is copied.
struct VoxelGeometry {
  std::span<const VoxelSurface> surfaces;
  std::span<const VoxelMesh> meshes;
  std::span<const VoxelPart> parts;
};

// Where a standing part is from now on, and whether it is there at all.
struct PartEdit {
  std::uint32_t part = 0;
  glm::mat4x3 toWorld{1.0f};
  bool present = true;
};

struct VoxelStats {
  std::uint32_t occupied = 0, dropped = 0;           // voxels; dropped: of these, without sides: they are black
  std::size_t triangles = 0;                         // after splitting
  std::size_t split = 0, outside = 0, zeroArea = 0;  // triangles handed over: cut, out of the box; pieces without area
};

}  // namespace relume
