// SPDX-License-Identifier: MIT
// Punctual lights as shaders read them (shaders/lib/direct_light.glsl).
#pragma once

#include "relume/lights.h"
#include "shaders/shared/layout.h"

#include <memory_resource>
#include <span>
#include <vector>

namespace relume::gpu {

// [lights of a setup that has passed checkSetup()] Throws std::bad_alloc, with `packed` as it was.
void packLights(std::span<const Light> lights, std::pmr::vector<gl::RelumeLight>& packed);

}  // namespace relume::gpu
