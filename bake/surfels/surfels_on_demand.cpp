// SPDX-License-Identifier: MIT
// See surfels_on_demand.h. Which thread lays a side out, or looks for a tile, makes no difference to what is found.
#include "bake/surfels/surfels_on_demand.h"

#include "bake/surfels/sides_on_demand.h"
#include "bake/surfels/surfel_map.h"
#include "bake/surfels/tile_grid.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <memory>
#include <new>

namespace relume {
namespace {

using Tile = std::atomic<std::uint32_t>;  // index of the surfel, kNone or kUnknown

constexpr std::uint32_t kUnknown = kNone - 1;
constexpr std::size_t kFirstBytes = 1u << 20;
constexpr std::size_t kHitsAhead = 64;

}  // namespace

// Its tiles follow it in memory: rays ask for both.
struct SurfelsOnDemand::Side {
  TileGrid grid;
  float reach = 0.0f;  // [m] how far away surfels may be

  Tile* tiles() const { return reinterpret_cast<Tile*>(const_cast<Side*>(this) + 1); }
  std::uint32_t tileOf(const glm::vec2& barycentric) const {
    const glm::vec2 g = toTileGrid(barycentric, grid.corner);
    return tileAlong(g.y, grid.rows) * grid.columns + tileAlong(g.x, grid.columns);
  }
};

SurfelsOnDemand::SurfelsOnDemand(const Scene& scene, std::span<const SurfaceSample> surfels, float spacing,
                                 Context& context)
    : scene_(scene),
      surfels_(sortSurfels({}, surfels, spacing, false, context)),
      side_(2 * std::size_t{scene.triangleCount()}),
      memory_(kFirstBytes) {
  static_assert(sizeof(Side) % alignof(Tile) == 0 && alignof(Side) >= alignof(Tile));
}

const SurfelsOnDemand::Side& SurfelsOnDemand::layOut(std::size_t index, const Hit& hit) const {
  const Instance& instance = scene_.instances[hit.instance];
  Side made;
  made.grid.columns = made.grid.rows = 0;
  if (instance.baked() && geometricNormal(scene_, hit.point()) != glm::vec3(0.0f)) {
    const std::array<glm::vec3, 3> c = scene_.corners(instance, hit.triangle);
    const float area = 0.5f * glm::length(glm::cross(c[1] - c[0], c[2] - c[0]));
    const bool seen = area > 0.0f;
    made.grid = tileGridOf(c, surfels_.spacing * (seen ? kTileSpacings : kUnseenTileSpacings), area);
    made.reach = static_cast<float>(seen ? kSeenReach : kUnseenReach) * surfels_.spacing;
  }
  const std::uint32_t tiles = made.grid.tileCount();
  const std::lock_guard lock(growth_);
  if (const Side* const other = side_[index].load(std::memory_order_relaxed)) return *other;
  Side* const side = new (memory_.allocate(sizeof(Side) + tiles * sizeof(Tile), alignof(Side))) Side(made);
  std::uninitialized_fill_n(side->tiles(), tiles, kUnknown);
  side_[index].store(side, std::memory_order_release);
  return *side;
}

std::uint32_t SurfelsOnDemand::search(const Side& side, std::size_t index, std::uint32_t tile, const Hit& hit) const {
  const std::uint32_t column = tile % side.grid.columns, row = tile / side.grid.columns;
  if (!side.grid.isWithin(column, row)) return kNone;
  ++searches_;
  const TriangleShape triangle = TriangleShape::of(scene_, hit.instance, static_cast<std::uint32_t>(index / 2));
  return surfels_.best(triangle.pointOn(scene_, static_cast<std::uint32_t>(index), side.grid.middleOf(column, row)),
                       side.reach);
}

void SurfelsOnDemand::at(std::span<const Hit> hits, std::span<std::uint32_t> surfel) const {
  // Sides, then their tiles, lie all over memory: ask for all of them before the first is read.
  for (std::size_t begin = 0; begin < hits.size(); begin += kHitsAhead) {
    const std::span<const Hit> some = hits.subspan(begin, std::min(kHitsAhead, hits.size() - begin));
    std::array<const Side*, kHitsAhead> sides{};
    for (const Hit& hit : some) {
      if (hit) __builtin_prefetch(&side_[indexOf(hit)]);
    }
    for (std::size_t i = 0; i < some.size(); ++i) {
      if (!some[i]) continue;
      sides[i] = side_[indexOf(some[i])].load(std::memory_order_acquire);
      if (sides[i] != nullptr) __builtin_prefetch(sides[i]);
    }
    for (std::size_t i = 0; i < some.size(); ++i) {
      const Hit& hit = some[i];
      std::uint32_t& found = surfel[begin + i];
      found = kNone;
      if (!hit) continue;
      const Side& side = sides[i] != nullptr ? *sides[i] : layOut(indexOf(hit), hit);
      if (side.grid.tileCount() == 0) continue;
      const std::uint32_t tile = side.tileOf(hit.barycentric);
      found = side.tiles()[tile].load(std::memory_order_relaxed);
      if (found != kUnknown) continue;
      found = search(side, indexOf(hit), tile, hit);
      side.tiles()[tile].store(found, std::memory_order_relaxed);
    }
  }
}

}  // namespace relume
