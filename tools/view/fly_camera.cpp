// SPDX-License-Identifier: MIT
// See fly_camera.h.
#include "tools/view/fly_camera.h"

#include <glm/common.hpp>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

// Beyond it lookAt(), which other pictures of the same view are made by, takes a direction for straight up or down.
constexpr float kSteepestRad = 1.556f;

}  // namespace

FlyCamera FlyCamera::from(const Camera& camera) {
  FlyCamera fly;
  fly.position = glm::vec3(camera.toWorld[3]);
  const glm::vec3 axis(-camera.toWorld[2]);
  const float length = glm::length(axis);
  const glm::vec3 forward = length > 0.0f ? axis / length : glm::vec3(0, 0, -1);
  const float pitch = std::asin(std::clamp(forward.y, -1.0f, 1.0f));
  fly.pitchRad = std::clamp(pitch, -kSteepestRad, kSteepestRad);
  // One that looks straight down is turned to where the top of its picture is, straight up the bottom.
  const glm::vec3 ahead = pitch == fly.pitchRad ? forward : glm::vec3(camera.toWorld[1]) * -glm::sign(pitch);
  fly.yawRad = std::atan2(-ahead.x, -ahead.z);
  fly.yfovRad = camera.orthographic ? 1.0f : camera.yfovRad;
  return fly;
}

glm::vec3 FlyCamera::forward() const {
  return {-std::sin(yawRad) * std::cos(pitchRad), std::sin(pitchRad), -std::cos(yawRad) * std::cos(pitchRad)};
}

glm::vec3 FlyCamera::right() const { return {std::cos(yawRad), 0.0f, -std::sin(yawRad)}; }

void FlyCamera::move(const glm::vec3& step) {
  position += step.x * right() + step.y * glm::vec3(0, 1, 0) + step.z * forward();
}

void FlyCamera::turn(float yaw, float pitch) {
  yawRad += yaw;
  pitchRad = std::clamp(pitchRad + pitch, -kSteepestRad, kSteepestRad);
}

LevelView FlyCamera::view(float aspect, float near, float far) const {
  const glm::vec3 x = right(), z = -forward();
  return {position,
          glm::perspective(yfovRad, aspect, near, far) * glm::mat4(glm::transpose(glm::mat3(x, glm::cross(z, x), z)))};
}

glm::mat4 FlyCamera::clipFromWorld(float aspect, float near, float far) const {
  return view(aspect, near, far).clipFromWorld();
}

}  // namespace relume
