// SPDX-License-Identifier: MIT
// See place_shape.h.
#include "runtime/moving/place_shape.h"

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

// The largest factor by which a transform lengthens, or a little more: exact for rotations and uniform scales, else the
// largest row sum of its Gram matrix bounds the largest eigenvalue.
float largestScale(const glm::mat3& m) {
  const glm::mat3 gram = glm::transpose(m) * m;
  float largest = 0.0f;
  for (int k = 0; k < 3; ++k)
    largest = std::max(largest, std::abs(gram[k].x) + std::abs(gram[k].y) + std::abs(gram[k].z));
  return std::sqrt(largest);
}

}  // namespace

bool placeShape(const MovingShape& shape, const glm::mat4x3& toWorld, ShapePlace& place) {
  const glm::mat3 linear(toWorld[0], toWorld[1], toWorld[2]);
  const glm::dmat3 inverse = glm::inverse(glm::dmat3(linear));
  for (int k = 0; k < 3; ++k) {
    // NaN as well, which is what zero divided by zero gives.
    if (!(glm::length(inverse[k]) < 1e12)) return false;
  }
  place.toWorld = toWorld;
  place.toShape = glm::mat3(inverse);
  place.toGrid = place.toShape / shape.grid.voxel;
  place.centre = linear * shape.centre + toWorld[3];
  place.radius = largestScale(linear) * shape.radius;
  return true;
}

}  // namespace relume
