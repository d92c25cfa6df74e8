// SPDX-License-Identifier: MIT
// Whether one frame's light can be applied: last frame's light feeds the next, so a number that is not finite would
// never leave.
#pragma once

#include "formats/result.h"
#include "runtime/lights.h"

#include <cstddef>

namespace relume {

// usage: see Relighter::check().
Status checkSetup(const LightSetup& setup, std::size_t surfelCount, std::size_t skyPatchCount);

}  // namespace relume
