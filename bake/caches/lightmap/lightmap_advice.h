// SPDX-License-Identifier: MIT
// What of the level the light map does not do justice to, node by node, and what would: surfaces left to the grid, and
// smooth parts whose texels do not follow their curvature.
#pragma once

#include "bake/caches/lightmap/share_caches.h"

namespace relume {

// Logs warnings that name the node, with the texelDensity that mends it where one does, and the figure
// grid_lit_area_share.
void warnAboutLightmap(const Scene& scene, const PatchSet& set, const PatchTexels& texels, const SharedCaches& shared,
                       const CacheOptions& options, Context& context);

}  // namespace relume
