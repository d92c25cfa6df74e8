// SPDX-License-Identifier: MIT
// How a cone goes through voxels, those of one volume (radiance_mips.h) and of several (nested_cones.h).
#pragma once

#include "formats/limits.h"
#include "runtime/cones/radiance_mips.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>

namespace relume {

inline constexpr float kConeSpent = 0.01f;  // a cone ends where no more of it is clear
inline constexpr float kConeClear = 1.75f;  // [voxels] above its own plane a cone begins
inline constexpr float kConePlane = 2.5f;   // [sample widths] least height above the cone's own plane
inline constexpr float kConeNear = 3.0f;    // [voxels] from its start a cone may be in the voxels of walls beside it
inline constexpr float kConeStep = 0.5f;    // [sample widths]
// Voxels before the grid from which on a cone finds nothing: steps of half a voxel of the innermost of four volumes
// would no longer change how far it has come.
inline constexpr float kConeFarthest = 524288.0f;

// Whether its numbers are finite and in their range.
inline bool isValidCone(const Cone& cone) {
  const auto isUnit = [](const glm::vec3& v) { return std::abs(glm::dot(v, v) - 1.0f) < 0.01f; };
  return isWithin(cone.originWorld, kMaxCoordinate) && isUnit(cone.normal) && isUnit(cone.direction) &&
         cone.spread >= 0.0f && cone.falloff >= 0.0f && std::isfinite(cone.spread) && std::isfinite(cone.falloff);
}

// Where along a ray the grid lies, a voxel more on all sides; end <= begin where it does not, or too far away.
inline void clipToGrid(const VolumeGrid& grid, const glm::vec3& origin, const glm::vec3& direction, float& begin,
                       float& end) {
  for (int k = 0; k < 3; ++k) {
    const float low = -1.0f - origin[k], high = static_cast<float>(grid.voxels()[k]) + 1.0f - origin[k];
    if (std::abs(direction[k]) < 1e-9f) {
      if (low > 0.0f || high < 0.0f) end = begin;
      continue;
    }
    const float a = low / direction[k], b = high / direction[k];
    begin = std::max(begin, std::min(a, b));
    end = std::min(end, std::max(a, b));
  }
  if (!(begin < kConeFarthest)) end = begin;
}

// What a cone found that has come to its end: of one that is spent nothing is left.
inline ConeLight endedCone(ConeLight light) {
  if (light.clear > kConeSpent) return light;
  return {light.radiance / (1.0f - light.clear), 0.0f, light.occlusion / (1.0f - light.clear)};
}

}  // namespace relume
