// SPDX-License-Identifier: MIT
// How a surfel, a receiver that never moves, reads last frame's caches. Both backends decide it once, when they are
// made:
//   flat     the caches around have the surfel's own normal, nearly: the light map's irradiance, evaluated once a texel
//   for
//            the normal of its cache;
//   tilted   other points of the light map: the caches around under the lobe for the surfel's normal (formats/sh.h,
//            SurfaceLobe);
//   gridded  the grid: its caches and their weights are looked up once.
#pragma once

#include "formats/pack.h"
#include "relume/bake_data.h"
#include "runtime/shared/stencil.h"

#include <glm/geometric.hpp>

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <vector>

namespace relume {

enum class ReceiverKind { flat, tilted, gridded };

// Whether light that arrives on the light map depends on a receiver's normal.
inline bool normalsCount(LinkKind kind, int lumaBands) { return lumaBands > 1 && kind != LinkKind::irradiance; }

inline ReceiverKind receiverKind(const PackedMap& map, const Surfels& surfels, std::uint32_t s, bool normalsCount) {
  // Mean cosine, over the caches that a surfel reads, above which their irradiance is taken for its own.
  constexpr float kFlat = 0.97f;
  if (surfels.receiver[s] == kGridReceiver) return ReceiverKind::gridded;
  if (!normalsCount) return ReceiverKind::flat;
  const Stencil stencil = lightmapStencil(map, unpackUnorm16x2(surfels.receiver[s]));
  float sum = 0.0f;
  for (std::size_t k = 0; k < static_cast<std::size_t>(stencil.count); ++k) {
    sum += stencil.weight[k] * glm::dot(map.normalOf(stencil.cache[k]), surfels.normal[s]);
  }
  return sum >= kFlat * stencil.total() ? ReceiverKind::flat : ReceiverKind::tilted;
}

// Caches of the grid that a receiver reads: a cache in the low kCacheBits bits, its share over kMaxShare above them.
constexpr std::uint32_t kMaxShare = 1023;

// Append those of surfel s, whose shares add up to 1; returns how many [0..16].
inline std::uint32_t appendGridShares(const PackedCaches& caches, const Surfels& surfels, std::uint32_t s,
                                      std::pmr::vector<std::uint32_t>& shares) {
  const Stencil stencil = gridStencil(caches, surfels.positionWorld[s], surfels.normal[s]);
  const float total = stencil.total();
  std::uint32_t count = 0;
  // Diffuse the rounding error from one to the next, so that the shares add up to 1.
  float wanted = 0.5f;
  for (std::size_t k = 0; total > 0.0f && k < static_cast<std::size_t>(stencil.count); ++k) {
    wanted += stencil.weight[k] * static_cast<float>(kMaxShare) / total;
    const auto share = static_cast<std::uint32_t>(wanted);
    wanted -= static_cast<float>(share);
    if (share == 0) continue;
    shares.push_back(stencil.cache[k] | share << kCacheBits);
    ++count;
  }
  return count;
}

}  // namespace relume
