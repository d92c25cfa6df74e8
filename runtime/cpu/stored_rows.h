// SPDX-License-Identifier: MIT
// Rows of links that need no projection: irradiance links, lanes are links; and SH links with stored coefficients, a
// link at a time, lanes are coefficients.
#pragma once

#include "runtime/cpu/link_vectors.h"

namespace relume::cpu {
namespace {

// Radiosity times f of kLanes links.
inline void scaledColors(const LightCachesJob& job, const Heads& links, Floats& y, Floats& co, Floats& cg) {
  loadNodes(job.node, links.nodes(), y, co, cg);
  const Floats f = links.transfer();
  y *= f;
  co *= f;
  cg *= f;
}

// One row of irradiance links: coefficient 0 alone.
inline void lightIrradianceRow(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end, float* const* out) {
  Floats sum[3] = {};
  for (std::uint32_t at = begin; at < end; at += kLanes) {
    Floats y, co, cg;
    scaledColors(job, Heads(job, at, static_cast<int>(end - at < kLanes ? end - at : kLanes)), y, co, cg);
    sum[0] += y;
    sum[1] += co;
    sum[2] += cg;
  }
  for (int c = 0; c < 3; ++c) out[c][0] = sumLanes(sum[c]);
}

// kLanes halves from `at` on, widened; reads no half at or beyond `end`.
inline Floats loadHalves(const std::uint16_t* at, const std::uint16_t* end) {
  HalvesOf<kLanes> halves{};
  if (end - at >= kLanes) {
    halves = load<HalvesOf<kLanes>>(at);
  } else {
    __builtin_memcpy(&halves, at, sizeof(std::uint16_t) * static_cast<std::size_t>(end - at));
  }
  return halvesToFloats(halves);
}

// Radiosity of the nodes of the links from `at` on into memory, whence sums read it spread over a vector: kLanes each
// of Y, Co, Cg.
inline void storeColors(const LightCachesJob& job, std::size_t at, int count, float* color) {
  Ints nodes{};
  __builtin_memcpy(&nodes, job.shNode + at, sizeof(std::uint32_t) * static_cast<std::size_t>(count));
  Floats y, co, cg;
  loadNodes(job.node, nodes, y, co, cg);
  store(color, y);
  store(color + kLanes, co);
  store(color + 2 * kLanes, cg);
}

inline void lightShRow(const LightCachesJob& job, std::uint32_t begin, std::uint32_t end, float* const* out) {
  const int luma = job.lumaBands * job.lumaBands, chroma = job.chromaBands * job.chromaBands;
  const std::uint16_t* halvesEnd = job.shCoefficients + job.shHalfCount;
  for (int first = 0; first < luma; first += kLanes) {
    Floats sum[3] = {};
    for (std::uint32_t at = begin; at < end; at += kLanes) {
      const int count = end - at < kLanes ? static_cast<int>(end - at) : kLanes;
      float color[3 * kLanes];
      storeColors(job, at, count, color);
      for (int k = 0; k < count; ++k) {
        const std::size_t link = std::size_t{at} + static_cast<std::size_t>(k);
        const Floats c = loadHalves(job.shCoefficients + link * job.shStride + first, halvesEnd);
        sum[0] += color[k] * c;
        sum[1] += color[kLanes + k] * c;
        sum[2] += color[2 * kLanes + k] * c;
      }
    }
    // Lanes beyond the bands wanted hold higher bands or the next link: leave them out.
    for (int lane = 0; lane < kLanes && first + lane < luma; ++lane) {
      out[0][first + lane] = sum[0][lane];
      if (first + lane >= chroma) continue;
      out[1][first + lane] = sum[1][lane];
      out[2][first + lane] = sum[2][lane];
    }
  }
}

}  // namespace
}  // namespace relume::cpu
