// SPDX-License-Identifier: MIT
// Rays through the bits of a voxel grid, exactly: every voxel that a ray passes is looked at, in the ray's order
// (Amanatides and Woo 1987), and empty bricks are crossed in one step without changing which voxels are met.
//
// The ray crosses plane k of an axis at t = (k - origin) / direction, the same number wherever it is asked for, and
// crossings at one t happen in the order of the axes. So the voxels of a walk by bricks are those of a walk by voxels,
// and so are the sub-voxels that a ray passes within them.
#pragma once

#include "runtime/voxels/voxel_grid.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace relume {

struct MarchHit {
  glm::ivec3 voxel{0};
  float t = std::numeric_limits<float>::infinity();  // [voxels] where the ray enters it; 0 = it starts there
  bool found = false;
  unsigned subVoxel = 0;  // brickBit() of that in which the ray ends
  int across = -1;        // a plane of which axis the ray came into that; -1 = it begins there
};

class VoxelMarch {
 public:
  // origin [voxels] and direction [not zero, finite]; t counts in lengths of the direction.
  VoxelMarch(const VolumeGrid& grid, const std::uint64_t* bits, const glm::vec3& origin, const glm::vec3& direction)
      : grid_(grid), bits_(bits), origin_(origin), direction_(direction) {
    for (int a = 0; a < 3; ++a) {
      step_[a] = direction[a] > kSmall ? 1 : direction[a] < -kSmall ? -1 : 0;
      inverse_[a] = step_[a] != 0 ? 1.0f / direction[a] : 1.0f;
      offset_[a] = step_[a] != 0 ? origin[a] : -kNever;
      ahead_[a] = step_[a] > 0 ? -1 : 0;
    }
  }

  // The first voxel set within [0, tMax).
  MarchHit first(float tMax) {
    return walk(tMax, [](const glm::ivec3&, MarchHit&) { return true; });
  }
  // The first that has a sub-voxel in the ray's way within [0, tMax). subVoxelsOf(voxel): which are, by brickBit()
  template <class SubVoxelsOf>
  MarchHit first(float tMax, const SubVoxelsOf& subVoxelsOf) {
    return walk(tMax, [&](const glm::ivec3& v, MarchHit& hit) { return meets(v, subVoxelsOf(v), tMax, hit); });
  }

 private:
  static constexpr float kSmall = 1e-12f;
  static constexpr float kNever = std::numeric_limits<float>::infinity();

  // The first voxel set where the ray stops.
  template <class Stops>
  MarchHit walk(float tMax, const Stops& stops) {
    MarchHit hit;
    glm::ivec3 v;
    if (!enter(v, tMax)) return hit;
    const glm::ivec3 size = grid_.voxels();
    for (;;) {
      const std::uint64_t brick = bits_[grid_.cellOf(v)];
      if (brick == 0) {
        if (!leaveBrick(v)) return hit;
      } else {
        // Walk by voxels until the brick is left.
        const int x = v.x >> 2, y = v.y >> 2, z = v.z >> 2;
        do {
          if ((brick >> brickBit(v) & 1u) != 0 && stops(v, hit)) {
            hit.voxel = v;
            hit.t = t_;
            hit.found = true;
            return hit;
          }
          if (!stepVoxel(v) || t_ >= tMax) return hit;
        } while ((v.x >> 2) == x && (v.y >> 2) == y && (v.z >> 2) == z);
      }
      if (t_ >= tMax || v.x < 0 || v.y < 0 || v.z < 0 || v.x >= size.x || v.y >= size.y || v.z >= size.z) return hit;
    }
  }

  // When the ray leaves the slab of voxels [low, low + size) of an axis.
  // An axis along which the ray does not go is never crossed: offset_ is infinite there and inverse_ is 1.
  float exitTime(int axis, int low, int size) const {
    return (static_cast<float>(low + (ahead_[axis] & size)) - offset_[axis]) * inverse_[axis];
  }

  // The voxel in which the ray is when it is in the grid first.
  bool enter(glm::ivec3& v, float tMax) {
    const glm::ivec3 size = grid_.voxels();
    t_ = 0.0f;
    int axis = -1;
    for (int a = 0; a < 3; ++a) {
      if (origin_[a] >= 0.0f && origin_[a] < static_cast<float>(size[a])) continue;
      const bool below = origin_[a] < 0.0f;
      if (!(below ? step_[a] > 0 : step_[a] < 0)) return false;  // NaN as well
      const float t = ((below ? 0.0f : static_cast<float>(size[a])) - origin_[a]) * inverse_[a];
      if (t >= t_) {
        t_ = t;
        axis = a;
      }
    }
    if (!(t_ < tMax)) return false;
    entered_ = axis;
    for (int a = 0; a < 3; ++a) {
      const float at = origin_[a] + t_ * direction_[a];
      // Rounding may put the place of entry a little outside.
      if (axis >= 0 && (at < -0.5f || at > static_cast<float>(size[a]) + 0.5f)) return false;
      v[a] = glm::clamp(static_cast<int>(std::floor(at)), 0, size[a] - 1);
      if (a == axis) v[a] = step_[a] > 0 ? 0 : size[a] - 1;
    }
    return true;
  }

