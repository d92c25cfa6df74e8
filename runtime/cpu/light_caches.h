// SPDX-License-Identifier: MIT
// Step 4 on the CPU: L_SH = sum over links of B_s F_SH (PIC Eq. (3)), the relighter's heaviest step. One kernel, built
// once for each instruction set and chosen at run time.
#pragma once

#include "relume/relighter.h"
#include "runtime/cpu/light_caches_job.h"
#include "runtime/shared/link_set.h"
#include "runtime/shared/stored_light.h"

#include <functional>
#include <span>

namespace relume::cpu {

// Lights the caches [begin, end) with some kernel.
using LightCachesKernel = void (*)(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end);

// The kernel for an instruction set; null when this processor, or this build, lacks it.
LightCachesKernel lightCachesKernel(Simd simd);

// Lights all caches. `node`: radiosity (runtime/shared/pack_color.h). `light` has as many caches as the links.
// afterwards(begin, end) runs on the thread that has just lit these caches, until all are through. May be empty.
void lightCaches(LightCachesKernel kernel, const LinkSet& links, std::span<const std::uint32_t> node,
                 StoredLight& light, const ParallelFor& parallelFor,
                 const std::function<void(std::uint32_t begin, std::uint32_t end)>& afterwards = {});

}  // namespace relume::cpu
