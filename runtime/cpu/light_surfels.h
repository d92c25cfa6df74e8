// SPDX-License-Identifier: MIT
// Step 2 on the CPU: direct light, last frame's caches and emission make the radiosity of the leaves (PIC 3, 4.1).
#pragma once

#include "formats/bake.h"
#include "runtime/cpu/bounce.h"
#include "runtime/relighter.h"

#include <glm/vec4.hpp>

#include <span>

namespace relume::cpu {

// Irradiance [W/m²] at a point with unit normal by one light, shadows left out.
glm::vec3 directIrradiance(const Light& light, const glm::vec3& positionWorld, const glm::vec3& normal);

// Writes the leaves of `node` as (Y, Co, Cg, 0) of radiosity [W/m²]:
//   surfel:     albedo * (direct + bounceScale * last frame's irradiance at its receiver) + pi * emission
//   sky patch:  pi * radiance
// `bounce` has last frame's light, null before there is one. [Size node >= hierarchy.nodeCount()]
void lightSurfels(const Bake& bake, const LightSetup& setup, const Bounce* bounce, std::span<glm::vec4> node,
                  const ParallelFor& parallelFor);

}  // namespace relume::cpu
