// SPDX-License-Identifier: MIT
// The surface that a ray through a pixel meets, and where its light comes from.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/relighter.h"

#include <optional>

namespace relume {

// A point of the level as the camera sees it.
struct SeenSurface {
  SurfacePoint point;
  glm::vec3 positionWorld{0.0f};                  // [m]
  glm::vec3 normal{0.0f}, geometricNormal{0.0f};  // unit, toward the viewer
  bool back = false;                              // its back side is seen
};

SeenSurface seenAt(const Scene& scene, const Ray& ray, const Hit& hit);

// The light-map coordinate that the surface reads; empty = it reads the grid. What moves reads the grid, and so does
// everything where a bake has no parts.
std::optional<glm::vec2> lightmapPoint(const Scene& scene, const Bake& bake, const SeenSurface& seen);

// Irradiance over links [W/m²] from where the surface reads it.
glm::vec3 linkIrradiance(const Scene& scene, const Bake& bake, const Relighter& relighter, const SeenSurface& seen);

// Mean radiance over links [W/m²/sr] in a lobe about the direction that the ray is reflected to (glossyOnLightmap()).
glm::vec3 linkGlossy(const Scene& scene, const Bake& bake, const Relighter& relighter, const SeenSurface& seen,
                     const Ray& ray, float exponent);

}  // namespace relume
