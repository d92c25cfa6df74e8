// SPDX-License-Identifier: MIT
// The sky as light without a bake sees it: radiance by direction.
#pragma once

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>

namespace relume {

struct LiveSky {
  glm::vec3 radiance{0.0f};  // [W/m²/sr] [0..1e9] from everywhere
  std::span<const glm::vec3>
      map{};               // [W/m²/sr] in place of it: an octahedral map, row 0 at v = -1 (formats/octahedron.h)
  std::uint32_t side = 0;  // [texel] of the map; [Size map: side²]
};

// Radiance from a unit direction: of a map bilinear, across its border the nearest texel. The map has its size.
glm::vec3 skyAlong(const LiveSky& sky, const glm::vec3& direction);

}  // namespace relume
