// SPDX-License-Identifier: MIT
// What a level is drawn for: clip space from places relative to one close by. Far from the world's origin floats are
// coarse; a matrix of the world's own places would add and subtract terms as large as those, and lose what is between.
#pragma once

#include <glm/ext/matrix_transform.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

namespace relume {

struct LevelView {
  glm::vec3 originWorld{0.0f};  // [m] an eye, a light, the level's middle
  glm::mat4 clip{1.0f};         // of places in the world less originWorld

  // For what is not as exact.
  glm::mat4 clipFromWorld() const { return glm::mat4(glm::translate(glm::dmat4(clip), -glm::dvec3(originWorld))); }
};

}  // namespace relume
