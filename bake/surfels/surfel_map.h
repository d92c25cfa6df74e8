// SPDX-License-Identifier: MIT
// Builds the map from hits to surfels.
#pragma once

#include "bake/surfels/surface_sampler.h"
#include "bake/surfels/surfels.h"
#include "relume/bake/context.h"

#include <span>

namespace relume {

// The map of the surfels: about four cells per surfel, and at least one per seen side. A cell holds the surfel of least
// mapCost() for the cell's centre: within kSeenReach spacings on sides that the play space sees, within kUnseenReach on
// others. spacing [m]: of the densest packing.
SurfelMap buildSurfelMap(const Scene& scene, const PlaySpace& playSpace, std::span<const SurfaceSample> surfels,
                         float spacing, Context& context);

inline constexpr int kSeenReach = 6;
inline constexpr int kUnseenReach = 2;

}  // namespace relume
