// SPDX-License-Identifier: MIT
// The cache lighting kernel with 4 floats a vector; see light_caches_kernel.h.
#define RELUME_LANES 4
#include "runtime/cpu/light_caches_kernel.h"

namespace relume::cpu {

void lightCachesBaseline(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end) { lightCachesOf(job, begin, end); }

}  // namespace relume::cpu
