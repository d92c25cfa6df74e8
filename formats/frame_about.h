// SPDX-License-Identifier: MIT
// Two directions across a third (Duff et al. 2017, "Building an Orthonormal Basis, Revisited"). Any thread.
#pragma once

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <cmath>

namespace relume {

// An orthonormal, right-handed frame whose third column is the unit vector n.
inline glm::mat3 frameAbout(const glm::vec3& n) {
  const float sign = std::copysign(1.0f, n.z), a = -1.0f / (sign + n.z), b = n.x * n.y * a;
  return {{1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

}  // namespace relume
