// SPDX-License-Identifier: MIT
// Keeps pixels on their side of walls. A pixel reads its light between four texels of the light map, some of which may
// lie beyond a wall that stands on its surface, or under a curtain that ends above it: a lit room would shine into a
// dark one along the wall's foot. Surfels have receivers_in_sight.h.
#pragma once

#include "bake/caches/caches.h"
#include "relume/result.h"

#include <cstdint>
#include <vector>

namespace relume {

// Lightmap::sight of caches that are otherwise complete: what points of the surfaces between four texels see of these
// texels' caches decides where they are read. Empty where all is read where it is. The same at any number of threads.
// Fails where what it holds meanwhile is beyond the budget (bake/base/memory_budget.h).
Result<std::vector<std::uint32_t>> findMapSight(const RayTracer& tracer, const PlacedCaches& caches, Context& context);

}  // namespace relume
