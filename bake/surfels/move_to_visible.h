// SPDX-License-Identifier: MIT
// Moves each surfel to the point at which it is lit. Half of a surfel's footprint may be behind a column or under a
// leaf, and receivers see only the rest. A surfel lit at its own point would then often lie in a shadow that no
// receiver sees, and its light would be lost (docs/DESIGN.md).
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/surfels/surface_sampler.h"
#include "bake/surfels/surfels.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/context.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

inline constexpr std::size_t kMoveRaysPerSurfel = 8;

// For each surfel, the seen point of its footprint that is nearest to the middle of all that is seen of the footprint.
// Seen points are found by random rays from where receivers can be; a surfel that too few rays find keeps its own
// point. [Size surfels], empty when the context was cancelled. The result is the same at any number of threads.
std::vector<SurfelSeed> moveToVisible(const RayTracer& tracer, const PlaySpace& playSpace, const SurfelMap& map,
                                      std::span<const SurfaceSample> surfels, std::uint64_t seed, Context& context);

}  // namespace relume
