// SPDX-License-Identifier: MIT
// The octahedral map: directions on the square [-1,1]², +Z at its middle, -Z at its corners (Meyer et al. 2010).
#pragma once

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <cmath>

namespace relume {

// The two folds of the lower half, each the other's inverse.
inline glm::vec2 foldOctahedron(const glm::vec2& p) {
  return {(1.0f - std::abs(p.y)) * (p.x < 0.0f ? -1.0f : 1.0f), (1.0f - std::abs(p.x)) * (p.y < 0.0f ? -1.0f : 1.0f)};
}

// d: any vector; the middle for zero.
inline glm::vec2 toOctahedron(const glm::vec3& d) {
  const float sum = std::abs(d.x) + std::abs(d.y) + std::abs(d.z);
  if (!(sum > 0.0f)) return glm::vec2(0.0f);
  const glm::vec2 p = glm::vec2(d.x, d.y) / sum;
  return d.z >= 0.0f ? p : foldOctahedron(p);
}

// A unit vector.
inline glm::vec3 fromOctahedron(const glm::vec2& p) {
  const float z = 1.0f - std::abs(p.x) - std::abs(p.y);
  return glm::normalize(glm::vec3(z >= 0.0f ? p : foldOctahedron(p), z));
}

}  // namespace relume
