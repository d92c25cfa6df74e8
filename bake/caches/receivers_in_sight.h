// SPDX-License-Identifier: MIT
// Keeps bounces on their side of walls. A surfel reads its light between four texels of the light map, some of which
// may lie beyond a wall that stands on its surface: a lit room would shine from the ground around the house, and from
// every floor beside it, at each bounce a little farther.
#pragma once

#include "bake/caches/caches.h"

#include <cstdint>
#include <span>

namespace relume {

// Move the points of the light map at which surfels read (findReceivers()) to where the surfel has all caches that it
// reads in sight: onto the column, the row or the one of the four texels that weighed most, or else to the nearest
// texel in sight around them. A surfel that sees none reads where it did. The same at any number of threads.
void keepReceiversInSight(const RayTracer& tracer, const PlacedCaches& caches, std::span<const SurfelSeed> seeds,
                          std::span<std::uint32_t> receivers, Context& context);

}  // namespace relume
