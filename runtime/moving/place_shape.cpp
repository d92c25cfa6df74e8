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

float ShapePlace::viewShare(const MovingShape& shape) const {
  const float size = shape.radius / sphere.radius;
  return std::abs(glm::determinant(glm::mat3(toWorld[0], toWorld[1], toWorld[2]))) * size * size;
}

bool placeShape(const MovingShape& shape, const glm::mat4x3& toWorld, bool emits, ShapePlace& place) {
  const glm::mat3 linear(toWorld[0], toWorld[1], toWorld[2]);
  if (!(std::abs(glm::determinant(glm::dmat3(linear))) > 0.0)) return false;  // hosts may trap a division by zero
  const glm::dmat3 inverse = glm::inverse(glm::dmat3(linear));
  for (int k = 0; k < 3; ++k) {
    if (!(glm::length(inverse[k]) < 1e12)) return false;  // NaN as well
  }
  place.toWorld = toWorld;
  place.toShape = glm::mat3(inverse);
  place.toGrid = place.toShape / shape.grid.voxel;
  place.sphere.centre = linear * shape.centre + toWorld[3];
  const float scale = largestScale(linear);
  place.sphere.radius = scale * shape.radius;
  // Not flattened either
  const bool isFlattened = std::abs(glm::determinant(linear)) < 0.9f * scale * scale * scale;
  place.sphere.ball = isFlattened ? 0.0f : scale * shape.ball;
  place.sphere.emits = emits && shape.emits;
  return true;
}

}  // namespace relume
