// SPDX-License-Identifier: MIT
// Step 2 on the CPU: direct light, last frame's caches and emission make the radiosity of the leaves (PIC 3, 4.1).
#pragma once

#include "relume/relighter.h"
#include "runtime/cpu/bounce.h"
#include "runtime/cpu/surfel_set.h"

#include <memory_resource>
#include <span>
#include <vector>

namespace relume::cpu {

// Writes the leaves of `node` (runtime/shared/pack_color.h): radiosity [W/m²]
//   surfel:     albedo * (direct + bounceScale * last frame's irradiance at its receiver) + pi * emission
//   sky patch:  pi * radiance
// `bounce` is null before there is any light; `job` has what Bounce::setLight() set;
// `lights` is scratch memory that is kept from frame to frame. [Size node = hierarchy.nodeCount()]
void lightSurfels(const LightSurfelsKernel& kernel, const SurfelSet& surfels, const LightSetup& setup,
                  const Bounce* bounce, LightSurfelsJob job, std::pmr::vector<PreparedLight>& lights,
                  std::span<std::uint32_t> node, const ParallelFor& parallelFor);

// The kernels of an instruction set; null when this processor, or this build, lacks it.
const LightSurfelsKernel* lightSurfelsKernel(Simd simd);

}  // namespace relume::cpu
