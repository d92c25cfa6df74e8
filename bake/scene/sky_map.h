// SPDX-License-Identifier: MIT
// A sky that differs by direction: radiance in an equirectangular map. Row 0 is at +Y, the middle of a row at -Z, and
// columns turn toward +X, as projectEnvironment() (relume/relighter.h) has it.
#pragma once

#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace relume {

struct SkyMap {
  std::uint32_t width = 0, height = 0;  // [1..16384] texels
  std::vector<glm::vec3> texels;        // [W/m²/sr] [Size width * height] finite, >= 0
  float rotationDeg = 0.0f;             // the sky turns so far about +Y, counter-clockwise seen from above

  // Radiance from a unit direction, bilinear between texels. Around the poles the nearest row stays.
  glm::vec3 radiance(const glm::vec3& direction) const;
};

// Box filter down to at most so many columns, by whole factors; as it is where it has no more.
SkyMap reducedSky(const SkyMap& map, std::uint32_t maxWidth);

// The map as it would be with rotationDeg 0: `width` columns, half as many rows.
SkyMap unrotatedSky(const SkyMap& map, std::uint32_t width);

}  // namespace relume
