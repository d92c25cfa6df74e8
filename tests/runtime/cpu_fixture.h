// SPDX-License-Identifier: MIT
// What the tests of the CPU passes share.
#pragma once

#include "runtime/cpu/light_surfels.h"
#include "runtime/shared/pack_color.h"
#include "tests/on_threads.h"

#include <cstdint>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

namespace relume::test {

inline constexpr double kPi = std::numbers::pi;

inline std::vector<std::uint32_t> randomNodes(std::uint32_t count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0.0f, 2.0f);
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < count; ++i) {
    const float r = uniform(random), g = uniform(random), b = uniform(random);
    nodes.push_back(packColor({r, g, b}, ditherOf(i)));
  }
  return nodes;
}

// The kernels of every instruction set that this processor has.
inline std::vector<const cpu::LightSurfelsKernel*> surfelsKernels() {
  std::vector<const cpu::LightSurfelsKernel*> all;
  for (const Simd simd : {Simd::baseline, Simd::avx2, Simd::avx512}) {
    if (const cpu::LightSurfelsKernel* kernel = cpu::lightSurfelsKernel(simd)) all.push_back(kernel);
  }
  return all;
}

}  // namespace relume::test
