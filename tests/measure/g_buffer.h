// SPDX-License-Identifier: MIT
// What a camera sees of a level, a ray a pixel, for programs that measure cones of pixels.
#pragma once

#include "bake/scene/camera_rays.h"
#include "runtime/cones/pixel_cones.h"
#include "tests/measure/open_view.h"
#include "tools/render/seen_surface.h"

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include <cstdint>
#include <vector>

namespace relume::test {

struct GBuffer {
  std::uint32_t width, height;
  std::vector<glm::vec3> position, plane, normal;
  std::vector<float> depth;
  glm::mat4 clipFromWorld;

  GBuffer(const OpenedView& view, const Camera& camera, std::uint32_t w, std::uint32_t h)
      : width(w), height(h), position(w * h), plane(w * h), normal(w * h), depth(w * h) {
    const CameraRays rays(camera, w, h);
    for (std::uint32_t i = 0; i < w * h; ++i) {
      Ray ray;
      rays.at(static_cast<float>(i % w) + 0.5f, static_cast<float>(i / w) + 0.5f, ray.origin, ray.direction);
      const Hit hit = view.tracer.trace(ray);
      if (!hit) continue;
      const SeenSurface seen = seenAt(*view.scene, ray, hit);
      position[i] = seen.positionWorld;
      plane[i] = seen.geometricNormal;
      normal[i] = seen.normal;
      depth[i] = glm::dot(seen.positionWorld - rays.origin, rays.forward);
    }
    clipFromWorld = glm::perspective(camera.yfovRad, static_cast<float>(w) / static_cast<float>(h), 0.1f, 1e4f) *
                    glm::inverse(camera.toWorld);
  }
  PixelReceivers receivers() const { return {width, height, position, plane, normal, depth, clipFromWorld}; }
};

}  // namespace relume::test
