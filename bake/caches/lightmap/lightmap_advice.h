// SPDX-License-Identifier: MIT
// Warns, node by node, where the light map falls short, and says what would help: surfaces that read the grid instead,
// or stay dark without one, backs of one-sided faces, and smooth parts whose texels are too large for their curvature.
#pragma once

#include "bake/caches/lightmap/share_caches.h"

namespace relume {

// Log warnings that name the node, and the texelDensity that helps if one does. Reports the figure grid_lit_area_share.
// hasGrid: what has no cache reads the grid; it stays dark otherwise.
void warnAboutLightmap(const PlaySpace& playSpace, const Prober& prober, const PatchSet& set, const PatchTexels& texels,
                       const SharedCaches& shared, const CacheOptions& options, bool hasGrid, Context& context);

}  // namespace relume
