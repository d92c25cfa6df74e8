// SPDX-License-Identifier: MIT
// Directions of rays all around, one set a frame: each set is even, and so are some after each other together, nearly
// as much as one of as many rays. Each lies otherwise in the rings of its lattice and is turned about their axis, by an
// additive recurrence with the square roots of two primes (Richtmyer 1951).
#pragma once

#include "formats/sphere_points.h"

#include <glm/vec3.hpp>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace relume {

// Unit vectors; set 0 is spherePoint().
inline std::vector<glm::vec3> raysOfSet(std::uint32_t count, std::uint32_t set) {
  const double height = 0.5 + std::numbers::sqrt2 * set, turns = std::numbers::sqrt3 * set;
  std::vector<glm::vec3> direction(count);
  for (std::uint32_t i = 0; i < count; ++i) direction[i] = spherePoint(i, count, height - std::floor(height), turns);
  return direction;
}

}  // namespace relume
