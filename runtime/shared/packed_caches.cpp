// SPDX-License-Identifier: MIT
// See packed_caches.h.
#include "runtime/shared/packed_caches.h"

#include <algorithm>

namespace relume {

PackedGrid::PackedGrid(const Caches& caches, std::pmr::memory_resource* memory)
    : resolution(caches.grid.resolution),
      originWorld(caches.grid.originWorld),
      spacing(caches.grid.spacing),
      depthUnit(caches.grid.depthUnit()),
      finestSpacing(caches.grid.finestSpacing()),
      cache(caches.grid.cache.span(), memory),
      brick(caches.grid.brick.span(), memory),
      fine(caches.grid.fine.span(), memory),
      sight(caches, memory),
      positionWorld(memory) {
  std::uint32_t end = 0;
  for (const auto* const index : {&caches.grid.cache, &caches.grid.fine}) {
    for (const std::uint32_t each : *index) {
      if (each < kHangingPoint) end = std::max(end, each + 1);
    }
  }
  positionWorld.assign(caches.positionWorld.begin(), caches.positionWorld.begin() + end);
}

PackedMap::PackedMap(const Caches& caches, std::pmr::memory_resource* memory)
    : width(caches.lightmap.width),
      height(caches.lightmap.height),
      cache(caches.lightmap.cache.span(), memory),
      firstCache(caches.firstMapCache()),
      normal(memory),
      sight(caches.lightmap.sight.begin(), caches.lightmap.sight.end(), memory) {
  normal.reserve(caches.count() - firstCache);
  for (std::uint32_t each = firstCache; each < caches.count(); ++each)
    normal.push_back(packOctahedral(caches.normal[each]));
}

PackedCaches::PackedCaches(const Caches& caches, std::pmr::memory_resource* memory)
    : count_(caches.count()), grid_(caches, memory), map_(caches, memory) {}

std::size_t PackedCaches::placeBytes() const {
  return sizeof(glm::vec3) * grid_.positionWorld.size() + sizeof(std::uint32_t) * map_.normal.size();
}

std::size_t PackedCaches::indexBytes() const {
  return map_.cache.bytes() + grid_.cache.bytes() + grid_.brick.bytes() + grid_.fine.bytes() + grid_.sight.bytes() +
         sizeof(std::uint32_t) * map_.sight.size();
}

}  // namespace relume
