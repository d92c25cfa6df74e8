// SPDX-License-Identifier: MIT
// The kernels with 8 floats per vector; see vectors.h.
#define RELUME_LANES 8
#include "runtime/cpu/light_caches_kernel.h"
#include "runtime/cpu/light_surfels_kernel.h"
#include "runtime/cpu/links_toward_kernel.h"

namespace relume::cpu {

void lightCachesAvx2(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end) {
  lightCachesOf(job, begin, end);
}

void linksTowardAvx2(const LightCachesJob& job, const LinkCone& cone, std::uint32_t begin, std::uint32_t count,
                     float* share, std::uint64_t* toward) {
  linksTowardOf(job, cone, begin, count, share, toward);
}

const LightSurfelsKernel kLightSurfelsAvx2 = {lightDirectly,    colorCaches, addFlatBounce, addTiltedBounce,
                                              addGriddedBounce, listBits,    storeSurfels,  pullNodes};

}  // namespace relume::cpu
