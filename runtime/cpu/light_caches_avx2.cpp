// SPDX-License-Identifier: MIT
// The cache lighting kernel with 8 floats a vector; see light_caches_kernel.h.
#define RELUME_LANES 8
#include "runtime/cpu/light_caches_kernel.h"

namespace relume::cpu {

void lightCachesAvx2(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end) { lightCachesOf(job, begin, end); }

}  // namespace relume::cpu
