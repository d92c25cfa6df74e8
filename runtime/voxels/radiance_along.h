// SPDX-License-Identifier: MIT
// What a ray meets in a volume and, once it has left that, in the volumes that it lies in (nested_volumes.h).
#pragma once

#include "runtime/voxels/march.h"
#include "runtime/voxels/voxel_volume.h"

#include <glm/common.hpp>
#include <glm/vec3.hpp>
#include <glm/vector_relational.hpp>

#include <limits>
#include <span>

namespace relume {

// Where a ray from within the grid leaves it: a little outside of the face that it crosses. [voxels]
inline glm::vec3 leavePlace(const VolumeGrid& grid, const glm::vec3& origin, const glm::vec3& direction) {
  constexpr float kOutside = 0.01f;  // [voxel]
  const glm::vec3 size(grid.voxels());
  int axis = 0;
  float t = std::numeric_limits<float>::infinity();
  for (int a = 0; a < 3; ++a) {
    if (direction[a] == 0.0f) continue;
    const float at = ((direction[a] > 0.0f ? size[a] : 0.0f) - origin[a]) / direction[a];
    if (at >= t) continue;
    t = at;
    axis = a;
  }
  glm::vec3 place = glm::clamp(origin + t * direction, glm::vec3(0.0f), size);
  place[axis] = direction[axis] > 0.0f ? size[axis] + kOutside : -kOutside;
  return place;
}

// A place in a grid [voxels] in that of the volume that it lies in, whose voxels are twice as large.
inline glm::vec3 placeInOuter(const VolumeGrid& inner, const VolumeGrid& outer, const glm::vec3& place) {
  return 0.5f * place + 0.5f * static_cast<float>(kBrickSide) * glm::vec3(inner.shift - 2 * outer.shift);
}

// Whether a voxel has no free one beside it on the sides from which rays of this direction come: what it holds lies
// behind others, as in the foot of a wall, and may be lit from behind the wall.
inline bool isBehindOthers(const VoxelVolume& volume, const glm::ivec3& voxel, const glm::ivec3& from) {
  for (int a = 0; a < 3; ++a) {
    glm::ivec3 beside = voxel;
    beside[a] += from[a];
    if (!volume.isOccupied(beside)) return false;
  }
  return true;
}

// Radiance of what a ray meets: of the voxel, or where that is behind others of one before it that is not and that does
// not emit: a ceiling a hand above a lamp does not shine as the lamp does.
inline glm::vec3 radianceMet(const VoxelVolume& volume, const MarchHit& hit, const glm::vec3& direction) {
  const glm::ivec3 from = 2 * glm::ivec3(glm::lessThan(direction, glm::vec3(0.0f))) - 1;
  if (volume.isOccupied(hit.voxel) && isBehindOthers(volume, hit.voxel, from)) {
    for (int a = 0; a < 3; ++a) {
      glm::ivec3 beside = hit.voxel;
      beside[a] += from[a];
      if (!isBehindOthers(volume, beside, from) && !volume.emitsAt(beside, direction))
        return volume.radianceAt(beside, direction);
    }
  }
  return volume.radianceAt(hit, direction);
}

// Radiance of what a ray of a volume meets there or beyond, in the last of `beyond` and then in the one before it; else
// the sky's. [position: voxels; direction unit]
inline glm::vec3 radianceAlong(const VoxelVolume& volume, std::span<const VoxelVolume> beyond,
                               const glm::vec3& position, const glm::vec3& direction, const glm::vec3& sky) {
  constexpr float kFar = std::numeric_limits<float>::infinity();
  VoxelMarch march(volume.grid(), volume.rayBits().data(), position, direction);
  const MarchHit hit = march.first(kFar, [&](const glm::ivec3& v) { return volume.subVoxelsIn(v); });
  if (hit.found) return radianceMet(volume, hit, direction);
  if (beyond.empty()) return sky;
  const glm::vec3 left = leavePlace(volume.grid(), position, direction);
  const VoxelVolume& outer = beyond.back();
  return radianceAlong(outer, beyond.first(beyond.size() - 1), placeInOuter(volume.grid(), outer.grid(), left),
                       direction, sky);
}

}  // namespace relume
