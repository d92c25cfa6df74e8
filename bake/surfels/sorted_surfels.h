// SPDX-License-Identifier: MIT
// Surfels sorted into buckets one spacing wide, for the search of the surfel that stands for a point.
#pragma once

#include "bake/base/point_grid.h"
#include "bake/surfels/map_cost.h"
#include "bake/surfels/surface_sampler.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/context.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

struct SortedSurfels {
  PointGrid grid;
  std::vector<MapPoint> surfel;   // in the grid's order
  std::vector<std::uint32_t> id;  // their indices
  float spacing = 0.0f;           // [m] of the densest packing

  // The surfel of least cost within reach [m], by its own index; kNone when there is none. Among equals, the one with
  // the smallest index. Thread-safe. Searches for many points near each other are faster by blocks (surfel_map.cpp).
  std::uint32_t best(const MapPoint& point, float reach) const;
};

// Either the surfels of sides that are seen from far away only, or all others. spacing [m]: of the densest packing.
SortedSurfels sortSurfels(const PlaySpace& playSpace, std::span<const SurfaceSample> surfels, float spacing, bool far,
                          Context& context);

}  // namespace relume
