// SPDX-License-Identifier: MIT
// Directions as files give them: of any length that a number can have.
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>

namespace relume {

// v / |v|, scaled first so that the squares of large and small components neither overflow nor vanish. Zero when v is
// zero or not finite.
inline glm::dvec3 unitVector(const glm::dvec3& v) {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(largest > 0.0) || !std::isfinite(largest) || std::isnan(v.x + v.y + v.z)) return glm::dvec3(0.0);
  return glm::normalize(v / largest);
}

}  // namespace relume
