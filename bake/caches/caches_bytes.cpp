// SPDX-License-Identifier: MIT
// See caches_bytes.h.
#include "bake/caches/caches_bytes.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace relume {
namespace {

template <class T>
void take(ByteReader& from, Array<T>& array) {
  std::vector<T> values;
  from.array(values);
  array = std::move(values);
}

bool isPoint(const glm::vec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

bool isDirection(const glm::vec3& n) {
  constexpr float kOff = 1e-3f;
  const float length2 = n.x * n.x + n.y * n.y + n.z * n.z;
  return length2 == 0.0f || std::abs(length2 - 1.0f) < kOff;
}

bool fits(const Caches& caches, const Scene& scene) {
  const Lightmap& map = caches.lightmap;
  const std::uint64_t corners = 3ull * scene.triangleCount();
  if (caches.positionWorld.empty() || caches.positionWorld.size() > kMaxCaches ||
      caches.normal.size() != caches.positionWorld.size() ||
      !std::all_of(caches.positionWorld.begin(), caches.positionWorld.end(), isPoint) ||
      !std::all_of(caches.normal.begin(), caches.normal.end(), isDirection))
    return false;
  if (!map.sight.empty() && map.sight.size() != map.cache.size()) return false;
  if (map.cornerUv.empty()) return map.parts.empty() && map.backCornerUv.empty();
  if (map.cornerUv.size() != corners || map.parts.size() != scene.instances.size() ||
      (!map.backCornerUv.empty() && map.backCornerUv.size() != corners))
    return false;
  for (std::size_t i = 0; i < map.parts.size(); ++i) {
    if (map.parts[i].firstCorner != 3ull * scene.instances[i].firstTriangle) return false;
  }
  return true;
}

}  // namespace

void writeCaches(const PlacedCaches& caches, ByteWriter& to) {
  to.array(caches.positionWorld.span());
  to.array(caches.normal.span());
  const CacheGrid& grid = caches.grid;
  to.value(grid.resolution);
  to.value(grid.originWorld);
  to.value(grid.spacing);
  for (const auto* array : {&grid.cache, &grid.brick, &grid.fine, &grid.depth}) to.array(array->span());
  const Lightmap& map = caches.lightmap;
  to.value(map.width);
  to.value(map.height);
  to.array(map.cache.span());
  to.array(map.sight.span());
  static_assert(sizeof(LightmapPart) == 24, "no padding");
  to.array(map.parts.span());
  to.array(unpackCorners(caches.corners.front).span());
  to.array(unpackCorners(caches.corners.back).span());
}

std::optional<PlacedCaches> readCaches(ByteReader& from, const Scene& scene) {
  PlacedCaches caches;
  take(from, caches.positionWorld);
  take(from, caches.normal);
  CacheGrid& grid = caches.grid;
  from.value(grid.resolution);
  from.value(grid.originWorld);
  from.value(grid.spacing);
  for (auto* array : {&grid.cache, &grid.brick, &grid.fine, &grid.depth}) take(from, *array);
  Lightmap& map = caches.lightmap;
  from.value(map.width);
  from.value(map.height);
  take(from, map.cache);
  take(from, map.sight);
  take(from, map.parts);
  take(from, map.cornerUv);
  take(from, map.backCornerUv);
  if (!from.isAll() || !fits(caches, scene)) return std::nullopt;
  caches.corners = {packCorners(map.cornerUv), packCorners(map.backCornerUv)};
  map.cornerUv = map.backCornerUv = {};
  return caches;
}

}  // namespace relume
