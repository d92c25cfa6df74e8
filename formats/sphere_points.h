// SPDX-License-Identifier: MIT
// Directions spread evenly over the sphere, of equal solid angles: the Fibonacci lattice (Gonzalez 2010). Any thread.
#pragma once

#include <glm/vec3.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace relume {

// Point i of n, from the pole +z to the pole -z; unit. [i < n]
inline glm::vec3 spherePoint(std::uint32_t i, std::uint32_t n) {
  constexpr double kGolden = 0.6180339887498949;
  const double z = 1.0 - (2.0 * i + 1.0) / n, turn = i * kGolden;
  const double radius = std::sqrt(std::max(1.0 - z * z, 0.0)),
               angle = 2.0 * std::numbers::pi * (turn - std::floor(turn));
  return {static_cast<float>(radius * std::cos(angle)), static_cast<float>(radius * std::sin(angle)),
          static_cast<float>(z)};
}

}  // namespace relume
