// SPDX-License-Identifier: MIT
// Whether light gets through the voxels on its way to a cell (CRC Section 6): by jittered samples of the way, as
// printed, or by every voxel on it (runtime/voxels/march.h).
#pragma once

#include "runtime/voxels/march.h"
#include "runtime/voxels/voxel_grid.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>

namespace relume {

enum class CellVisibility {
  none,     // nothing hides anything
  sampled,  // a few jittered samples: thin walls are missed by chance
  exact,    // all voxels on the way
};

// A number [0..1) for each pair of a cell and a ray: the fractions of multiples of irrational numbers (Weyl 1916).
inline float jitterOf(std::uint32_t cell, std::uint32_t ray) {
  return static_cast<float>((cell * 2654435769u + ray * 3242174889u) >> 8) * 0x1p-24f;
}

// Bits of the voxels that hide, and how they are looked at.
struct CellOcclusion {
  const VolumeGrid& grid;
  std::span<const std::uint64_t> bits;  // [Size cells]
  CellVisibility mode = CellVisibility::sampled;
  std::uint32_t samples = 12;           // [1..64] of a way
  std::span<const glm::vec3> places{};  // [voxels] [Size 0 or cells] where each cell receives light; 0 = anywhere in it

  bool isSet(const glm::vec3& place) const {
    // Places may be as far outside as no int counts.
    const glm::vec3 size(grid.voxels());
    if (!(glm::all(glm::greaterThanEqual(place, glm::vec3(0.0f))) && glm::all(glm::lessThan(place, size))))
      return false;
    const glm::ivec3 v(place);
    return (bits[grid.cellOf(v)] >> brickBit(v) & 1u) != 0;
  }

  // Whether light from X, which lies on a surface with unit normal n, reaches P. `jitter` [0..1). [voxels, finite]
  bool reaches(const glm::vec3& p, const glm::vec3& x, const glm::vec3& n, float jitter) const {
    if (mode == CellVisibility::none) return true;
    if (mode == CellVisibility::exact) {
      // Out of the voxels that the surface's own plane occupies: thin voxels reach so far from it.
      const glm::vec3 size = glm::abs(n);
      const float lift = 0.5f * (std::max({size.x, size.y, size.z}) + size.x + size.y + size.z) + 0.05f;
      const glm::vec3 way = x + lift * n - p;
      return way == glm::vec3(0.0f) || !VoxelMarch(grid, bits.data(), p, way).first(1.0f).found;
    }
    // Both ends stay off what they lie on by a voxel's diagonal, at most 0.4 of the way.
    const glm::vec3 way = x - p;
    const float distance = glm::length(way);
    if (!(distance > 0.0f)) return true;
    const float end = std::min(kDiagonal / distance, 0.4f);
    for (std::uint32_t i = 0; i < samples; ++i) {
      const float t = end + (1.0f - 2.0f * end) * (static_cast<float>(i) + jitter) / static_cast<float>(samples);
      if (isSet(p + t * way)) return false;
    }
    return true;
  }

  // Where a ray meets the first voxel within `far`; false where it meets none. [voxels] [direction unit]
  bool first(const glm::vec3& p, const glm::vec3& direction, float far, float jitter, glm::vec3& x) const {
    if (mode == CellVisibility::exact) {
      const MarchHit hit = VoxelMarch(grid, bits.data(), p, direction).first(far);
      x = p + hit.t * direction;
      return hit.found;
    }
    for (std::uint32_t i = 0; i < samples; ++i) {
      const float t = kDiagonal + (far - kDiagonal) * (static_cast<float>(i) + jitter) / static_cast<float>(samples);
      x = p + t * direction;
      if (isSet(x)) return true;
    }
    return false;
  }

 private:
  static constexpr float kDiagonal = 1.7320508f;  // of a voxel
};

}  // namespace relume
