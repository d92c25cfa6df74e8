// SPDX-License-Identifier: MIT
// Moves each surfel to the point at which it is lit. Its cell may be half behind a column or under a leaf, and
// receivers see only the rest. A surfel lit at its own point would often be in a shadow that no receiver sees, and its
// light would be lost (docs/DESIGN.md).
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/surfels/surface_sampler.h"
#include "bake/surfels/surfels.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/context.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// For each surfel the point of its cell nearest to the middle of what receivers see of the cell, found by random rays
// from where receivers can be; the surfel's own point where too few rays find the cell. [Size surfels]
// Same result at any thread count; empty when the context was cancelled.
std::vector<SurfelSeed> moveToVisible(const RayTracer& tracer, const PlaySpace& playSpace, const SurfelMap& map,
                                      std::span<const SurfaceSample> surfels, std::uint64_t seed, Context& context);

}  // namespace relume
