// SPDX-License-Identifier: MIT
// See match_caches.h.
#include "tools/compare/match_caches.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace relume {
namespace {

constexpr std::uint32_t kNothing = PointIndex::kNothing;

int bucketOf(float v, float bucketSize) {
  return static_cast<int>(std::clamp(std::floor(v / bucketSize), -1e6f, 1e6f));
}

std::uint64_t keyOf(int x, int y, int z) {
  const auto bits = [](int v) { return static_cast<std::uint64_t>(v + (1 << 20)) & 0x1FFFFF; };
  return bits(x) | bits(y) << 21 | bits(z) << 42;
}

// Caches on surfaces, or those of the grid.
std::vector<std::uint32_t> cachesOf(const Bake& bake, bool onSurface) {
  std::vector<std::uint32_t> list;
  for (std::uint32_t i = 0; i < bake.caches.count(); ++i) {
    if ((bake.caches.normal[i] != glm::vec3(0.0f)) == onSurface) list.push_back(i);
  }
  return list;
}

float lightmapSpacing(const Bake& bake, std::size_t caches) {
  const double area = static_cast<double>(bake.surfels.areaEach) * bake.surfels.count();
  return caches > 0 ? static_cast<float>(std::sqrt(area / static_cast<double>(caches))) : 0.0f;
}

float gridSpacing(const Bake& bake) {
  const CacheGrid& grid = bake.caches.grid;
  return grid.cache.empty() ? 0.0f : std::min({grid.spacing.x, grid.spacing.y, grid.spacing.z});
}

// Pair caches of one kind; caches of B without a partner of their own take the nearest of A's.
void pairUp(const Bake& a, const Bake& b, bool onSurface, float tolerance, CacheMatch& match) {
  const std::vector<std::uint32_t> ofA = cachesOf(a, onSurface), ofB = cachesOf(b, onSurface);
  if (!(tolerance > 0.0f)) tolerance = 1e-3f;
  const PointIndex indexB(b.caches.positionWorld, ofB, tolerance);
  for (const std::uint32_t i : ofA) {
    const glm::vec3& p = a.caches.positionWorld[i];
    const std::uint32_t partner = indexB.nearest(p, a.caches.normal[i], b.caches.normal);
    if (partner == kNothing)
      ++match.onlyInA;
    else
      match.pairs.push_back({i, partner, glm::distance(p, b.caches.positionWorld[partner])});
  }
}

void findPartnersOfB(const Bake& a, const Bake& b, CacheMatch& match) {
  std::vector<std::uint32_t> pairOfA(a.caches.count(), kNothing);
  for (std::uint32_t i = 0; i < match.pairs.size(); ++i) pairOfA[match.pairs[i].a] = i;
  match.partnerOfB.assign(b.caches.count(), kNothing);
  for (const bool onSurface : {true, false}) {
    const float tolerance = std::max(onSurface ? match.surfaceTolerance : match.gridTolerance, 1e-3f);
    const std::vector<std::uint32_t> ofA = cachesOf(a, onSurface);
    const PointIndex indexA(a.caches.positionWorld, ofA, tolerance);
    for (const std::uint32_t i : cachesOf(b, onSurface)) {
      const std::uint32_t partner = indexA.nearest(b.caches.positionWorld[i], b.caches.normal[i], a.caches.normal);
      if (partner == kNothing)
        ++match.onlyInB;
      else
        match.partnerOfB[i] = pairOfA[partner];
    }
  }
}

}  // namespace

PointIndex::PointIndex(std::span<const glm::vec3> points, std::span<const std::uint32_t> subset, float bucketSize)
    : points_(points), bucketSize_(bucketSize) {
  for (const std::uint32_t i : subset) {
    const glm::vec3& p = points[i];
    buckets_[keyOf(bucketOf(p.x, bucketSize), bucketOf(p.y, bucketSize), bucketOf(p.z, bucketSize))].push_back(i);
  }
}

template <class Penalty>
std::uint32_t PointIndex::search(const glm::vec3& p, const Penalty& penalty) const {
  std::uint32_t best = kNothing;
  float min = bucketSize_ * bucketSize_;
  const int x = bucketOf(p.x, bucketSize_), y = bucketOf(p.y, bucketSize_), z = bucketOf(p.z, bucketSize_);
  for (int n = 0; n < 27; ++n) {
    const auto found = buckets_.find(keyOf(x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1));
    if (found == buckets_.end()) continue;
    for (const std::uint32_t i : found->second) {
      const glm::vec3 d = points_[i] - p;
      const float distance = glm::dot(d, d);
      if (distance > bucketSize_ * bucketSize_) continue;
      const float cost = distance + penalty(i);
      if (cost < min || (cost == min && i < best)) {
        min = cost;
        best = i;
      }
    }
  }
  return best;
}

std::uint32_t PointIndex::nearest(const glm::vec3& p, const glm::vec3& normal,
                                  std::span<const glm::vec3> normals) const {
  const bool sphere = normal == glm::vec3(0.0f);
  return search(p, [&](std::uint32_t i) {
    if (sphere) return normals[i] == glm::vec3(0.0f) ? 0.0f : 2.0f * bucketSize_ * bucketSize_;
    const float cosine = glm::dot(normal, normals[i]);
    return bucketSize_ * bucketSize_ * (cosine > 0.7f ? 1.0f - std::min(cosine, 1.0f) : 2.0f);
  });
}

std::uint32_t PointIndex::nearest(const glm::vec3& p) const {
  return search(p, [](std::uint32_t) { return 0.0f; });
}

CacheMatch matchCaches(const Bake& a, const Bake& b) {
  CacheMatch match;
  match.surfaceTolerance =
      std::max(lightmapSpacing(a, cachesOf(a, true).size()), lightmapSpacing(b, cachesOf(b, true).size()));
  match.gridTolerance = 0.5f * std::max(gridSpacing(a), gridSpacing(b));
  pairUp(a, b, true, match.surfaceTolerance, match);
  pairUp(a, b, false, match.gridTolerance, match);
  std::sort(match.pairs.begin(), match.pairs.end(), [](const CachePair& x, const CachePair& y) { return x.a < y.a; });
  findPartnersOfB(a, b, match);
  return match;
}

std::vector<std::uint32_t> partsOfCaches(const Bake& bake) {
  const Surfels& s = bake.surfels;
  std::vector<std::uint32_t> all(s.count());
  std::iota(all.begin(), all.end(), 0u);
  const float reach = std::max({lightmapSpacing(bake, cachesOf(bake, true).size()), gridSpacing(bake),
                                2.0f * std::sqrt(std::max(s.areaEach, 0.0f)), 1e-3f});
  // Small buckets first: most caches have a surfel close by.
  const PointIndex near(s.positionWorld, all, std::max(2.0f * std::sqrt(std::max(s.areaEach, 0.0f)), 1e-3f));
  const PointIndex far(s.positionWorld, all, reach);
  std::vector<std::uint32_t> parts(bake.caches.count(), kNothing);
  for (std::uint32_t i = 0; i < bake.caches.count(); ++i) {
    const glm::vec3& p = bake.caches.positionWorld[i];
    std::uint32_t surfel = near.nearest(p);
    if (surfel == kNothing) surfel = far.nearest(p);
    if (surfel != kNothing && s.instance[surfel] < bake.instances.size()) parts[i] = s.instance[surfel];
  }
  return parts;
}

}  // namespace relume
