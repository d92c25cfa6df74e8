// SPDX-License-Identifier: MIT
// Directions spread evenly over the sphere, of equal solid angles: the Fibonacci lattice (Gonzalez 2010). Any thread.
#pragma once

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace relume {

// Point i of n, from the pole +z to the pole -z; unit. height: where it lies in its ring, whose solid angle is that of
// one point, from its upper edge on; turns: by how many the lattice is turned about z. [i < n, 0 <= height <= 1]
inline glm::vec3 spherePoint(std::uint32_t i, std::uint32_t n, double height = 0.5, double turns = 0.0) {
  constexpr double kGolden = 0.6180339887498949;
  const double z = 1.0 - 2.0 * (i + height) / n, turn = i * kGolden + turns;
  const double radius = std::sqrt(std::max(1.0 - z * z, 0.0)),
               angle = 2.0 * std::numbers::pi * (turn - std::floor(turn));
  return {static_cast<float>(radius * std::cos(angle)), static_cast<float>(radius * std::sin(angle)),
          static_cast<float>(z)};
}

}  // namespace relume
