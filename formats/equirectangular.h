// SPDX-License-Identifier: MIT
// Directions on an equirectangular map: row 0 at +Y, the middle of a row at -Z, columns turning toward +X.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relume {

// Place of a unit direction as fractions of the width and the height. [0..1]
inline glm::dvec2 toEquirectangular(const glm::vec3& direction) {
  constexpr double kPi = std::numbers::pi;
  return {0.5 + std::atan2(static_cast<double>(direction.x), -static_cast<double>(direction.z)) / (2 * kPi),
          std::acos(std::clamp(static_cast<double>(direction.y), -1.0, 1.0)) / kPi};
}

// The unit direction at such a place.
inline glm::vec3 fromEquirectangular(const glm::dvec2& place) {
  constexpr double kPi = std::numbers::pi;
  const double azimuth = 2 * kPi * (place.x - 0.5), polar = kPi * place.y;
  return {std::sin(polar) * std::sin(azimuth), std::cos(polar), -std::sin(polar) * std::cos(azimuth)};
}

}  // namespace relume
