// SPDX-License-Identifier: MIT
// The kernel of light_caches.h for one vector width (vectors.h).
#pragma once

#include "runtime/cpu/cone_rows.h"
#include "runtime/cpu/stored_rows.h"

namespace relume::cpu {
namespace {

// LinkKind's numbers, without its header.
constexpr std::uint32_t kSh = 0, kCone = 1, kOct6 = 3, kSh8 = 4, kIrradiance = 5;

inline void lightCachesOf(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end) {
  const int bands = job.lumaBands - 1;
  const ConeRow row = job.kind == kCone            ? kConeRow<PlainLinks>[bands]
                      : job.kind == kOct6          ? kConeRow<Oct6Links>[bands]
                      : job.kind == kRepackedLinks ? kConeRow<RepackedLinks>[bands]
                                                   : kConeRow<Oct8Links>[bands];
  const int luma = job.lumaBands * job.lumaBands, chroma = job.chromaBands * job.chromaBands;
  const std::size_t stride = static_cast<std::size_t>(luma + 2 * chroma);
  for (std::uint32_t cache = begin; cache < end; ++cache) {
    float* y = job.coefficients + stride * cache;
    float* const out[3] = {y, y + luma, y + luma + chroma};
    const std::uint32_t linksBegin = job.rowBegin[cache], linksEnd = job.rowBegin[cache + 1];
    if (job.kind == kSh) {
      lightShRow(job, linksBegin, linksEnd, out);
      continue;
    }
    if (job.kind == kSh8) {
      lightSh8Row(job, linksBegin, linksEnd, out);
      continue;
    }
    for (std::size_t i = 0; i < stride; ++i) y[i] = 0.0f;
    if (job.kind == kIrradiance && linksBegin >= job.gridLinks) {
      lightIrradianceRow(job, linksBegin, linksEnd, out);
      continue;
    }
    row(job, cache, out);
    for (int i = 0; i < luma; ++i) out[0][i] *= job.coneScale[i];
    for (int i = 0; i < chroma; ++i) out[1][i] *= job.coneScale[i];
    for (int i = 0; i < chroma; ++i) out[2][i] *= job.coneScale[i];
  }
}

}  // namespace
}  // namespace relume::cpu
