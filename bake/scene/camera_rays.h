// SPDX-License-Identifier: MIT
// Rays through the pixels of a camera.
#pragma once

#include "relume/bake/scene.h"

#include <glm/vec3.hpp>

#include <cstdint>

namespace relume {

// glTF axes, row 0 on top. Scale in the node's transform is ignored.
struct CameraRays {
  CameraRays(const Camera& camera, std::uint32_t width, std::uint32_t height);
  // Through the point (x, y) of the image [pixels].
  void at(float x, float y, glm::vec3& originWorld, glm::vec3& direction) const;

  glm::vec3 origin, right, up, forward;  // right and up span half the image at distance 1 (orthographic: half the view)
  bool orthographic;
  float width, height;
};

}  // namespace relume
