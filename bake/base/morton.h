// SPDX-License-Identifier: MIT
// Order along a curve through space (Morton 1966): points that are near each other on the curve are near in space.
#pragma once

#include <glm/vec3.hpp>

#include <algorithm>
#include <cstdint>

namespace relume {

inline constexpr float kMaxMortonCoordinate = 2097151.0f;  // 21 bits per axis

// Code along the curve of a cube of space, by its number along each axis [clamped to 0..kMaxMortonCoordinate].
inline std::uint64_t mortonOf(const glm::vec3& cube) {
  std::uint64_t code = 0;
  for (int axis = 0; axis < 3; ++axis) {
    auto v = static_cast<std::uint64_t>(std::clamp(cube[axis], 0.0f, kMaxMortonCoordinate));
    v = (v | v << 32) & 0x1F00000000FFFFull;
    v = (v | v << 16) & 0x1F0000FF0000FFull;
    v = (v | v << 8) & 0x100F00F00F00F00Full;
    v = (v | v << 4) & 0x10C30C30C30C30C3ull;
    v = (v | v << 2) & 0x1249249249249249ull;
    code |= v << axis;
  }
  return code;
}

}  // namespace relume
