// SPDX-License-Identifier: MIT
// See sorted_surfels.h.
#include "bake/surfels/sorted_surfels.h"

#include "bake/base/parallel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume {
namespace {

constexpr float kRadiusRounding = 1.0f + 1e-5f;  // keeps rounding errors from cutting a search's radius short
// By how much a cost may be below the squared distance: of itself, and of squared spacings.
constexpr float kCostRounding = 1.0f + 1e-5f, kCostRoundings = 4e-6f;
constexpr float kRoundings = 4.0f * std::numeric_limits<float>::epsilon();  // the same, of coordinates

}  // namespace

std::uint32_t SortedSurfels::best(const MapPoint& point, float reach) const {
  const glm::vec3& p = point.positionWorld;
  const float slack = kRoundings * std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)});
  const float roundings = kCostRoundings * spacing * spacing;
  float bestCost = kNoMapping;
  std::uint32_t found = kNone;
  const auto search = [&](float radius) {
    grid.forEachRunIn(grid.boxAround(p, radius * kRadiusRounding + slack), [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) {
        // Most are too far away to be better, whatever else they cost.
        const glm::vec3 apart = surfel[i].positionWorld - p;
        if (glm::dot(apart, apart) > bestCost * kCostRounding + roundings) continue;
        const float cost = mapCost(point, surfel[i], spacing, reach);
        if (!(cost < kNoMapping) || cost > bestCost || (cost == bestCost && id[i] >= found)) continue;
        bestCost = cost;
        found = id[i];
      }
    });
  };
  // The nearest buckets give a cost to begin with. It is never less than the squared distance, so nothing beyond its
  // root matters.
  const float first = std::min(0.5f * grid.bucketSize(), reach);
  search(first);
  const float last = std::min(std::sqrt(bestCost), reach);
  if (last > first) search(last);
  return found;
}

SortedSurfels sortSurfels(const PlaySpace& playSpace, std::span<const SurfaceSample> surfels, float spacing, bool far,
                          Context& context) {
  std::vector<std::uint32_t> which;
  float min = 1.0f;
  for (std::uint32_t i = 0; i < surfels.size(); ++i) {
    if (playSpace.isFar(surfels[i].side) != far) continue;
    which.push_back(i);
    if (far) min = std::min(min, surfels[i].density);
  }
  SortedSurfels sorted;
  sorted.spacing = spacing / std::sqrt(std::max(min, 1e-30f));
  std::vector<glm::vec3> position;
  position.reserve(which.size());
  for (const std::uint32_t i : which) position.push_back(surfels[i].positionWorld);
  sorted.grid = PointGrid(position, sorted.spacing, context);
  sorted.id.resize(which.size());
  sorted.surfel.resize(which.size());
  parallelChunks(context, "", which.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      sorted.id[i] = which[sorted.grid.order()[i]];
      sorted.surfel[i] = mapPoint(surfels[sorted.id[i]]);
    }
  });
  return sorted;
}

}  // namespace relume
