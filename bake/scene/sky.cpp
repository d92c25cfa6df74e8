// SPDX-License-Identifier: MIT
// See sky.h.
#include "bake/scene/sky.h"

#include "formats/equirectangular.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

// Where a column's or a row's neighbours are, and how far the value lies toward the second.
struct Between {
  std::uint32_t first, second;
  float share;
};

// `at` in texels from the first one's centre; columns wrap around.
Between columnsAt(double at, std::uint32_t width) {
  const double low = std::floor(at);
  const auto wrap = [width](double column) {
    const double turned = column - width * std::floor(column / width);
    return std::min(static_cast<std::uint32_t>(turned), width - 1);
  };
  return {wrap(low), wrap(low + 1.0), static_cast<float>(at - low)};
}

Between rowsAt(double at, std::uint32_t height) {
  const double clamped = std::clamp(at, 0.0, height - 1.0), low = std::floor(clamped);
  const auto first = static_cast<std::uint32_t>(low);
  return {first, std::min(first + 1, height - 1), static_cast<float>(clamped - low)};
}

}  // namespace

SkyMap reducedSky(const SkyMap& map, std::uint32_t maxWidth) {
  const std::uint32_t factor = (map.width + maxWidth - 1) / maxWidth;
  if (factor <= 1) return map;
  SkyMap small{(map.width + factor - 1) / factor, (map.height + factor - 1) / factor, {}};
  small.texels.resize(std::size_t{small.width} * small.height);
  for (std::uint32_t y = 0; y < small.height; ++y) {
    for (std::uint32_t x = 0; x < small.width; ++x) {
      glm::dvec3 sum(0.0);
      double count = 0.0;
      for (std::uint32_t row = y * factor; row < std::min((y + 1) * factor, map.height); ++row) {
        for (std::uint32_t column = x * factor; column < std::min((x + 1) * factor, map.width); ++column) {
          sum += glm::dvec3(map.texels[std::size_t{row} * map.width + column]);
          count += 1.0;
        }
      }
      small.texels[std::size_t{y} * small.width + x] = glm::vec3(sum / count);
    }
  }
  return small;
}

glm::vec3 Sky::along(const glm::vec3& direction) const {
  if (!map) return below ? glm::mix(*below, radiance, 0.5f + 0.5f * direction.y) : radiance;
  const std::uint32_t width = map->width;
  const glm::dvec2 place = toEquirectangular(direction);
  // A turn counter-clockwise about +Y brings what lies farther along the row.
  const Between x = columnsAt((place.x + static_cast<double>(rotationDeg) / 360.0) * width - 0.5, width),
                y = rowsAt(place.y * map->height - 0.5, map->height);
  const auto texel = [&](std::uint32_t tx, std::uint32_t ty) { return map->texels[std::size_t{ty} * width + tx]; };
  return glm::mix(glm::mix(texel(x.first, y.first), texel(x.second, y.first), x.share),
                  glm::mix(texel(x.first, y.second), texel(x.second, y.second), x.share), y.share);
}

}  // namespace relume
