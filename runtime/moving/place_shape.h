// SPDX-License-Identifier: MIT
// A moving shape as it stands in a frame: the way into its grid, and the sphere around it.
#pragma once

#include "runtime/moving/moving_shape.h"

#include <glm/mat3x3.hpp>
#include <glm/mat4x3.hpp>
#include <glm/vec3.hpp>

namespace relume {

struct ShapePlace {
  glm::mat4x3 toWorld{1.0f};
  glm::mat3 toShape{1.0f};  // of directions
  glm::mat3 toGrid{1.0f};   // of directions [voxels/m]
  glm::vec3 centre{0.0f};   // [m] of a sphere around it
  float radius = 0.0f;      // [m]
};

// False where its transform has no inverse.
bool placeShape(const MovingShape& shape, const glm::mat4x3& toWorld, ShapePlace& place);

}  // namespace relume
