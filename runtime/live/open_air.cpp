// SPDX-License-Identifier: MIT
// See open_air.h.
#include "runtime/live/open_air.h"

#include "formats/limits.h"
#include "runtime/voxels/march.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace relume {
namespace {

struct SeenCache {
  std::uint32_t cache;
  float distance;  // [voxels]
};

bool isSeen(const CellSet& cells, const glm::vec3& from, const glm::vec3& cache) {
  const SubVoxels& subVoxels = cells.standing->subVoxels;
  return !VoxelMarch(cells.grid, subVoxels.bits.data(), from, cache - from)
              .first(1.0f, [&](const glm::ivec3& v) { return subVoxels.in(cells.grid, v); })
              .found;
}

// Caches in sight of a place within the grid, of whose cell and neighbours none has one: those within `limit` [voxels].
// Cells are looked at in cubes around its own, each out of the one before; what is nearer than a cube's inside is
// known.
std::vector<SeenCache> seenInTheOpen(const CellSet& cells, const glm::vec3& position, float& limit) {
  constexpr float kBeyondNearest = 1.25f;
  constexpr std::size_t kMostHidden = 1024;  // after so many that are not seen, none is: within something solid
  std::size_t hidden = 0;
  std::vector<SeenCache> seen;
  const glm::ivec3 middle(glm::floor(position / static_cast<float>(kBrickSide))), last = cells.grid.cells - 1;
  const int farthest = std::max({cells.grid.cells.x, cells.grid.cells.y, cells.grid.cells.z});
  limit = std::numeric_limits<float>::infinity();
  const auto look = [&](const glm::ivec3& cell) {
    const std::uint32_t cache = cells.slot[cells.grid.cellIndex(cell)];
    if (cache == kInactive) return;
    const glm::vec3 at = glm::vec3(cells.voxelIn(cell, cache)) + 0.5f;
    const float distance = std::max(glm::distance(at, position), 1.0f);
    if (distance >= limit) return;
    if (!isSeen(cells, position, at)) {
      ++hidden;
      return;
    }
    seen.push_back({cache, distance});
    limit = std::min(limit, kBeyondNearest * distance);
  };
  for (int r = 0; r <= farthest && static_cast<float>(kBrickSide * (r - 1)) < limit && hidden < kMostHidden; ++r) {
    const glm::ivec3 low = middle - r, high = middle + r, from = glm::max(low, 0), to = glm::min(high, last);
    for (int z = from.z; z <= to.z; ++z) {
      for (int y = from.y; y <= to.y; ++y) {
        const bool isFace = z == low.z || z == high.z || y == low.y || y == high.y;
        // Of a row inside the cube its two ends alone
        for (int x = isFace ? from.x : low.x; x <= to.x; x += isFace || r == 0 ? 1 : 2 * r) {
          if (x >= from.x) look({x, y, z});
        }
      }
    }
  }
  std::erase_if(seen, [&](const SeenCache& each) { return each.distance >= limit; });
  return seen;
}

glm::vec3 irradianceInTheOpen(const VolumeCaches& caches, const glm::vec3& position, const glm::vec3& normal) {
  float limit = 0.0f;
  const std::vector<SeenCache> seen = seenInTheOpen(*caches.cells, position, limit);
  const auto weightOf = [&](const SeenCache& each) {
    return 1.0f / (each.distance * each.distance) - 1.0f / (limit * limit);
  };
  float sum = 0.0f;
  for (const SeenCache& each : seen) sum += weightOf(each);
  if (!(sum > 0.0f)) return glm::vec3(0.0f);
  CacheSum light;
  for (const SeenCache& each : seen) {
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
