// SPDX-License-Identifier: MIT
// The kernel of light_caches.h for one vector width (vectors.h).
#pragma once

#include "runtime/cpu/stored_rows.h"
#include "runtime/cpu/summed_rows.h"

namespace relume::cpu {
namespace {

// LinkKind's numbers, without its header.
constexpr std::uint32_t kSh = 0, kCone = 1, kOct6 = 3, kIrradiance = 5;

template <class Links>
ConeRow coneRow(int luma, int chroma) {
  const ConeRow summed = summedRow<Links>(luma, chroma);
  return summed ? summed : kConeRow<Links>[luma - 1];
}

inline void lightCachesOf(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end) {
  const auto pick = job.kind == kCone            ? coneRow<PlainLinks>
                    : job.kind == kOct6          ? coneRow<Oct6Links>
                    : job.kind == kRepackedLinks ? coneRow<RepackedLinks>
                                                 : coneRow<GridIrradianceLinks>;
  const ConeRow row = pick(job.lumaBands, job.chromaBands);
  const int luma = job.lumaBands * job.lumaBands, chroma = job.chromaBands * job.chromaBands;
  const std::size_t stride = static_cast<std::size_t>(job.lumaStride + 2 * job.chromaStride);
  const bool inPlace = luma == job.lumaStride && chroma == job.chromaStride;
  for (std::uint32_t cache = begin; cache < end; ++cache) {
    float* y = job.coefficients + stride * cache;
    float* const out[3] = {y, y + job.lumaStride, y + job.lumaStride + job.chromaStride};
    const std::uint32_t linksBegin = job.rowBegin[cache], linksEnd = job.rowBegin[cache + 1];
    if (job.kind == kSh) {
      lightShRow(job, linksBegin, linksEnd, out);
      continue;
    }
    if (job.kind == kIrradiance && linksBegin >= job.gridLinks) {
      for (std::size_t i = 0; i < stride; ++i) y[i] = 0.0f;
      lightIrradianceRow(job, linksBegin, linksEnd, out);
      continue;
    }
    if (inPlace) {
      row(job, cache, y);
      continue;
    }
    float lit[3 * 64];
    row(job, cache, lit);
    __builtin_memcpy(out[0], lit, sizeof(float) * static_cast<std::size_t>(luma));
    __builtin_memcpy(out[1], lit + luma, sizeof(float) * static_cast<std::size_t>(chroma));
    __builtin_memcpy(out[2], lit + luma + chroma, sizeof(float) * static_cast<std::size_t>(chroma));
  }
}

}  // namespace
}  // namespace relume::cpu
