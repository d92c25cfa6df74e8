// SPDX-License-Identifier: MIT
// The cache lighting kernel with 16 floats a vector; see light_caches_kernel.h.
#define RELUME_LANES 16
#include "runtime/cpu/light_caches_kernel.h"

namespace relume::cpu {

void lightCachesAvx512(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end) { lightCachesOf(job, begin, end); }

}  // namespace relume::cpu
