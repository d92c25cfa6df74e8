// SPDX-License-Identifier: MIT
// The paper's relaxation: surfels repel each other along their tangent planes (PIC 4.2).
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/surfels/surface_sampler.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/context.h"
#include "relume/result.h"

#include <cstdint>
#include <vector>

namespace relume {

// Move the samples apart for some rounds. They stay on seen surfaces of their own instance. spacing [m]: of the densest
// packing. failed: cancelled, or FLANN's own message.
Status relaxSamples(const RayTracer& tracer, const PlaySpace& playSpace, std::uint32_t rounds, float spacing,
                    std::vector<SurfaceSample>& samples, Context& context);

}  // namespace relume
