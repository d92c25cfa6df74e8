// SPDX-License-Identifier: MIT
// A moving mesh as the passes read it (relume/moving_shapes.h): bits of its surface in its own axes, and patches of it
// that are lit once a frame.
#pragma once

#include "runtime/moving/shape_views.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace relume {

// Bricks on the longest side, and bricks on the side of a box of patches.
inline constexpr std::uint32_t kShapeBricks = 8;
inline constexpr int kPatchBricks = 2;
// Patches of a box: surfaces that face +x, -x, +y, -y, +z, -z more than any other of these.
inline constexpr std::uint32_t kPatchFacings = 6;
inline constexpr std::uint32_t kNoPatch = 0xFFFFFFFFu;

// Means by area over the surfaces of a box that face alike, in the shape's axes.
struct ShapePatch {
  glm::vec3 position{0.0f};  // [m]
  glm::vec3 normal{0.0f};    // unit
  glm::vec3 albedo{0.0f};
  glm::vec3 emission{0.0f};  // [W/m²/sr]
  float area = 0.0f;         // relative to the shape's other patches
};

struct MovingShape {
  VolumeGrid grid;
  std::vector<std::uint64_t> bits;  // [Size cells] brickBit() of each voxel that the surface passes
  glm::vec3 centre{0.0f};           // [m] of a sphere around all triangles
  float radius = 0.0f;              // [m]
  float ball = 0.0f;                // [m] radius of a ball of its outline, where that fills the sphere's; else 0
  bool emits = false;
  glm::ivec3 boxes{1};                 // of patches, along each axis
  std::vector<std::uint32_t> patchOf;  // [Size boxes * kPatchFacings] index of the patch, or kNoPatch
  std::vector<ShapePatch> patch;
  std::vector<ShapeView> view;  // [Size kViews]

  // Where the patches of a voxel's box are in patchOf. [within grid]
  std::size_t firstPatch(const glm::ivec3& voxel) const {
    constexpr int kShift = 3;  // log2 of the voxels on a box's side
    static_assert(kPatchBricks * kBrickSide == 1 << kShift);
    const int at = ((voxel.z >> kShift) * boxes.y + (voxel.y >> kShift)) * boxes.x + (voxel.x >> kShift);
    return kPatchFacings * static_cast<std::size_t>(at);
  }
  // Of a voxel's box the patch that faces a ray of this direction most, of any length; kNoPatch = none does.
  std::uint32_t patchToward(const glm::ivec3& voxel, const glm::vec3& direction) const {
    const std::size_t first = firstPatch(voxel);
    std::uint32_t found = kNoPatch;
    float best = 0.0f;
    for (std::size_t i = 0; i < kPatchFacings; ++i) {
      const std::uint32_t each = patchOf[first + i];
      if (each == kNoPatch) continue;
      const float facing = -glm::dot(direction, patch[each].normal);
      if (facing <= best) continue;
      best = facing;
      found = each;
    }
    return found;
  }
};

// Index among kPatchFacings of the axis that a normal is nearest to.
inline std::uint32_t facingOf(const glm::vec3& normal) {
  const glm::vec3 size(normal.x < 0 ? -normal.x : normal.x, normal.y < 0 ? -normal.y : normal.y,
                       normal.z < 0 ? -normal.z : normal.z);
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  return 2 * static_cast<std::uint32_t>(axis) + (normal[axis] < 0.0f ? 1 : 0);
}

}  // namespace relume
