// SPDX-License-Identifier: MIT
// See camera_rays.h.
#include "bake/scene/camera_rays.h"

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <cmath>

namespace relume {
namespace {

glm::vec3 axis(const glm::mat4& m, int column) {
  const glm::vec3 v(m[column]);
  const float length = glm::length(v);
  return length > 0.0f ? v / length : v;
}

}  // namespace

CameraRays::CameraRays(const Camera& camera, std::uint32_t w, std::uint32_t h)
    : origin(camera.toWorld[3]),
      forward(-axis(camera.toWorld, 2)),
      orthographic(camera.orthographic),
      width(static_cast<float>(w)),
      height(static_cast<float>(h)) {
  const float halfHeight = camera.orthographic ? camera.yMag : std::tan(0.5f * camera.yfovRad);
  right = axis(camera.toWorld, 0) * (halfHeight * width / height);
  up = axis(camera.toWorld, 1) * halfHeight;
}

void CameraRays::at(float x, float y, glm::vec3& originWorld, glm::vec3& direction) const {
  const glm::vec3 offset = right * (2.0f * x / width - 1.0f) + up * (1.0f - 2.0f * y / height);
  originWorld = orthographic ? origin + offset : origin;
  direction = orthographic ? forward : glm::normalize(forward + offset);
}

}  // namespace relume
