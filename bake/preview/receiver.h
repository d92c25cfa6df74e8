// SPDX-License-Identifier: MIT
// What is lit by records.
#pragma once

#include <glm/vec3.hpp>

#include <cmath>

namespace relume {

// A point that is lit by records: what a pixel or a part of it shows.
struct PixelReceiver {
  glm::vec3 positionWorld{0.0f};                  // [m]
  glm::vec3 normal{0.0f}, geometricNormal{0.0f};  // unit, toward the viewer; zero normal: nothing is seen
  float footprint = 0.0f;                         // [m] width of a pixel there
  float occluder = INFINITY;                      // [m] to something in front of the surface, as far as is known
  glm::vec3 bent{0.0f};                           // unit, by a normal map; zero: light is read for `normal`

  const glm::vec3& litNormal() const { return bent == glm::vec3(0.0f) ? normal : bent; }
};

}  // namespace relume
