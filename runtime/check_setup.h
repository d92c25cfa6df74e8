// SPDX-License-Identifier: MIT
// Whether one frame's light can be applied: last frame's light feeds the next, so a number that is not finite would
// never leave. What passes here cannot overflow in either backend.
#pragma once

#include "relume/lights.h"
#include "relume/result.h"

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume {

// usage: see Relighter::check().
Status checkSetup(const LightSetup& setup, std::size_t surfelCount, std::size_t skyPatchCount);

// usage: more moving parts than `most`, parts without shapes, a shape that there is not, a transform whose numbers are
// not finite or beyond 1e8.
Status checkMovingParts(const LightSetup& setup, std::uint32_t most);

// The lights of a setup that passes, with directions of length 1. `normalised` keeps its memory from frame to frame.
void normaliseLights(std::span<const Light> lights, std::pmr::vector<Light>& normalised);

// A setup without its lights and the host's functions, whose copies may allocate.
LightSetup withoutFunctions(const LightSetup& setup);

}  // namespace relume
