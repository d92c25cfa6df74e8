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

// What happens to a range of caches around its lighting, on the thread that lights it. Both may be empty.
struct CacheSteps {
  std::function<void(std::uint32_t begin, std::uint32_t end)> before, afterwards;
  // What `before` has left of moving parts, of as many caches: LightCachesJob has the same. null = nothing.
  const StoredLight* change = nullptr;
  const std::int32_t* changeNode = nullptr;
  const float* changePerLuma = nullptr;
};

// Lights all caches. `node`: radiosity (runtime/shared/pack_color.h). `light` has as many caches as the links.
void lightCaches(LightCachesKernel kernel, const LinkSet& links, std::span<const std::uint32_t> node,
                 StoredLight& light, const ParallelFor& parallelFor, const CacheSteps& steps = {});

}  // namespace relume::cpu
