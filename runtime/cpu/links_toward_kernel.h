// SPDX-License-Identifier: MIT
// The kernel of links_toward_job.h for one vector width (vectors.h): a dot product a link.
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

template <class Links>
void linksTowardRow(const LightCachesJob& job, const LinkCone& cone, std::uint32_t begin, std::uint32_t count,
                    std::uint64_t* toward) {
  const int links = static_cast<int>(count);
  for (int k = 0; k < links; k += kLanes) {
    const Links each(job, std::size_t{begin} + static_cast<std::size_t>(k), links - k);
    Floats x, y, z;
    each.unpackDirection(x, y, z);
    // Cones stand for clusters of any form, by their first band, and directions are rounded: take more.
    const Floats c = max(1.25f * each.cosines() - 0.29f, splat(-1.0f));
    const Floats s2 = max(1.0f - c * c, splat(1e-6f)), s = s2 * inverseSqrt(s2);
    const Floats cosine = cone.axis[0] * x + cone.axis[1] * y + cone.axis[2] * z;
    const Ints meets = (cosine >= cone.cosine * c - cone.sine * s) | (c <= -cone.cosine);
    std::uint64_t bits = laneBits(meets);
    if (links - k < kLanes) bits &= (std::uint64_t{1} << (links - k)) - 1;
    toward[k / 64] |= bits << (k % 64);
  }
}

inline void linksTowardOf(const LightCachesJob& job, const LinkCone& cone, std::uint32_t begin, std::uint32_t count,
                          std::uint64_t* toward) {
  constexpr std::uint32_t kConeLinks = 1, kOct6Links = 3;  // LinkKind's numbers, without its header
  if (job.kind == kConeLinks) return linksTowardRow<PlainLinks>(job, cone, begin, count, toward);
  if (job.kind == kOct6Links) return linksTowardRow<Oct6Links>(job, cone, begin, count, toward);
  linksTowardRow<RepackedLinks>(job, cone, begin, count, toward);
}

}  // namespace
}  // namespace relume::cpu
