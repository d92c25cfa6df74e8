// SPDX-License-Identifier: MIT
// The light map's texels as they open caches (share_caches.h): one with much surface by itself; those with little, as
// of leaves and slivers, in groups of what lies together and looks the same way.
#pragma once

#include "bake/caches/charts/patches.h"
#include "bake/caches/lightmap/patch_texels.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Where texels are, and how much of them is surface. [Size texels]
struct TexelSpots {
  std::vector<SurfaceSpot> spot;      // lifted off the surface
  std::vector<float> share;           // [0..1] its surface as a share of a full texel
  std::vector<std::uint8_t> invalid;  // 1 = every spot of the texel is behind or inside something
  glm::vec3 low{0.0f};                // [m] lower corner of all spots' bounds
};

// Texels that open a cache together.
struct TexelUnit {
  std::uint32_t texel = 0;  // the one at which the cache is placed: that with the most surface
  float weight = 0.0f;      // [full texels]
  bool closed = false;      // has opened a cache, or cannot
  float texelSize = 0.0f;   // [m]
  SurfaceSpot spot;         // of `texel`
  bool mayOpen() const { return !closed && !(weight <= 0.0f); }
};

// The width of a texel. [m]
inline float texelSizeOf(const PatchSet& set, const PatchTexels& texels, std::uint32_t texel) {
  return texels.texelSize / set.patches[texels.texels[texel].patch].density;
}

// The units of some texels, the heaviest first.
std::vector<TexelUnit> makeTexelUnits(const PatchSet& set, const PatchTexels& texels, const TexelSpots& spots,
                                      std::span<const std::uint32_t> some);

}  // namespace relume
