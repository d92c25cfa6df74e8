// SPDX-License-Identifier: MIT
// A sphere of triangles about the origin.
#pragma once

#include <glm/vec3.hpp>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace relume::test {

struct Ball {
  std::vector<glm::vec3> position;
  std::vector<glm::uvec3> triangle;

  // [around even, >= 4] vertices of the equator.
  Ball(float radius, std::uint32_t around) {
    const std::uint32_t up = around / 2;
    const float step = 2.0f * std::numbers::pi_v<float> / static_cast<float>(around);
    for (std::uint32_t j = 0; j <= up; ++j) {
      for (std::uint32_t i = 0; i <= around; ++i) {
        const float a = step * static_cast<float>(i), b = step * static_cast<float>(j);
        position.push_back(radius * glm::vec3(std::sin(b) * std::cos(a), std::cos(b), std::sin(b) * std::sin(a)));
      }
    }
    for (std::uint32_t j = 0; j < up; ++j) {
      for (std::uint32_t i = 0; i < around; ++i) {
        const std::uint32_t k = j * (around + 1) + i;
        triangle.push_back({k, k + 1, k + around + 1});
        triangle.push_back({k + 1, k + around + 2, k + around + 1});
      }
    }
  }
};

}  // namespace relume::test
