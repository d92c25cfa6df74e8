// SPDX-License-Identifier: MIT
// Measures how far grid caches see, for formats/grid_depth.h.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Maps of all positions, kDepthWords words each. unit [m]: what t is counted in.
std::vector<std::uint32_t> seeDepths(const RayTracer& tracer, std::span<const glm::vec3> positionWorld, float unit,
                                     Context& context);

}  // namespace relume
