// SPDX-License-Identifier: MIT
// See visible_centroid.h. Surfels near each other cast their rays together, one direction at a time, so that packets of
// rays stay together.
#include "bake/hierarchy/visible_centroid.h"

#include "bake/base/morton.h"
#include "bake/base/parallel.h"
#include "bake/base/parallel_sort.h"
#include "formats/sphere_points.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <utility>

namespace relume {
namespace {

constexpr std::uint32_t kDirections = 32;  // over the sphere; a surfel uses those above its plane
constexpr float kMinCosine = 0.05f;        // of a direction with the normal
constexpr std::size_t kTogether = 64;      // surfels that cast their rays together
constexpr float kMortonSteps = 1023.0f;    // along the longest axis, for sorting the surfels

std::array<glm::vec3, kDirections> lookDirections() {
  std::array<glm::vec3, kDirections> directions;
  for (std::uint32_t i = 0; i < kDirections; ++i) {
    const glm::vec3 p = spherePoint(i, kDirections);
    directions[i] = {p.x, p.z, p.y};
  }
  return directions;
}

// Sort the surfels along a curve through space, those whose normals lie in the same octant together.
std::vector<std::uint32_t> alongCurve(const Surfels& surfels, const glm::vec3& low, const glm::vec3& high,
                                      Context& context) {
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keys(surfels.count());
  const glm::vec3 scale = kMortonSteps / glm::max(high - low, glm::vec3(1e-30f));
  for (std::uint32_t i = 0; i < keys.size(); ++i) {
    const glm::vec3 p = (surfels.positionWorld[i] - low) * scale, n = surfels.normal[i];
    const std::uint64_t octant = (n.x < 0.0f ? 1 : 0) + (n.y < 0.0f ? 2 : 0) + (n.z < 0.0f ? 4 : 0);
    keys[i] = {octant << 60 | mortonOf(p), i};
  }
  sortByThreads(context, keys, std::less<>());
  std::vector<std::uint32_t> order;
  order.reserve(keys.size());
  for (const auto& [key, surfel] : keys) order.push_back(surfel);
  return order;
}

// Where a surfel's rays start, and what they found.
struct Looking {
  glm::vec3 from{0.0f}, offset{0.0f};
  float weight = 0.0f;
};

}  // namespace

std::vector<glm::vec3> visibleCentroids(const RayTracer& tracer, const Surfels& surfels, Context& context) {
  const std::array<glm::vec3, kDirections> directions = lookDirections();
  const glm::vec3 low = tracer.boundsMin(), high = tracer.boundsMax();
  const float reach = kCentroidReach * glm::length(high - low);
  const std::vector<std::uint32_t> order = alongCurve(surfels, low, high, context);
  if (context.cancelled()) return {};
  std::vector<glm::vec3> centroids(surfels.count());

  parallelChunks(context, "", order.size(), kTogether, [&](std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    std::array<Looking, kTogether> looking;
    std::array<Ray, kTogether> rays;
    std::array<Hit, kTogether> hits;
    std::array<std::uint32_t, kTogether> who;
    for (std::size_t i = 0; i < count; ++i) {
      const std::uint32_t s = order[begin + i];
      const glm::vec3& position = surfels.positionWorld[s];
      looking[i].from = position + surfels.normal[s] * std::max(1e-4f * reach, 4.0f * tracer.epsilonAt(position));
    }
    for (const glm::vec3& direction : directions) {
      std::size_t rayCount = 0;
      for (std::size_t i = 0; i < count; ++i) {
        if (!(glm::dot(direction, surfels.normal[order[begin + i]]) > kMinCosine)) continue;
        rays[rayCount] = Ray{looking[i].from, 0.0f, direction, reach};
        who[rayCount++] = static_cast<std::uint32_t>(i);
      }
      tracer.trace(std::span(rays).first(rayCount), hits, RayOrder::coherent);
      for (std::size_t k = 0; k < rayCount; ++k) {
        Looking& l = looking[who[k]];
        const float cosine = glm::dot(direction, surfels.normal[order[begin + who[k]]]);
        l.offset += cosine * (hits[k] ? hits[k].distance : reach) * direction;
        l.weight += cosine;
      }
    }
    for (std::size_t i = 0; i < count; ++i) {
      centroids[order[begin + i]] = looking[i].from + looking[i].offset / std::max(looking[i].weight, 1e-6f);
    }
  });
  if (context.cancelled()) return {};
  return centroids;
}

}  // namespace relume
