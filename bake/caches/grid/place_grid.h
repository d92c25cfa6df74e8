// SPDX-License-Identifier: MIT
// Places the caches of the grid (PIC 4.4): a lattice over the space where receivers can be, finer where
// surfaces are.
#pragma once

#include "bake/caches/caches.h"
#include "relume/caches.h"

#include <vector>

namespace relume {

struct PlacedGrid {
  CacheGrid grid;                   // indices count from 0
  std::vector<glm::vec3> position;  // [m] of its valid caches; moved ones lie off their lattice point
};

Result<PlacedGrid> placeGrid(const RayTracer& tracer, const PlaySpace& playSpace, const CacheOptions& options,
                             Context& context);

}  // namespace relume
