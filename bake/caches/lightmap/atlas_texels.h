// SPDX-License-Identifier: MIT
// Fills the light map: a cache index for every texel of every patch, dilated where no cache is, and the texture
// coordinates of the triangles' corners.
#pragma once

#include "bake/caches/lightmap/pack_atlas.h"
#include "bake/caches/lightmap/share_caches.h"
#include "bake/caches/map_corners.h"
#include "relume/caches.h"
#include "relume/result.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace relume {

// What is packed: a rectangle for each patch whose texels hold several caches, and a single texel for each cache that
// is read only by patches which hold no other.
struct AtlasRequest {
  std::vector<glm::uvec2> rectangle;       // [texel] sizes
  std::vector<std::uint32_t> rectangleOf;  // [Size patches] kNone = it holds one cache, or none
  std::vector<std::uint32_t> single;       // caches, neighbours in space near one another
};

AtlasRequest requestAtlas(const PatchTexels& patchTexels, const SharedCaches& shared);

// Distance between the positions from which the two sides of seams take their light, before and after stitching
// (bake/caches/lightmap/stitch_seams.h): the root mean square over the seams' length.
struct SeamJump {
  double before = 0.0, after = 0.0;  // [texel]
  double length = 0.0;               // [m]
};

// The finished light map, but for its corners, which are `corners`. Every texel that a bilinear read inside a triangle
// can touch has a cache.
Result<Lightmap> fillAtlas(const Scene& scene, const PatchSet& set, const PatchTexels& patchTexels,
                           const SharedCaches& shared, const AtlasRequest& request, const AtlasPlan& plan,
                           std::uint32_t gutter, MapCorners& corners, SeamJump& seams, Context& context);

}  // namespace relume
