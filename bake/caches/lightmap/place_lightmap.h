// SPDX-License-Identifier: MIT
// Places the caches of the light map (PIC 4.4): charts to patches to texels to unique caches to a texture of indices.
#pragma once

#include "bake/caches/lightmap/share_caches.h"
#include "bake/caches/map_corners.h"
#include "relume/caches.h"
#include "relume/result.h"

#include <vector>

namespace relume {

struct PlacedLightmap {
  std::vector<SurfaceCache> caches;  // along a space-filling curve
  Lightmap lightmap;                 // indices count from 0: the caches of the grid come before them later
  MapCorners corners;                // in place of the light map's own
};

// hasGrid: what gets no cache here reads the grid; it stays dark otherwise. memory: it is larger than the process may
// hold. failed: there is none in this level.
Result<PlacedLightmap> placeLightmap(const RayTracer& tracer, const PlaySpace& playSpace, const CacheOptions& options,
                                     bool hasGrid, Context& context);

}  // namespace relume