  // Of the axes that are crossed at these times, the first.
  static int firstAxis(float x, float y, float z) { return y < x ? (z < y ? 2 : 1) : (z < x ? 2 : 0); }

  // Into the next voxel; false where the ray goes nowhere.
  bool stepVoxel(glm::ivec3& v) {
    const float x = exitTime(0, v.x, 1), y = exitTime(1, v.y, 1), z = exitTime(2, v.z, 1);
    const int axis = firstAxis(x, y, z);
    t_ = axis == 0 ? x : axis == 1 ? y : z;
    entered_ = axis;
    v[axis] += step_[axis];
    return t_ < kNever;
  }

  // Into the voxel that the walk by voxels meets first behind this brick.
  bool leaveBrick(glm::ivec3& v) {
    const glm::ivec3 low(v.x & ~3, v.y & ~3, v.z & ~3);
    const float x = exitTime(0, low.x, kBrickSide), y = exitTime(1, low.y, kBrickSide),
                z = exitTime(2, low.z, kBrickSide);
    const int axis = firstAxis(x, y, z);
    const float t = t_ = axis == 0 ? x : axis == 1 ? y : z;
    if (!(t < kNever)) return false;
    for (int a = 0; a < 3; ++a) {
      if (a == axis || step_[a] == 0) continue;
      // A guess, then as many crossings as come before this one.
      const int first = v[a], last = step_[a] > 0 ? low[a] + kBrickSide - 1 : low[a];
      int at = static_cast<int>(origin_[a] + t * direction_[a]);
      at = std::max(std::min(at, std::max(first, last)), std::min(first, last));
      while (at != last && isBefore(a, exitTime(a, at, 1), axis, t)) at += step_[a];
      while (at != first && !isBefore(a, exitTime(a, at - step_[a], 1), axis, t)) at -= step_[a];
      v[a] = at;
    }
    v[axis] = step_[axis] > 0 ? low[axis] + kBrickSide : low[axis] - 1;
    entered_ = axis;
    return true;
  }

  // Whether the ray, which has just entered this voxel, meets one of these sub-voxels before it leaves it or ends.
  bool meets(const glm::ivec3& v, std::uint64_t subVoxels, float tMax, MarchHit& hit) const {
    glm::ivec3 s;
    for (int a = 0; a < 3; ++a) {
      const int low = kBrickSide * v[a], high = low + kBrickSide - 1, last = step_[a] > 0 ? high : low;
      const float begins = std::floor(static_cast<float>(kBrickSide) * origin_[a]);
      s[a] = static_cast<int>(glm::clamp(begins, static_cast<float>(low), static_cast<float>(high)));
      if (entered_ < 0 || a == entered_ || step_[a] == 0) continue;
      while (s[a] != last && isBefore(a, subExitTime(a, s[a]), entered_, t_)) s[a] += step_[a];
    }
    hit.across = entered_;
    for (;;) {
      hit.subVoxel = brickBit(s);
      if (subVoxels >> hit.subVoxel & 1u) return true;
      const float x = subExitTime(0, s.x), y = subExitTime(1, s.y), z = subExitTime(2, s.z);
      const int axis = firstAxis(x, y, z);
      if (!((axis == 0 ? x : axis == 1 ? y : z) < tMax)) return false;
      s[axis] += step_[axis];
      hit.across = axis;
      if (s[axis] >> 2 != v[axis]) return false;
    }
  }
  float subExitTime(int axis, int sub) const {
    return (static_cast<float>(sub + (ahead_[axis] & 1)) / static_cast<float>(kBrickSide) - offset_[axis]) *
           inverse_[axis];
  }
  static bool isBefore(int axisA, float a, int axisB, float b) { return a < b || (a == b && axisA < axisB); }

  const VolumeGrid& grid_;
  const std::uint64_t* bits_;
  glm::vec3 origin_, direction_, inverse_{0.0f}, offset_{0.0f};
  glm::ivec3 step_{0}, ahead_{0};  // ahead_: all bits where the ray goes up
  float t_ = 0.0f;
  int entered_ = -1;  // across a plane of which axis the ray came into the voxel; -1 = it begins there
};

}  // namespace relume
