// SPDX-License-Identifier: MIT
// See hit_radiance.h.
#include "bake/base/random.h"
#include "bake/preview/hit_radiance.h"
#include "bake/rays/seen_surface.h"
#include "bake/reference/emitters.h"
#include "bake/reference/path_tracer.h"
#include "bake/scene/sky.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

constexpr std::uint32_t kDirectStage = 0x72637364;  // the random streams' stage

// A cosine-weighted direction about n: a uniform point of the sphere on top of it.
glm::vec3 cosineDirection(const glm::vec3& n, const glm::vec2& u) {
  const float z = 1.0f - 2.0f * u.x, radius = std::sqrt(std::max(0.0f, 1.0f - z * z)),
              angle = 2.0f * std::numbers::pi_v<float> * u.y;
  const glm::vec3 sum = n + glm::vec3(radius * std::cos(angle), radius * std::sin(angle), z);
  const float length = glm::length(sum);
  return length > 1e-3f ? sum / length : n;
}

}  // namespace

HitRadiance directRadiance(const RayTracer& transport, const RayTracer& drawn, std::span<const SceneLight> lights,
                           const EmittingTriangles* emitters, const Sky& sky, std::uint64_t seed) {
  return [&transport, &drawn, lights, emitters, &sky, seed](std::uint64_t item, float spread, std::span<const Ray> rays,
                                                            std::span<const Hit> hits, std::span<glm::vec3> radiance) {
    const Scene& scene = transport.scene();
    RandomStream random(seed, kDirectStage, item);
    std::vector<float> chances;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!hits[i]) continue;
      const SeenSurface seen = seenAt(scene, rays[i], hits[i]);
      const glm::vec3 albedo = albedoAt(scene, seen.point, spread * hits[i].distance);
      if (albedo == glm::vec3(0.0f)) continue;
      glm::vec3 irradiance = directIrradiance(drawn, lights, seen.positionWorld, seen.normal);
      const glm::vec3 origin = seen.positionWorld + seen.geometricNormal * transport.epsilonAt(seen.positionWorld);
      if (emitters != nullptr && !emitters->empty()) {
        emitters->aim(origin, seen.normal, chances);
        const double u = random.uniform();
        const EmitterSample point = emitters->sample(chances, u, random.uniform2());
        irradiance += connectEmitter(transport, point, origin, seen.normal, seen.geometricNormal).irradiance();
      }
      if (!sky.isDark()) {
        const glm::vec3 direction = cosineDirection(seen.normal, random.uniform2());
        if (glm::dot(direction, seen.geometricNormal) > 0.0f && !transport.occluded({origin, 0.0f, direction}))
          irradiance += std::numbers::pi_v<float> * sky.along(direction);
      }
      radiance[i] = irradiance * albedo / std::numbers::pi_v<float>;
    }
  };
}

}  // namespace relume
