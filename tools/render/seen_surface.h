// SPDX-License-Identifier: MIT
// Where the surface that a ray meets reads its light over links.
#pragma once

#include "bake/rays/seen_surface.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/relighter.h"

#include <optional>

namespace relume {

// The light-map coordinate that the surface reads; empty = it reads the grid. What moves reads the grid, and so does
// everything where a bake has no parts.
std::optional<glm::vec2> lightmapPoint(const Scene& scene, const Bake& bake, const SeenSurface& seen);

// Irradiance over links [W/m²] from where the surface reads it.
glm::vec3 linkIrradiance(const Scene& scene, const Bake& bake, const Relighter& relighter, const SeenSurface& seen,
                         GridLookup lookup = GridLookup::stencil);

// Mean radiance over links [W/m²/sr] in a lobe about the direction that the ray is reflected to (glossyOnLightmap()).
glm::vec3 linkGlossy(const Scene& scene, const Bake& bake, const Relighter& relighter, const SeenSurface& seen,
                     const Ray& ray, float exponent);

}  // namespace relume
