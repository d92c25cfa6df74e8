// SPDX-License-Identifier: MIT
// A camera that flies: a position, and a direction as two angles. It does not roll, and looks almost straight up and
// down at most.
#pragma once

#include "relume/bake/scene.h"
#include "tools/gl_scene/level_view.h"

#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>

namespace relume {

struct FlyCamera {
  glm::vec3 position{0.0f};  // [m]
  float yawRad = 0.0f;       // 0 = along -Z, positive turns left
  float pitchRad = 0.0f;     // positive looks up
  float yfovRad = 1.0f;

  bool operator==(const FlyCamera& other) const = default;

  // A camera that rolls is put upright; an orthographic one has a perspective.
  static FlyCamera from(const Camera& camera);
  glm::vec3 forward() const;
  glm::vec3 right() const;
  // Move along its own axes: x right, y up, z forward [m].
  void move(const glm::vec3& step);
  void turn(float yaw, float pitch);
  // From its position, for a target of that aspect; near and far planes [m].
  LevelView view(float aspect, float near, float far) const;
  glm::mat4 clipFromWorld(float aspect, float near, float far) const;
};

}  // namespace relume
