// SPDX-License-Identifier: MIT
// Step 6 for glossy receivers, on the CPU: the mean radiance that a cos^n lobe about the reflected direction r sees
// (PIC Section 3.2, Appendix B; docs/ERRATA.md: about r, not the half vector). shaders/lib/glossy.glsl is the same
// arithmetic; a test runs both.
//
//   L = 1 / S sum_l s_l(n) sum_m c_l^m y_l^m(r)
//
// with s_l = cosineLobeFactors() (formats/sh.h), which make the lobe's integral over the sphere 1. S = 1 in the grid.
// Caches on the light map have seen only the half of the world above their normal m: S is what the lobe has of that
// half, in as many bands, so that a surface in a uniform world reflects that world, whatever r, n and the bands.
// Chroma of fewer bands than luma takes the shape of luma's upper bands, in proportion (chromaOverLuma()).
#pragma once

#include "runtime/shared/packed_caches.h"
#include "runtime/shared/resolve.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

namespace relume {

// Radiance [W/m²/sr], finite and never negative; zero where there are no caches, and for receivers for whom
// irradianceOnLightmap() and irradianceInGrid() are zero. `reflected` is unit, away from the surface. The exponent is
// clamped to 0..kMaxExponent (include/relume/glossy.h). Irradiance caches (CacheBands::irradianceOnMap) know no
// direction: they give irradiance / pi.
glm::vec3 glossyOnLightmap(const PackedCaches& caches, const CacheLight& light, const glm::vec2& uv,
                           const glm::vec3& reflected, float exponent);

// `normal` weighs the grid's points as in irradianceInGrid().
glm::vec3 glossyInGrid(const PackedCaches& caches, const CacheLight& light, const glm::vec3& positionWorld,
                       const glm::vec3& normal, const glm::vec3& reflected, float exponent);

}  // namespace relume
