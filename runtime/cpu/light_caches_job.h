// SPDX-License-Identifier: MIT
// What a kernel of light_caches.h reads and writes: plain memory and no other header, so that no inline function is
// compiled for a newer processor and linked into everyone's path.
#pragma once

#include <cstddef>
#include <cstdint>

namespace relume::cpu {

// LightCachesJob::kind of links that LinkSet has packed again.
constexpr std::uint32_t kRepackedLinks = 0xFFFFFFFFu;

struct LightCachesJob {
  const std::uint32_t* node = nullptr;  // radiosity of each node (runtime/shared/pack_color.h)
  const std::uint32_t* rowBegin = nullptr;
  std::uint32_t kind = 0;               // LinkKind
  const std::uint32_t* cone = nullptr;  // three words a link
  const std::uint32_t* shNode = nullptr;
  const std::uint16_t* shCoefficients = nullptr;
  std::size_t shHalfCount = 0;           // halves in shCoefficients
  std::uint32_t shStride = 0;            // coefficients of an SH link
  const std::uint32_t* head = nullptr;   // node and transfer of a compact link
  const std::uint32_t* shape = nullptr;  // the rest of it
  std::size_t shapeBytes = 0;
  const std::uint32_t* word = nullptr;  // links packed again: see link_set.h
  const std::uint8_t* transfer = nullptr;
  const std::uint16_t* nodeStep = nullptr;  // nodeSteps of them a row
  std::uint32_t nodeSteps = 0;
  std::uint32_t gridLinks = 0;           // irradiance links: how many have a shape, from the first on
  int lumaBands = 1, chromaBands = 1;    // that are lit
  int lumaStride = 1, chromaStride = 1;  // coefficients of a channel in memory, at least those of its bands
  const float* coneScale = nullptr;      // factor on each sum over cones, in the order of the coefficients that are lit
  const float* sh8Scale = nullptr;       // [Size 64] what a step of a coefficient's byte is worth
  float* coefficients = nullptr;         // out, a cache at a time
};

// One kernel an instruction set: lights the caches [begin, end).
void lightCachesBaseline(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end);
void lightCachesAvx2(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end);
void lightCachesAvx512(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end);

}  // namespace relume::cpu
