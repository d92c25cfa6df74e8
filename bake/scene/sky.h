// SPDX-License-Identifier: MIT
// The sky as tools see it: one radiance from everywhere, one from above and one from below, or a map of it by
// direction.
#pragma once

#include <glm/vec3.hpp>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

namespace relume {

// Equirectangular (formats/equirectangular.h).
struct SkyMap {
  std::uint32_t width = 0, height = 0;  // [1..16384] texels
  std::vector<glm::vec3> texels;        // [W/m²/sr] [Size width * height] finite, >= 0
};

// Box filter down to at most so many columns, by whole factors; as it is where it has no more.
SkyMap reducedSky(const SkyMap& map, std::uint32_t maxWidth);

struct Sky {
  glm::vec3 radiance{0.0f};           // [W/m²/sr] from everywhere, or from overhead
  std::optional<glm::vec3> below;     // [W/m²/sr] from underfoot, by height between the two; empty: `radiance`
  std::shared_ptr<const SkyMap> map;  // in place of `radiance`; null = none
  float rotationDeg = 0.0f;           // the map turns so far about +Y, counter-clockwise seen from above

  bool isDark() const {
    return !map && radiance == glm::vec3(0.0f) && below.value_or(glm::vec3(0.0f)) == glm::vec3(0.0f);
  }
  // Whether it is the same in all directions.
  bool isConstant() const { return !map && !below; }
  // Radiance from a unit direction: of a map, bilinear between texels; around the poles the nearest row stays.
  glm::vec3 along(const glm::vec3& direction) const;
};

}  // namespace relume
