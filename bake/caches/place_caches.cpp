// SPDX-License-Identifier: MIT
// Entry point of the room: places the grid and the light map, joins their caches, and finds where pixels and surfels
// read their own irradiance.
#include "bake/caches/caches.h"

#include "bake/base/parallel.h"
#include "bake/caches/grid/place_grid.h"
#include "bake/caches/lightmap/place_lightmap.h"
#include "bake/caches/map_sight.h"
#include "formats/pack.h"

#include <algorithm>
#include <string>
#include <utility>

namespace relume {

namespace {

// Warn of surfaces that are marked to read the grid when there is none: they stay dark.
void warnWithoutGrid(const Scene& scene, Context& context) {
  const auto reads = [&](const Instance& instance) {
    return instance.baked() && !instance.charted() && !scene.meshes[instance.mesh].triangle.empty();
  };
  const auto first = std::find_if(scene.instances.begin(), scene.instances.end(), reads);
  if (first == scene.instances.end()) return;
  const auto more = std::count_if(first + 1, scene.instances.end(), reads);
  context.message(Severity::warning, "node \"" + first->node + "\"" +
                                         (more > 0 ? " and " + std::to_string(more) + " more are" : " is") +
                                         " gridLit, but this bake has no grid: bounced light is missing there; give "
                                         "--grid-caches, or take gridLit off");
}

}  // namespace

Caches unpack(PlacedCaches placed) {
  placed.lightmap.cornerUv = unpackCorners(std::move(placed.corners.front));
  placed.lightmap.backCornerUv = unpackCorners(std::move(placed.corners.back));
  return std::move(static_cast<Caches&>(placed));
}

Result<PlacedCaches> placeCaches(const RayTracer& tracer, const PlaySpace& playSpace, const CacheOptions& options,
                                 std::uint64_t /*seed: nothing here is random*/, Context& context) {
  // 1. The grid
  Result<PlacedGrid> placedGrid = placeGrid(tracer, playSpace, options, context);
  if (context.cancelled()) return cancelledError();
  if (!placedGrid) return placedGrid.error();
  PlacedGrid grid = std::move(*placedGrid);

  if (grid.position.empty()) warnWithoutGrid(tracer.scene(), context);

  // 2. The light map
  PlacedLightmap lightmap;
  if (options.lightmapCaches > 0 || options.lightmapSize > 0) {
    auto placed = placeLightmap(tracer, playSpace, options, !grid.position.empty(), context);
    if (context.cancelled()) return cancelledError();
    if (placed)
      lightmap = std::move(*placed);
    else if (grid.position.empty() || placed.error().code == ErrorCode::memory)  // asked for, and too large
      return Error{ErrorCode::failed, placed.error().message};
    else
      context.message(Severity::warning, "no light map, everything reads the grid: " + placed.error().message);
  }
  if (grid.position.empty() && lightmap.caches.empty())
    return Error{ErrorCode::failed,
                 "neither the grid nor the light map has a valid cache: every place lies inside geometry or out of the "
                 "play space"};

  // 3. One list of unique caches
  PlacedCaches caches;
  const auto base = static_cast<std::uint32_t>(grid.position.size());
  std::vector<glm::vec3> position = std::move(grid.position), normal(base, glm::vec3(0.0f));
  for (const SurfaceCache& c : lightmap.caches) {
    position.push_back(c.positionWorld);
    normal.push_back(c.normal);
  }
  std::vector<std::uint32_t> texels = lightmap.lightmap.cache.toVector();
  for (std::uint32_t& texel : texels) {
    if (texel != kNoCache) texel += base;
  }
  lightmap.lightmap.cache = std::move(texels);
  caches.positionWorld = std::move(position);
  caches.normal = std::move(normal);
  caches.grid = std::move(grid.grid);
  caches.lightmap = std::move(lightmap.lightmap);
  caches.corners = std::move(lightmap.corners);
  if (caches.positionWorld.size() > kMaxCaches) {
    return Error{ErrorCode::usage, "caches: " + std::to_string(caches.positionWorld.size()) + " are more than the " +
                                       std::to_string(kMaxCaches) +
                                       " of a bake; ask for fewer on the light map or in the grid"};
  }
  context.figure("caches", caches.count());
  auto sight = findMapSight(tracer, caches, context);
  if (context.cancelled()) return cancelledError();
  if (!sight) return sight.error();
  caches.lightmap.sight = std::move(*sight);
  return caches;
}

std::vector<std::uint32_t> findReceivers(const RayTracer& tracer, const PlacedCaches& caches,
                                         std::span<const SurfelSeed> seeds, Context& context) {
  const Scene& scene = tracer.scene();
  const Lightmap& map = caches.lightmap;
  std::vector<std::uint32_t> receivers(seeds.size(), kGridReceiver);
  if (caches.corners.front.empty()) return receivers;
  parallelChunks(context, "", seeds.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const SurfacePoint& point = seeds[i].point;
      const bool back = (seeds[i].side & 1u) != 0;
      const MapCorners::Side& corners = back ? caches.corners.back : caches.corners.front;
      if (corners.empty()) continue;
      const TriangleCorners& uv = corners[map.parts[point.instance].firstCorner / 3 + point.triangle];
      // Barycentrics weigh world corners, which a mirroring instance swaps.
      const bool flipped = scene.instances[point.instance].flipped;
      const std::uint32_t a = uv[0], b = uv[flipped ? 2 : 1], c = uv[flipped ? 1 : 2];
      if (a == kGridLit || b == kGridLit || c == kGridLit) continue;
      const glm::vec2& w = point.barycentric;
      receivers[i] =
          packUnorm16x2((1.0f - w.x - w.y) * unpackUnorm16x2(a) + w.x * unpackUnorm16x2(b) + w.y * unpackUnorm16x2(c));
    }
  });
  return receivers;
}

}  // namespace relume
