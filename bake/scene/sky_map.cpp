// SPDX-License-Identifier: MIT
// See sky_map.h.
#include "bake/scene/sky_map.h"

#include <glm/common.hpp>
#include <glm/gtc/constants.hpp>

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

glm::vec3 SkyMap::radiance(const glm::vec3& direction) const {
  constexpr double kPi = glm::pi<double>();
  const double azimuth = std::atan2(static_cast<double>(direction.x), -static_cast<double>(direction.z));
  const double polar = std::acos(std::clamp(static_cast<double>(direction.y), -1.0, 1.0));
  // A turn counter-clockwise about +Y lowers the azimuth, which grows from -Z toward +X.
  const double column = (0.5 + azimuth / (2 * kPi) + static_cast<double>(rotationDeg) / 360.0) * width - 0.5;
  const Between x = columnsAt(column, width), y = rowsAt(polar / kPi * height - 0.5, height);
  const auto texel = [&](std::uint32_t tx, std::uint32_t ty) { return texels[std::size_t{ty} * width + tx]; };
  return glm::mix(glm::mix(texel(x.first, y.first), texel(x.second, y.first), x.share),
                  glm::mix(texel(x.first, y.second), texel(x.second, y.second), x.share), y.share);
}

SkyMap reducedSky(const SkyMap& map, std::uint32_t maxWidth) {
  const std::uint32_t factor = (map.width + maxWidth - 1) / maxWidth;
  if (factor <= 1) return map;
  SkyMap small{(map.width + factor - 1) / factor, (map.height + factor - 1) / factor, {}, map.rotationDeg};
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

SkyMap unrotatedSky(const SkyMap& map, std::uint32_t width) {
  constexpr double kPi = glm::pi<double>();
  SkyMap even{width, std::max(1u, width / 2), {}, 0.0f};
  even.texels.reserve(std::size_t{even.width} * even.height);
  for (std::uint32_t y = 0; y < even.height; ++y) {
    const double polar = kPi * (y + 0.5) / even.height;
    for (std::uint32_t x = 0; x < even.width; ++x) {
      const double azimuth = 2 * kPi * ((x + 0.5) / even.width - 0.5);
      even.texels.push_back(map.radiance(
          glm::vec3(std::sin(polar) * std::sin(azimuth), std::cos(polar), -std::sin(polar) * std::cos(azimuth))));
    }
  }
  return even;
}

}  // namespace relume
