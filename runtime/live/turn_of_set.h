// SPDX-License-Identifier: MIT
// Turns of the sphere for sets of rays, one set a frame.
#pragma once

#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>

#include <cmath>
#include <cstdint>
#include <numbers>

namespace relume {

// A turn of the sphere for a set of rays (Shoemake 1992), from the additive recurrence of Roberts' R3 sequence: as even
// over time as directions are over the sphere. Set 0 is not turned.
inline glm::mat3 turnOfSet(std::uint32_t set) {
  if (set == 0) return glm::mat3(1.0f);
  const auto part = [set](double step) {
    const double v = 0.5 + step * set;
    return v - std::floor(v);
  };
  const double u = part(0.8191725133961645), v = part(0.6710436067037893), w = part(0.5497004779019703);
  const double a = std::sqrt(1.0 - u), b = std::sqrt(u), tau = 2.0 * std::numbers::pi;
  const glm::dquat turn(b * std::cos(tau * w), a * std::sin(tau * v), a * std::cos(tau * v), b * std::sin(tau * w));
  return glm::mat3(glm::mat3_cast(turn));
}

}  // namespace relume
