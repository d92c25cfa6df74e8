// SPDX-License-Identifier: MIT
// See hit_light.h.
#include "tools/render/hit_light.h"

#include "bake/base/random.h"
#include "bake/rays/seen_surface.h"
#include "bake/reference/path_tracer.h"
#include "tools/render/seen_surface.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

constexpr float kInvPi = std::numbers::inv_pi_v<float>;
constexpr std::uint32_t kHitStage = 0x72637365;  // the random streams' stage, and the next

bool isLit(const glm::vec3& c) { return c.x > 0.0f || c.y > 0.0f || c.z > 0.0f; }

// Light over links, without that of emitters where they are drawn.
glm::vec3 overLinks(const Scene& scene, const Bake& bake, const Relighter& relighter, const DrawnEmitters* emitters,
                    const SeenSurface& seen) {
  const glm::vec3 all = linkIrradiance(scene, bake, relighter, seen);
  if (emitters == nullptr) return all;
  return glm::max(all - linkIrradiance(scene, bake, emitters->overLinks, seen), glm::vec3(0.0f));
}

// Mean irradiance by one of the emitters' points for each of some points of a surface.
glm::vec3 fromEmitters(const DrawnEmitters& by, std::span<const glm::vec3> positions, const SeenSurface& seen,
                       RandomStream& random, std::vector<float>& chances) {
  const glm::vec3 off = seen.geometricNormal * by.transport.epsilonAt(positions.front());
  by.emitters.aim(positions.front() + off, seen.normal, chances);
  const auto count = static_cast<double>(positions.size());
  glm::vec3 sum(0.0f);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const double u = (static_cast<double>(i) + random.uniform()) / count;
    const EmitterSample point = by.emitters.sample(chances, u, random.uniform2());
    sum += connectEmitter(by.transport, point, positions[i] + off, seen.normal, seen.geometricNormal).irradiance();
  }
  return sum / static_cast<float>(count);
}

}  // namespace

HitRadiance linkRadiance(const RayTracer& drawn, std::span<const SceneLight> lights, const Bake& bake,
                         const Relighter& relighter, const DrawnEmitters* emitters) {
  return [&drawn, lights, &bake, &relighter, emitters](std::uint64_t item, float spread, std::span<const Ray> rays,
                                                       std::span<const Hit> hits, std::span<glm::vec3> radiance) {
    const Scene& scene = drawn.scene();
    std::vector<std::size_t> lit;  // rays that end on what reflects
    std::vector<SeenSurface> seen;
    std::vector<glm::vec3> albedo, position, normal;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!hits[i]) continue;
      const glm::vec3 reflected = albedoAt(scene, hits[i].point(), spread * hits[i].distance);
      if (!isLit(reflected)) continue;
      lit.push_back(i);
      albedo.push_back(reflected);
      seen.push_back(seenAt(scene, rays[i], hits[i]));
      position.push_back(seen.back().positionWorld);
      normal.push_back(seen.back().normal);
    }
    std::vector<glm::vec3> irradiance(lit.size());
    directIrradiance(drawn, lights, position, normal, irradiance);
    std::vector<float> chances;
    RandomStream random(emitters != nullptr ? emitters->seed : 0, kHitStage, item);
    for (std::size_t k = 0; k < lit.size(); ++k) {
      irradiance[k] += overLinks(scene, bake, relighter, emitters, seen[k]);
      if (emitters != nullptr) irradiance[k] += fromEmitters(*emitters, {&position[k], 1}, seen[k], random, chances);
      radiance[lit[k]] = kInvPi * albedo[k] * irradiance[k];
    }
  };
}

