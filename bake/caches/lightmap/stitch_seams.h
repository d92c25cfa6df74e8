// SPDX-License-Identifier: MIT
// Makes both sides of a seam read alike. A seam is an edge whose two triangles lie on different charts. The texels
// around it choose their caches again, so that what the two sides read agrees in the least-squares sense.
#pragma once

#include "bake/caches/lightmap/atlas_texels.h"
#include "relume/result.h"

namespace relume {

// The atlas while it is filled.
struct SeamTexels {
  glm::uvec2 size{0};                 // [texel]
  std::vector<std::uint32_t>& cache;  // [Size width * height] changed where that helps
  std::span<const float> share;  // [Size width * height] of a full texel of surface that reads it without seams, [0..1]
  std::span<const LightmapPart> parts;
  const MapCorners& corners;
};

// Stitch the seams between surfaces that look the same way. A cache that a single texel reads stays with that texel.
// failed: more points along seams than memory allows.
Result<SeamJump> stitchSeams(const Scene& scene, const PatchSet& set, const SharedCaches& shared, float texelSize,
                             const SeamTexels& texels, Context& context);

}  // namespace relume
