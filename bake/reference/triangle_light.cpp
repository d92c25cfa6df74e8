// SPDX-License-Identifier: MIT
// See triangle_light.h. In double: for a triangle that is small from afar the edges' terms all but cancel.
#include "bake/reference/triangle_light.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <cstddef>

namespace relume {
namespace {

// A triangle that two planes have cut has at most five corners, six where it lies in a plane but for rounding.
struct Convex {
  std::array<glm::dvec3, 6> corner{};
  std::size_t count = 0;

  void add(const glm::dvec3& p) { corner[count++] = p; }
};

Convex cutAbove(const Convex& whole, const glm::dvec3& normal) {
  Convex part;
  for (std::size_t i = 0; i < whole.count; ++i) {
    const glm::dvec3 &a = whole.corner[i], &b = whole.corner[(i + 1) % whole.count];
    const double heightA = glm::dot(a, normal), heightB = glm::dot(b, normal);
    if (heightA >= 0.0) part.add(a);
    if ((heightA >= 0.0) != (heightB >= 0.0)) part.add(a + (b - a) * (heightA / (heightA - heightB)));
  }
  return part;
}

}  // namespace

glm::dvec3 lambertArc(const glm::dvec3& from, const glm::dvec3& to) {
  const glm::dvec3 across = glm::cross(from, to);
  const double sine = glm::length(across);
  return sine > 0.0 ? across * (std::atan2(sine, glm::dot(from, to)) / sine) : glm::dvec3(0.0);
}

float openTriangleLight(const std::array<glm::vec3, 3>& corners, const glm::vec3& shading, const glm::vec3& geometric) {
  Convex seen;
  for (const glm::vec3& c : corners) seen.add(c);
  seen = cutAbove(seen, shading);
  if (geometric != shading) seen = cutAbove(seen, geometric);
  glm::dvec3 twice(0.0);
  for (std::size_t i = 0; i < seen.count; ++i) twice += lambertArc(seen.corner[i], seen.corner[(i + 1) % seen.count]);
  return static_cast<float>(0.5 * std::abs(glm::dot(twice, glm::dvec3(shading))));
}

}  // namespace relume
