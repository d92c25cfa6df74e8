// SPDX-License-Identifier: MIT
// The irradiance of the light map's caches for their own normals, as colours that bounces read (light_surfels_job.h),
// for one vector width (vectors.h).
#pragma once

#include "runtime/cpu/light_row.h"
#include "runtime/cpu/light_surfels_job.h"
#include "runtime/cpu/vectors.h"

namespace relume::cpu {
namespace {

// ditherOf() of runtime/shared/pack_color.h.
inline Floats dithers(Ints index) {
  using Words = VectorOf<std::uint32_t, kLanes>::type;
  const Words hash = load<Words>(&index) * 2654435769u;
  return toFloats(load<Ints>(&hash) >> 8 & 0xFFFFFF) * 0x1p-24f;
}

// Y, Co, Cg a cache at a time, then lanes are caches.
inline void colorCaches(const ColorCachesJob& job, std::uint32_t begin, std::uint32_t end) {
  constexpr std::int32_t kNoNormal = static_cast<std::int32_t>(0x80008000u);  // kNoDirection of formats/pack.h
  constexpr float kLinear = 4.0f / 3.0f * 3.14159265f * 0.488602512f;
  const std::size_t luma = job.light.lumaCount, chroma = job.light.chromaCount;
  alignas(64) float e[3][kLanes] = {};
  for (std::uint32_t first = begin; first < end; first += kLanes) {
    const std::uint32_t count = end - first < kLanes ? end - first : kLanes, from = first - job.light.first;
    Ints packed = Ints{} + kNoNormal;
    __builtin_memcpy(&packed, job.normal + from, sizeof(std::uint32_t) * count);
    Floats3 unpacked;
    unpackDirections<16>(packed, unpacked.x, unpacked.y, unpacked.z);
    const Ints hasNormal = packed != kNoNormal;
    alignas(64) float normal[3][kLanes];
    store(normal[0], asFloats(asInts(unpacked.x) & hasNormal));
    store(normal[1], asFloats(asInts(unpacked.y) & hasNormal));
    store(normal[2], asFloats(asInts(unpacked.z) & hasNormal));
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint16_t *const row = rowOf(job.light, first + i), *const y = row + 1, *const co = y + luma,
                                 *const cg = co + chroma;
      const float unit = unitOf(row);
      if (job.normalsCount) {
        // As coefficients 1 to 3 lie; what follows them counts nothing.
        const Float4 axis = kLinear * unit * Float4{normal[1][i], normal[2][i], normal[0][i], 0.0f};
        e[0][i] = sumLanes(axis * loadWords<4>(y + 1));
        if (chroma > 1) {
          e[1][i] = sumLanes(axis * loadWords<4>(co + 1));
          // From 0 on and turned: behind the row lies another, which another thread may be writing.
          const Float4 last = loadWords<4>(cg);
          e[2][i] = sumLanes(axis * __builtin_shufflevector(last, last, 1, 2, 3, 0));
        } else {
          // Chroma follows luma.
          const float y0 = wordAt(y), ratio = y0 > 0.0f ? e[0][i] / y0 : 0.0f;
          e[1][i] = ratio * wordAt(co);
          e[2][i] = ratio * wordAt(cg);
        }
      } else {
        const float factor = unit * job.constant[hasNormal[i] != 0 ? 1 : 0];
        e[0][i] = factor * wordAt(y);
        e[1][i] = factor * wordAt(co);
        e[2][i] = factor * wordAt(cg);
      }
    }
    const Floats eY = load<Floats>(e[0]), eCo = load<Floats>(e[1]), eCg = load<Floats>(e[2]), t = eY - eCg, zero{};
    const Ints bits = packColors(max(t + eCo, zero), max(eY + eCg, zero), max(t - eCo, zero),
                                 dithers(static_cast<std::int32_t>(first) + laneNumbers<Ints>()));
    __builtin_memcpy(job.color + from, &bits, sizeof(std::uint32_t) * count);
  }
}

}  // namespace
}  // namespace relume::cpu
