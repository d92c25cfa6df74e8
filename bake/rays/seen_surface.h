// SPDX-License-Identifier: MIT
// The surface that a ray meets, turned to the side that it came from.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/scene.h"

namespace relume {

// A point of the level as the viewer sees it.
struct SeenSurface {
  SurfacePoint point;
  glm::vec3 positionWorld{0.0f};                  // [m]
  glm::vec3 normal{0.0f}, geometricNormal{0.0f};  // unit, toward the viewer
  bool back = false;                              // its back side is seen
};

SeenSurface seenAt(const Scene& scene, const Ray& ray, const Hit& hit);

}  // namespace relume
