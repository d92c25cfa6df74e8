// SPDX-License-Identifier: MIT
// The kernel of links_toward_job.h for one vector width (vectors.h): how far a sphere covers the cones of links.
#pragma once

#include "runtime/cpu/link_vectors.h"
#include "runtime/cpu/links_toward_job.h"

namespace relume::cpu {
namespace {

// A bit for each lane that is all ones.
inline std::uint64_t laneBits(Ints mask) {
#if RELUME_LANES == 16
  return _mm512_movepi32_mask((__m512i)mask);
#else
  std::uint64_t bits = 0;
  for (int lane = 0; lane < kLanes; ++lane) bits |= std::uint64_t{mask[lane] != 0} << lane;
  return bits;
#endif
}

// Two cones with an angle between their axes: from touching from outside to one within the other, whose cosines are
// c - s and c + s, the share grows evenly with the cosine. Cones that tile the sphere then lose together
// 2 pi (1 - cos a cos b), a factor makes that the sphere's own 2 pi (1 - cos a).
template <class Links>
void linksTowardRow(const LightCachesJob& job, const LinkCone& cone, std::uint32_t begin, std::uint32_t count,
                    float* share, std::uint64_t* toward) {
  const int links = static_cast<int>(count);
  for (int k = 0; k < links; k += kLanes) {
    const Links each(job, std::size_t{begin} + static_cast<std::size_t>(k), links - k);
    Floats x, y, z;
    each.unpackDirection(x, y, z);
    // Cones of no width are given some, that of rounded directions.
    const Floats cosine = max(min(each.cosines(), splat(0.9995f)), splat(-0.9995f));
    const Floats along = cone.axis[0] * x + cone.axis[1] * y + cone.axis[2] * z;
    // Cones stand for clusters of any form, by their first band, and directions are rounded: take more to be looked at.
    const Floats wide = cone.isExact ? cosine : max(1.25f * cosine - 0.29f, splat(-1.0f)),
                 wide2 = max(1.0f - wide * wide, splat(1e-6f));
    const Ints meets =
        (along >= cone.cosine * wide - cone.sine * (wide2 * inverseSqrt(wide2))) | (wide <= -cone.cosine);
    std::uint64_t bits = laneBits(meets);
    if (links - k < kLanes) bits &= (std::uint64_t{1} << (links - k)) - 1;
    if (bits == 0) continue;
    toward[k / 64] |= bits << (k % 64);
    const Floats sine2 = 1.0f - cosine * cosine, c = cone.cosine * cosine, s = cone.sine * (sine2 * inverseSqrt(sine2));
    const Floats overlap = min((along - c + s) / (2.0f * s), splat(1.0f));
    store(share + k, overlap * (1.0f - cone.cosine) / (1.0f - c));
  }
}

inline void linksTowardOf(const LightCachesJob& job, const LinkCone& cone, std::uint32_t begin, std::uint32_t count,
                          float* share, std::uint64_t* toward) {
  constexpr std::uint32_t kConeLinks = 1, kOct6Links = 3;  // LinkKind's numbers, without its header
  if (job.kind == kConeLinks) return linksTowardRow<PlainLinks>(job, cone, begin, count, share, toward);
  if (job.kind == kOct6Links) return linksTowardRow<Oct6Links>(job, cone, begin, count, share, toward);
  linksTowardRow<RepackedLinks>(job, cone, begin, count, share, toward);
}

}  // namespace
}  // namespace relume::cpu
