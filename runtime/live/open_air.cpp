// SPDX-License-Identifier: MIT
// See open_air.h.
#include "runtime/live/open_air.h"

#include "formats/limits.h"
#include "runtime/voxels/march.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <bit>
#include <vector>

namespace relume {
namespace {

struct CacheAt {
  std::uint32_t cache;
  float distance;  // [voxels] from the receiver
};

bool isSeen(const CellSet& cells, const glm::vec3& from, const glm::vec3& cache) {
  const SubVoxels& subVoxels = cells.standing->subVoxels;
  return !VoxelMarch(cells.grid, subVoxels.bits.data(), from, cache - from)
              .first(1.0f, [&](const glm::ivec3& v) { return subVoxels.in(cells.grid, v); })
              .found;
}

// Whether a cache is among those that stand for `share` as many around them: the same ones wherever they are read from.
bool isDrawn(std::uint32_t cell, std::uint32_t share) { return (cell * 2654435769u >> 8) % share == 0; }

// The caches of all cells within so many of the place's own.
std::vector<CacheAt> cachesWithin(const CellSet& cells, const glm::vec3& position, int reach) {
  std::vector<CacheAt> found;
  const auto add = [&](std::uint32_t cache) {
    if (cache != kInactive) found.push_back({cache, std::max(glm::distance(cells.positionOf(cache), position), 1.0f)});
  };
  const glm::ivec3 own(position / static_cast<float>(kBrickSide)), low = glm::max(own - reach, 0),
                                                                   high = glm::min(own + reach, cells.grid.cells - 1);
  if (low == glm::ivec3(0) && high == cells.grid.cells - 1) {
    for (std::uint32_t cache = 0; cache < cells.active.size(); ++cache) add(cache);
    return found;
  }
  for (int z = low.z; z <= high.z; ++z) {
    for (int y = low.y; y <= high.y; ++y) {
      for (int x = low.x; x <= high.x; ++x) add(cells.slot[cells.grid.cellIndex({x, y, z})]);
    }
  }
  return found;
}

// Puts the nearest one in sight first, and takes out the hidden ones before it. False where there is none, or none of
// very many, as within something solid.
bool findNearest(const CellSet& cells, const glm::vec3& position, std::vector<CacheAt>& caches) {
  constexpr std::size_t kMostHidden = 128;
  const auto isFarther = [](const CacheAt& a, const CacheAt& b) {
    return a.distance != b.distance ? a.distance > b.distance : a.cache > b.cache;
  };
  std::make_heap(caches.begin(), caches.end(), isFarther);
  for (std::size_t hidden = 0; !caches.empty() && hidden < kMostHidden; ++hidden) {
    if (isSeen(cells, position, cells.positionOf(caches.front().cache))) return true;
    std::pop_heap(caches.begin(), caches.end(), isFarther);
    caches.pop_back();
  }
  return false;
}

// Caches in sight of a place [voxels] within 5/4 of the way to the nearest of them, which is `limit`; of many some.
std::vector<CacheAt> seenInTheOpen(const CellSet& cells, const glm::vec3& position, float& limit) {
  constexpr float kBeyondNearest = 1.25f;
  constexpr int kNear = 3, kMiddle = 8;  // [cells] what is so near to surfaces needs not look at all caches
  constexpr std::size_t kMost = 64;
  const int farthest = std::max({cells.grid.cells.x, cells.grid.cells.y, cells.grid.cells.z});
  for (const int reach : {kNear, kMiddle, farthest}) {
    std::vector<CacheAt> all = cachesWithin(cells, position, reach);
    if (!findNearest(cells, position, all)) continue;
    const CacheAt nearest = all.front();
    limit = kBeyondNearest * nearest.distance;
    if (reach < farthest && limit > static_cast<float>(kBrickSide * reach)) continue;
    std::erase_if(all, [&](const CacheAt& each) { return each.distance >= limit || each.cache == nearest.cache; });
    const auto share = static_cast<std::uint32_t>(std::bit_ceil(all.size() / kMost + 1));
    std::erase_if(all, [&](const CacheAt& each) {
      return !isDrawn(cells.active[each.cache], share) || !isSeen(cells, position, cells.positionOf(each.cache));
    });
    all.push_back(nearest);
    return all;
  }
  return {};
}

glm::vec3 irradianceInTheOpen(const VolumeCaches& caches, const glm::vec3& position, const glm::vec3& normal) {
  float limit = 0.0f;
  const std::vector<CacheAt> seen = seenInTheOpen(*caches.cells, position, limit);
  const auto weightOf = [&](const CacheAt& each) {
    return 1.0f / (each.distance * each.distance) - 1.0f / (limit * limit);
  };
  float sum = 0.0f;
  for (const CacheAt& each : seen) sum += weightOf(each);
  if (!(sum > 0.0f)) return glm::vec3(0.0f);
  CacheSum light;
  for (const CacheAt& each : seen) {
    CellStencil one;
    one.slot[0] = each.cache;
    one.weight[0] = 1.0f;
    light.add(one, weightOf(each) / sum, caches.coefficients, caches.brightest);
  }
  return light.irradiance(normal);
}

}  // namespace

glm::vec3 receivedIrradiance(std::span<const VolumeCaches> caches, const CacheSum& sky, const glm::vec3& positionWorld,
                             const glm::vec3& normal) {
  const NestedStencil stencil = nestedStencil(caches, positionWorld, normal);
  if (stencil.sky > 0.0f || std::any_of(stencil.share.begin(), stencil.share.end(), [](float s) { return s > 0.0f; }))
    return nestedIrradiance(caches, sky, stencil, normal);
  const CellSet& cells = *caches.front().cells;
  if (cells.active.empty() || !isWithin(positionWorld, kMaxCoordinate) || !(glm::dot(normal, normal) < 4.0f))
    return glm::vec3(0.0f);
  const glm::vec3 position = cells.grid.toGrid(positionWorld);
  if (glm::any(glm::lessThan(position, glm::vec3(0.0f))) ||
      glm::any(glm::greaterThanEqual(position, glm::vec3(cells.grid.voxels()))))
    return glm::vec3(0.0f);
  return irradianceInTheOpen(caches.front(), position, normal);
}

}  // namespace relume
