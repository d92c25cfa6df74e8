// SPDX-License-Identifier: MIT
// Builds the map from hits to surfels.
#pragma once

#include "bake/surfels/surface_sampler.h"
#include "bake/surfels/surfels.h"
#include "relume/bake/context.h"

#include <span>

namespace relume {

// Builds the map with about four tiles per surfel, and at least one per seen side. A tile holds the surfel with the
// least mapCost() for the tile's centre, no farther away than kSeenReach spacings on sides that the play space sees,
// and kUnseenReach spacings on others. spacing [m]: of the densest packing. lookups: about how often the map will be
// asked; where that is far less than there are sides of one tile, those are left to SurfelMap::onDemand, and the scene
// must outlive the map. What the map answers is the same.
SurfelMap buildSurfelMap(const Scene& scene, const PlaySpace& playSpace, std::span<const SurfaceSample> surfels,
                         float spacing, Context& context, double lookups = kManyLookups);

inline constexpr int kSeenReach = 6;
inline constexpr int kUnseenReach = 2;

}  // namespace relume
