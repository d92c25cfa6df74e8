// SPDX-License-Identifier: MIT
// See simd.h.
#include "runtime/cpu/simd.h"

#if defined(RELUME_X86_KERNELS)
#include <cpuid.h>
#endif

namespace relume::cpu {
namespace {

#if defined(RELUME_X86_KERNELS)
// clang 14 does not know "f16c" by name.
bool convertsHalves() {
  unsigned a = 0, b = 0, c = 0, d = 0;
  return __get_cpuid(1, &a, &b, &c, &d) != 0 && (c & bit_F16C) != 0;
}
#endif

bool has(Simd simd) {
#if defined(RELUME_X86_KERNELS)
  __builtin_cpu_init();
  if (simd == Simd::avx2) {
    return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && convertsHalves();
  }
  if (simd == Simd::avx512) {
    return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
           __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") && has(Simd::avx2);
  }
#endif
  return simd == Simd::baseline;
}

}  // namespace

Simd chooseSimd(Simd simd) {
  if (simd != Simd::best) return has(simd) ? simd : Simd::best;
  for (const Simd each : {Simd::avx512, Simd::avx2}) {
    if (has(each)) return each;
  }
  return Simd::baseline;
}

}  // namespace relume::cpu
