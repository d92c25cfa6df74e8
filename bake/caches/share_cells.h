// SPDX-License-Identifier: MIT
// Decides which texels get a cache of their own and which share one: texels that stand for little surface (leaves,
// mouldings, slivers, borders of charts that meet in space) read a cache nearby that looks the same way and is in
// sight. So small geometry gets its fair share of caches by area, and light does not jump between charts.
//
// Deviation from PIC 4.4: the paper's unique caches are the covered texels; sharing across charts is ours.
#pragma once

#include "bake/caches/cells.h"
#include "bake/caches/relocate.h"

#include <cstdint>
#include <vector>

namespace relume {

struct SurfaceCache {
  glm::vec3 positionWorld{0.0f};  // lifted off the surface
  glm::vec3 normal{0.0f};
};

struct SharedCaches {
  std::vector<SurfaceCache> caches;        // in the order of the texels that made them
  std::vector<std::uint32_t> cacheOfCell;  // [Size cells] kNoCache = nothing valid near
  struct Statistics {
    std::uint32_t shared = 0;   // cells that read another cell's cache
    std::uint32_t moved = 0;    // caches moved off the middle of their texel
    std::uint32_t dropped = 0;  // cells whose every place is behind or inside geometry
  } statistics;
};

// minChartTexels: surface, in texels, from which on a texel hardly shares. Without a prober nothing is traced: every place counts as valid and in sight (for estimates of the count).
SharedCaches shareCells(const Scene& scene, const PatchSet& set, const CellSet& cells, const Prober* prober,
                        float maxBackFaceShare, float minChartTexels, Context& context);

}  // namespace relume
