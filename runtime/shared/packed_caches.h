// SPDX-License-Identifier: MIT
// What receivers read of a bake's caches beside their light, packed: which cache is where, positions of the grid's and
// how far they see, normals of the light map's. A fifth to a third of what the bake's own arrays take, which can go.
#pragma once

#include "formats/pack.h"
#include "relume/caches.h"
#include "runtime/shared/cache_index.h"
#include "runtime/shared/grid_sight.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <vector>

namespace relume {

// CacheGrid has the same.
struct PackedGrid {
  PackedGrid(const Caches& caches, std::pmr::memory_resource* memory);

  glm::uvec3 resolution;
  glm::vec3 originWorld, spacing;  // [m]
  float depthUnit, finestSpacing;  // [m]
  CacheIndex cache, brick, fine;
  GridSight sight;
  std::pmr::vector<glm::vec3> positionWorld;  // [m] [Size caches that the grid reads, up to the last of them]

  glm::uvec3 cells() const { return glm::max(resolution, glm::uvec3(2)) - 1u; }
};

// Lightmap has the same.
struct PackedMap {
  PackedMap(const Caches& caches, std::pmr::memory_resource* memory);

  std::uint32_t width, height;  // [texel]
  CacheIndex cache;
  std::uint32_t firstCache;                // Caches::firstMapCache()
  std::pmr::vector<std::uint32_t> normal;  // [Size caches from there on] packOctahedral()
  std::pmr::vector<std::uint32_t> sight;

  // Unit, or zero for a cache that gathers the sphere.
  glm::vec3 normalOf(std::uint32_t number) const {
    return number < firstCache ? glm::vec3(0.0f) : unpackOctahedral(normal[number - firstCache]);
  }
};

class PackedCaches {
 public:
  // Of caches that passed checkBake(). memory: keeps all of this.
  PackedCaches(const Caches& caches, std::pmr::memory_resource* memory);
  PackedCaches(const PackedCaches&) = delete;
  PackedCaches& operator=(const PackedCaches&) = delete;

  std::uint32_t count() const { return count_; }
  std::uint32_t firstMapCache() const { return map_.firstCache; }
  const PackedGrid& grid() const { return grid_; }
  const PackedMap& map() const { return map_; }
  std::size_t placeBytes() const;
  std::size_t indexBytes() const;

 private:
  std::uint32_t count_;
  PackedGrid grid_;
  PackedMap map_;
};

}  // namespace relume