PatchRadiance linkPatchRadiance(const RayTracer& drawn, std::span<const SceneLight> lights, const Bake& bake,
                                const Relighter& relighter, const DrawnEmitters* emitters) {
  return [&drawn, lights, &bake, &relighter, emitters](std::span<const Ray> rays, std::span<const Hit> hits,
                                                       std::span<glm::vec3> radiance) {
    const Scene& scene = drawn.scene();
    std::vector<SeenSurface> seen;
    std::vector<glm::vec3> albedo, position, normal;
    for (std::size_t first = 0; first < rays.size(); first += kPatchPoints) {
      seen.push_back(seenAt(scene, rays[first], hits[first]));
      albedo.push_back(albedoAt(scene, hits[first].point(), hits[first].distance));
      if (!isLit(albedo.back())) continue;
      for (std::size_t i = first; i < first + kPatchPoints; ++i) {
        position.push_back(rays[i].origin + hits[i].distance * rays[i].direction);
        normal.push_back(seen.back().normal);
      }
    }
    std::vector<glm::vec3> irradiance(position.size());
    directIrradiance(drawn, lights, position, normal, irradiance);
    std::vector<float> chances;
    std::size_t at = 0;
    for (std::size_t k = 0; k < seen.size(); ++k) {
      if (!isLit(albedo[k])) continue;
      glm::vec3 sum = overLinks(scene, bake, relighter, emitters, seen[k]);
      for (unsigned p = 0; p < kPatchPoints; ++p) sum += irradiance[at + p] / float{kPatchPoints};
      if (emitters != nullptr) {
        const SurfacePoint& p = seen[k].point;
        RandomStream random(emitters->seed, kHitStage + 1,
                            hashCombine(std::uint64_t{p.instance} << 32 | p.triangle,
                                        std::uint64_t{std::bit_cast<std::uint32_t>(p.barycentric.x)} << 32 |
                                            std::bit_cast<std::uint32_t>(p.barycentric.y)));
        sum += fromEmitters(*emitters, std::span(position).subspan(at, kPatchPoints), seen[k], random, chances);
      }
      at += kPatchPoints;
      radiance[k] = kInvPi * albedo[k] * sum;
    }
  };
}

std::unique_ptr<const SurfelsOnDemand> mapSurfels(const Scene& scene, const Bake& bake, Context& context) {
  std::vector<SurfaceSample> samples(bake.surfels.count());
  for (std::uint32_t s = 0; s < samples.size(); ++s) {
    samples[s].positionWorld = bake.surfels.positionWorld[s];
    samples[s].normal = bake.surfels.normal[s];
    samples[s].point.instance = bake.surfels.instance[s];
    if (isLit(bake.surfels.emission[s])) samples[s].emitter = bake.surfels.instance[s];
  }
  return std::make_unique<const SurfelsOnDemand>(scene, samples, std::sqrt(bake.surfels.areaEach), context);
}

std::vector<glm::vec3> surfelRadiances(const Bake& bake, const Relighter& relighter) {
  const std::vector<glm::vec3> nodes = relighter.nodeRadiosity();
  std::vector<glm::vec3> radiance(bake.surfels.count());
  for (std::uint32_t s = 0; s < radiance.size(); ++s) radiance[s] = kInvPi * nodes[bake.hierarchy.leafNode[s]];
  return radiance;
}

HitLeaf surfelLeaves(const SurfelsOnDemand& map) {
  return [&map](std::span<const Ray>, std::span<const Hit> hits, std::span<std::uint32_t> leaf) { map.at(hits, leaf); };
}

HitRadiance surfelRadiance(const Bake& bake, const Relighter& relighter, const SurfelsOnDemand& map,
                           HitRadiance other) {
  constexpr float kEmits = -1.0f;  // in place of a radiance
  std::vector<glm::vec3> radiance = surfelRadiances(bake, relighter);
  for (std::uint32_t s = 0; s < radiance.size(); ++s) {
    if (isLit(bake.surfels.emission[s])) radiance[s].x = kEmits;
  }
  return [&map, other = std::move(other), radiance = std::move(radiance)](
             std::uint64_t item, float spread, std::span<const Ray> rays, std::span<const Hit> hits,
             std::span<glm::vec3> found) {
    std::vector<std::uint32_t> surfel(hits.size());
    map.at(hits, surfel);
    for (const std::uint32_t s : surfel) {
      if (s != kNone) __builtin_prefetch(&radiance[s]);
    }
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (!hits[i]) continue;
      const std::uint32_t s = surfel[i];
      if (s != kNone && radiance[s].x != kEmits)
        found[i] = radiance[s];
      else
        other(item, spread, rays.subspan(i, 1), hits.subspan(i, 1), found.subspan(i, 1));
    }
  };
}

}  // namespace relume
