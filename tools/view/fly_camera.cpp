// SPDX-License-Identifier: MIT
// See fly_camera.h.
#include "tools/view/fly_camera.h"

#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {

FlyCamera FlyCamera::from(const Camera& camera) {
  FlyCamera fly;
  fly.position = glm::vec3(camera.toWorld[3]);
  const glm::vec3 axis(-camera.toWorld[2]);
  const float length = glm::length(axis);
  const glm::vec3 forward = length > 0.0f ? axis / length : glm::vec3(0, 0, -1);
  fly.pitchRad = std::asin(std::clamp(forward.y, -1.0f, 1.0f));
  fly.yawRad = std::atan2(-forward.x, -forward.z);
  fly.yfovRad = camera.orthographic ? 1.0f : camera.yfovRad;
  return fly;
}

glm::vec3 FlyCamera::forward() const {
  return {-std::sin(yawRad) * std::cos(pitchRad), std::sin(pitchRad), -std::cos(yawRad) * std::cos(pitchRad)};
}

void FlyCamera::move(const glm::vec3& step) {
  const glm::vec3 right(std::cos(yawRad), 0.0f, -std::sin(yawRad));
  position += step.x * right + step.y * glm::vec3(0, 1, 0) + step.z * forward();
}

void FlyCamera::turn(float yaw, float pitch) {
  yawRad += yaw;
  pitchRad = std::clamp(pitchRad + pitch, -1.55f, 1.55f);
}

glm::mat4 FlyCamera::clipFromWorld(float aspect, float near, float far) const {
  return glm::perspective(yfovRad, aspect, near, far) * glm::lookAt(position, position + forward(), glm::vec3(0, 1, 0));
}

}  // namespace relume
