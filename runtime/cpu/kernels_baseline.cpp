// SPDX-License-Identifier: MIT
// The kernels with 4 floats per vector; see vectors.h.
#define RELUME_LANES 4
#include "runtime/cpu/light_caches_kernel.h"
#include "runtime/cpu/light_surfels_kernel.h"
#include "runtime/cpu/links_toward_kernel.h"

namespace relume::cpu {

void lightCachesBaseline(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end) {
  lightCachesOf(job, begin, end);
}

void linksTowardBaseline(const LightCachesJob& job, const LinkCone& cone, std::uint32_t begin, std::uint32_t count,
                         float* share, std::uint64_t* toward) {
  linksTowardOf(job, cone, begin, count, share, toward);
}

const LightSurfelsKernel kLightSurfelsBaseline = {lightDirectly,    colorCaches, addFlatBounce, addTiltedBounce,
                                                  addGriddedBounce, listBits,    storeSurfels,  pullNodes};

}  // namespace relume::cpu
