// SPDX-License-Identifier: MIT
// What a moving shape shows from far off, along the directions of a small octahedral map: how much of the sphere around
// it it fills, how far before the middle it lies, and which of its patches are seen. Made once, so that a frame sends
// no rays for caches from which a part is small.
#pragma once

#include "formats/octahedron.h"

#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace relume {

struct MovingShape;

inline constexpr std::uint32_t kViewSide = 12, kViews = kViewSide * kViewSide;
inline constexpr std::uint32_t kViewPatches = 4;

struct ShapeView {
  float share = 0.0f;  // of the sphere's disc
  float depth = 0.0f;  // [m] of what is seen before the sphere's middle, in the mean
  // Those patches that are seen most, and the share of each; kNoPatch = the mean of all.
  std::array<std::uint32_t, kViewPatches> patch{};
  std::array<float, kViewPatches> weight{};
};

// The view of a shape along which a way lies that leads from the shape to what sees it, in the shape's axes and of any
// length.
inline std::uint32_t viewAlong(const glm::vec3& way) {
  const glm::vec2 p = toOctahedron(way);
  const glm::ivec2 at = glm::clamp(glm::ivec2((0.5f * kViewSide) * (p + 1.0f)), 0, static_cast<int>(kViewSide) - 1);
  return static_cast<std::uint32_t>(at.y) * kViewSide + static_cast<std::uint32_t>(at.x);
}
// The middle of a view's directions, a unit vector.
inline glm::vec3 directionOfView(std::uint32_t view) {
  const std::uint32_t column = view % kViewSide, row = view / kViewSide;
  const glm::vec2 at(static_cast<float>(column), static_cast<float>(row));
  return fromOctahedron((2.0f / kViewSide) * (at + 0.5f) - 1.0f);
}

// Look at a shape whose other fields are set, and set its views and `ball`.
void makeViews(MovingShape& shape);

}  // namespace relume
