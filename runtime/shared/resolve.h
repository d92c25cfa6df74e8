// SPDX-License-Identifier: MIT
// Step 6 on the CPU: irradiance at a receiver from the caches around it (PIC 3.2). shaders/resolve.glsl is the same
// arithmetic; a test runs both.
//
// Irradiance is linear in the coefficients, E = sum_k w_k sum_i g_i c_{k,i}, with w the interpolation's weights and g
// the receiver's lobe: the clamped cosine for grid caches; on the light map irradianceLinear(), exact for the cache's
// own normal, blending to the clamped cosine as the normals part, both made up for what the cache has not seen
// (formats/sh.h, surfaceLobe()).
// The host's receivers get what two bands lack, guessed: luma's third band by zonalIrradiance() (formats/sh.h);
// chroma's light of bands 2 and up is to luma's as their coefficients 0 to 3 are, by least squares. With one chroma
// band beside more luma bands, chroma follows luma: E_Co = E_Y Co_0 / Y_0, so that colours keep their saturation
// whatever the lobe.
#pragma once

#include "runtime/shared/bands.h"
#include "runtime/shared/packed_caches.h"
#include "runtime/shared/stored_light.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <span>

namespace relume {

// The caches' coefficients: lumaBands² of Y, chromaBands² of Co, of Cg, a cache at a time; zeros where caches on the
// light map have fewer bands.
struct CacheLight : CacheBands {
  std::span<const float> coefficients;  // [W/m²/sr] empty where they are stored
  bool guessBands = false;              // guess what two bands of luma or chroma lack of the clamped lobe
  const StoredLight* stored = nullptr;

  struct Row {
    float c[3 * kMaxCoefficients];
  };
  // Coefficients of a cache: `row` is written where they have to be widened. [Size stride()]
  const float* of(std::uint32_t cache, Row& row) const {
    if (stored == nullptr) return coefficients.data() + stride() * cache;
    stored->read(cache, row.c);
    return row.c;
  }
};
inline CacheLight cacheLight(const StoredLight& stored) { return {stored.bands(), {}, false, &stored}; }

// Square of the longest normal that receivers may have: unit ones, and what is left of them by interpolation or
// packing.
inline constexpr float kMaxNormal2 = 4.0f;

// Irradiance [W/m²], finite and never negative; zero where there are no caches, where uv or the position is not finite,
// and for a normal that is not finite or longer than 2. `uv` is a point of the light map, whichever of its
// coordinate sets (front or back sides) it came from. Texels without a cache have weight 0, the others share it.
// `normal` is the shading normal, `geometricNormal` that of the receiver's plane (formats/sh.h, surfaceLobe()).
glm::vec3 irradianceOnLightmap(const PackedCaches& caches, const CacheLight& light, const glm::vec2& uv,
                               const glm::vec3& normal, const glm::vec3& geometricNormal);
inline glm::vec3 irradianceOnLightmap(const PackedCaches& caches, const CacheLight& light, const glm::vec2& uv,
                                      const glm::vec3& normal) {
  return irradianceOnLightmap(caches, light, uv, normal, normal);
}

// Trilinear between the points of the grid, the position clamped to it (and to 1e9 m, formats/limits.h); points behind
// the receiver count less (the wrap weight), those behind a wall next to nothing (formats/grid_depth.h), points without
// a cache nothing.
glm::vec3 irradianceInGrid(const PackedCaches& caches, const CacheLight& light, const glm::vec3& positionWorld,
                           const glm::vec3& normal);

}  // namespace relume
