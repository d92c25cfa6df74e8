// SPDX-License-Identifier: MIT
// What the kernel reads that finds the links of a cache which a sphere may hide: plain memory and no header that has
// functions (vectors.h says why).
#pragma once

#include "runtime/cpu/light_caches_job.h"

#include <cstdint>

namespace relume::cpu {

// The directions from a cache toward a sphere.
struct LinkCone {
  float axis[3] = {};                // unit
  float cosine = 0.0f, sine = 0.0f;  // of the half opening angle, at most pi / 2
  bool isExact = false;              // no links that are nearly covered
};

// Links of a row that are looked at together.
constexpr std::uint32_t kTowardLinks = 512;

// One kernel an instruction set, for links with a direction (kinds cone and oct6): sets bit i % 64 of toward[i / 64]
// where link begin + i and the other cone are not apart, or nearly not, and writes the share of it that the other
// covers, which may be 0 or less. [count <= kTowardLinks] [Size share = kTowardLinks]
void linksTowardBaseline(const LightCachesJob& job, const LinkCone& cone, std::uint32_t begin, std::uint32_t count,
                         float* share, std::uint64_t* toward);
void linksTowardAvx2(const LightCachesJob& job, const LinkCone& cone, std::uint32_t begin, std::uint32_t count,
                     float* share, std::uint64_t* toward);
void linksTowardAvx512(const LightCachesJob& job, const LinkCone& cone, std::uint32_t begin, std::uint32_t count,
                       float* share, std::uint64_t* toward);

}  // namespace relume::cpu
