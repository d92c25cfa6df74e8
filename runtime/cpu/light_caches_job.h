// SPDX-License-Identifier: MIT
// What a kernel of light_caches.h reads and writes: plain memory and no header that has functions, so that no inline
// function is compiled for a newer processor and linked into everyone's path.
#pragma once

#include "runtime/shared/light_rows.h"
#include "runtime/shared/link_rows.h"

#include <cstddef>
#include <cstdint>

namespace relume::cpu {

struct LightCachesJob : LinkRows {
  const std::uint32_t* node = nullptr;  // radiosity of each node (runtime/shared/pack_color.h)
  int lumaBands = 1, chromaBands = 1;
  const float* coneScale = nullptr;  // factor on each sum over cones, in the order of the coefficients
  // What moving parts change of each cache's light, which is scaled as the radiosity of a node has changed since: node,
  // negative where they change nothing, and 1 / its luma then, 0 = it is not scaled. [Size caches, and kLightRowRoom
  // more] null = nothing moves
  LightRows change{};
  const std::int32_t* changeNode = nullptr;
  const float* changePerLuma = nullptr;
  LightRowsOf<std::uint16_t> light{};  // out
};

// One kernel an instruction set: lights the caches [begin, end).
void lightCachesBaseline(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end);
void lightCachesAvx2(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end);
void lightCachesAvx512(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end);

}  // namespace relume::cpu
