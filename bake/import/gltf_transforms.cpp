// SPDX-License-Identifier: MIT
// See gltf_transforms.h. glTF 2.0, section 3.5.3; KHR_lights_punctual.
#include "bake/import/gltf_transforms.h"

#include "bake/scene/unit_vector.h"

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/mat3x3.hpp>

#include <cmath>
#include <cstddef>

namespace relume {

glm::dquat rotationOf(const std::vector<double>& xyzw) {
  if (xyzw.size() != 4) return glm::dquat(1.0, 0.0, 0.0, 0.0);
  const glm::dquat q(xyzw[3], xyzw[0], xyzw[1], xyzw[2]);
  const double length = glm::length(q);
  return length > 0.0 && std::isfinite(length) ? q / length : glm::dquat(1.0, 0.0, 0.0, 0.0);
}

glm::dmat4 localTransform(const tinygltf::Node& node) {
  glm::dmat4 m(1.0);
  if (node.matrix.size() == 16) {
    for (int i = 0; i < 16; ++i) m[i / 4][i % 4] = node.matrix[static_cast<std::size_t>(i)];
    return m;
  }
  if (node.translation.size() == 3)
    m = glm::translate(m, glm::dvec3(node.translation[0], node.translation[1], node.translation[2]));
  m *= glm::mat4_cast(rotationOf(node.rotation));
  if (node.scale.size() == 3) m = glm::scale(m, glm::dvec3(node.scale[0], node.scale[1], node.scale[2]));
  return m;
}

// The columns of a matrix are the rotation's axes, each times its scale. A matrix that mirrors does not tell which of
// the scales are negative: X or Y is taken to be, so that a light goes with the shapes beside it.
glm::dvec3 lightAxis(const tinygltf::Node& node) {
  if (node.matrix.size() != 16) return glm::mat3_cast(rotationOf(node.rotation))[2];
  const glm::dmat3 m(localTransform(node));
  const glm::dvec3 z = unitVector(m[2]);
  return z == glm::dvec3(0.0) ? unitVector(glm::cross(unitVector(m[0]), unitVector(m[1]))) : z;
}

}  // namespace relume
