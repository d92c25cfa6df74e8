// SPDX-License-Identifier: MIT
// See hit_light.h.
#include "tools/render/hit_light.h"

#include "bake/rays/seen_surface.h"
#include "bake/reference/path_tracer.h"
#include "bake/surfels/map_cost.h"
#include "bake/surfels/surfel_map.h"
#include "tools/render/seen_surface.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

constexpr float kInvPi = std::numbers::inv_pi_v<float>;
constexpr float kBucketSpacings = 1.5f;  // width of a bucket

bool isLit(const glm::vec3& c) { return c.x > 0.0f || c.y > 0.0f || c.z > 0.0f; }

}  // namespace

HitRadiance linkRadiance(const RayTracer& drawn, std::span<const SceneLight> lights, const Bake& bake,
                         const Relighter& relighter) {
  return [&drawn, lights, &bake, &relighter](std::uint64_t, std::span<const Ray> rays, std::span<const Hit> hits,
                                             std::span<glm::vec3> radiance) {
    const Scene& scene = drawn.scene();
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!hits[i]) continue;
      const SeenSurface seen = seenAt(scene, rays[i], hits[i]);
      const glm::vec3 albedo = albedoAt(scene, seen.point);
      if (!isLit(albedo)) continue;
      const glm::vec3 irradiance = directIrradiance(drawn, lights, seen.positionWorld, seen.normal) +
                                   linkIrradiance(scene, bake, relighter, seen);
      radiance[i] = kInvPi * albedo * irradiance;
    }
  };
}

SurfelFinder::SurfelFinder(const Bake& bake, Context& context)
    : surfels_(bake.surfels),
      spacing_(std::max(std::sqrt(bake.surfels.areaEach), 1e-6f)),
      grid_(bake.surfels.positionWorld.span(), kBucketSpacings * spacing_, context) {}

std::uint32_t SurfelFinder::find(const glm::vec3& positionWorld, const glm::vec3& normal,
                                 std::uint32_t instance) const {
  const float reach = static_cast<float>(kSeenReach) * spacing_;
  const MapPoint point{positionWorld, normal, instance, 0};
  std::uint32_t best = kNone;
  float bestCost = kNoMapping;
  for (int rings = 1; static_cast<float>(rings - 1) * grid_.bucketSize() < reach; rings *= 2) {
    grid_.forEachRun(positionWorld, rings, [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) {
        const std::uint32_t s = grid_.order()[i];
        const float cost =
            mapCost(point, {surfels_.positionWorld[s], surfels_.normal[s], surfels_.instance[s], 0}, spacing_, reach);
        if (cost < bestCost || (cost == bestCost && s < best)) bestCost = cost, best = s;
      }
    });
    // Costs are squared distances at least: what is farther away cannot be better.
    const float seen = static_cast<float>(rings) * grid_.bucketSize();
    if (bestCost <= seen * seen) break;
  }
  return best;
}

HitRadiance surfelRadiance(const Scene& scene, const Bake& bake, const Relighter& relighter, const SurfelFinder& finder,
                           HitRadiance other) {
  const std::vector<glm::vec3> nodes = relighter.nodeRadiosity();
  std::vector<glm::vec3> radiance(bake.surfels.count());
  for (std::uint32_t s = 0; s < radiance.size(); ++s) radiance[s] = kInvPi * nodes[bake.hierarchy.leafNode[s]];
  const auto emits = [&bake](std::uint32_t s) { return isLit(bake.surfels.emission[s]); };
  return [&scene, emits, &finder, other = std::move(other), radiance = std::move(radiance)](
             std::uint64_t item, std::span<const Ray> rays, std::span<const Hit> hits, std::span<glm::vec3> found) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!hits[i]) continue;
      const float side = hits[i].back ? -1.0f : 1.0f;
      const std::uint32_t s = finder.find(rays[i].origin + hits[i].distance * rays[i].direction,
                                          side * geometricNormal(scene, hits[i].point()), hits[i].instance);
      if (s != kNone && !emits(s))
        found[i] = radiance[s];
      else
        other(item, rays.subspan(i, 1), hits.subspan(i, 1), found.subspan(i, 1));
    }
  };
}

}  // namespace relume
