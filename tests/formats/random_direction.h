// SPDX-License-Identifier: MIT
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <random>

namespace relume {

// Of all directions alike.
inline glm::vec3 randomDirection(std::mt19937& random) {
  std::normal_distribution<float> gauss;
  const float x = gauss(random), y = gauss(random), z = gauss(random);
  return glm::normalize(glm::vec3(x, y, z));
}

}  // namespace relume
