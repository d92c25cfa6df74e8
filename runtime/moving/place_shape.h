// SPDX-License-Identifier: MIT
// A moving shape as it stands in a frame: the way into its grid, and the sphere around it.
#pragma once

#include "runtime/moving/moving_shape.h"
#include "runtime/shared/look_turns.h"

#include <glm/mat3x3.hpp>
#include <glm/mat4x3.hpp>
#include <glm/vec3.hpp>

namespace relume {

struct ShapePlace {
  glm::mat4x3 toWorld{1.0f};
  glm::mat3 toShape{1.0f};  // of directions
  glm::mat3 toGrid{1.0f};   // of directions [voxels/m]
  PartSphere sphere;

  // A body's outline times its length along a view is what its volume is multiplied with: ShapeView::share times
  // viewShare() over that length is the share of the sphere's disc here.
  float viewShare(const MovingShape& shape) const;
  float viewDepth(const MovingShape& shape) const { return sphere.radius / shape.radius; }
};

// False where its transform has no inverse. emits: emissionScale is not zero.
bool placeShape(const MovingShape& shape, const glm::mat4x3& toWorld, bool emits, ShapePlace& place);

}  // namespace relume
