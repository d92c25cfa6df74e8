// SPDX-License-Identifier: MIT
// Decides which texels get a cache of their own and which share one: a facility-location problem, solved greedily. A
// texel stands for some surface. Reading a cache that is farther away, or whose normal differs, causes an error in
// proportion to that surface. A cache pays when it saves more error than it costs. So leaves, mouldings, slivers and
// the borders of charts that meet in space share caches that are near, look the same way and are in sight. Small
// geometry gets its fair share of caches by area, and light does not jump between charts.
//
// Deviation from PIC 4.4: the paper's unique caches are the covered texels; sharing across charts is ours.
#pragma once

#include "bake/caches/grid/relocate.h"
#include "bake/caches/lightmap/patch_texels.h"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relume {

struct SurfaceCache {
  glm::vec3 positionWorld{0.0f};  // lifted off the surface
  glm::vec3 normal{0.0f};
};

struct SharedCaches {
  std::vector<SurfaceCache> caches;         // in the order they were opened
  std::vector<std::uint32_t> cacheOfTexel;  // [Size texels] kNoCache = nothing valid near
  std::vector<std::uint8_t> buried;         // [Size texels] 1 = every spot of it is behind or inside something
  bool tooMany = false;                     // there would be more than maxCaches; else only statistics.pairs is filled
  struct Statistics {
    std::uint32_t shared = 0;   // texels that read another texel's cache
    std::uint32_t moved = 0;    // caches moved off the middle of their texel
    std::uint32_t dropped = 0;  // texels that read none
    std::uint64_t pairs = 0;    // pairs of a texel and one that may serve it: how much work it was
  } statistics;
};

// The surface [full texels] with which a texel opens a cache whatever is around it.
float ownCacheTexels(const CacheOptions& options);

// minChartTexels scales what a cache costs: with 0, every texel has its own. Stops as soon as more than `maxCaches` are
// open. Never fails; empty when cancelled.
SharedCaches shareCaches(const Scene& scene, const PatchSet& set, const PatchTexels& texels, const Prober& prober,
                         const CacheOptions& options, std::size_t maxCaches, Context& context);

}  // namespace relume
