// SPDX-License-Identifier: MIT
// See test_rays.h.
#include "bake/certificate/test_rays.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/links/directions.h"
#include "bake/reference/path_tracer.h"
#include "bake/visibility/find_starts.h"
#include "bake/visibility/surface_parts.h"

#include <algorithm>
#include <cstddef>
#include <numbers>
#include <span>

namespace relume {
namespace {

constexpr std::uint32_t kSeenStage = 0x63736565, kRayStage = 0x63726179;  // the random streams' stages
constexpr std::uint32_t kRaysPerLight = 16;                               // of a set, at a receiver
constexpr std::uint64_t kLeastReceivers = 256, kMostReceivers = 8192;
constexpr std::uint32_t kTries = 8;  // to see a surfel from somewhere
constexpr std::size_t kGrain = 16;   // receivers
constexpr float kPi = std::numbers::pi_v<float>;

std::size_t sideOf(const Scene& scene, const Hit& hit) {
  return 2 * (std::size_t{scene.instances[hit.instance].firstTriangle} + hit.triangle) + (hit.back ? 1 : 0);
}

// What is seen from where players are: every other one from a camera or a play volume, if the level has any, the others
// from where walks passed.
class Sights {
 public:
  Sights(const RayTracer& tracer, const PlaySpace& space, const SurfelMap& map)
      : tracer_(tracer), space_(space), map_(map), sources_(tracer.scene()) {}

  std::uint32_t find(bool fromSource, RandomStream random) const {
    for (std::uint32_t i = 0; i < kTries; ++i) {
      Start start;
      if (!sources_.empty() && (fromSource || space_.receivers.empty()))
        start = drawStart(sources_, random);
      else if (!space_.receivers.empty())
        start = {space_.receivers[random.below(static_cast<std::uint32_t>(space_.receivers.size()))],
                 uniformDirection(random.uniform2())};
      else
        break;
      const Hit hit = tracer_.trace({start.position, 0.0f, start.direction});
      if (!hit) continue;
      const std::uint32_t surfel = map_.at(static_cast<std::uint32_t>(sideOf(tracer_.scene(), hit)), hit.barycentric);
      if (surfel != kNone) return surfel;
    }
    return kNone;
  }

 private:
  const RayTracer& tracer_;
  const PlaySpace& space_;
  const SurfelMap& map_;
  StartSources sources_;
};

// Irradiance by each light along the rays of one set: each ray asks for one sun or lamp, in turn, and for the sky.
class Gather {
 public:
  Gather(const RayTracer& tracer, std::span<const TestLight> lights)
      : tracer_(tracer), lights_(lights), strata_(kRaysPerLight * static_cast<std::uint32_t>(lights.size()), 0.0f) {
    for (std::size_t l = 0; l < lights.size(); ++l) {
      if (lights[l].kind != TestLightKind::sky) punctual_.push_back(l);
    }
  }

  void at(const glm::vec3& position, const glm::vec3& normal, RandomStream random,
          std::span<glm::vec3> irradiance) const {
    constexpr std::size_t kBlock = DirectionStrata::kBlock;
    const glm::vec3 origin = position + normal * tracer_.epsilonAt(position);
    DirectionStrata::Sequence sequence(strata_, normal, random);
    std::array<DirectionStrata::Sample, kBlock> samples;
    std::array<Ray, kBlock> rays;
    std::array<Hit, kBlock> hits;
    for (std::size_t block = 0; block < strata_.count() / kBlock; ++block) {
      sequence.next(samples);
      for (std::size_t i = 0; i < kBlock; ++i) rays[i] = Ray{origin, 0.0f, samples[i].direction};
      tracer_.trace(rays, hits, RayOrder::coherent);
      for (std::size_t i = 0; i < kBlock; ++i) {
        // E = sum of L pi w cos, w = 1 / (pi p K)
        const float share = kPi * samples[i].weight * samples[i].cosine;
        if (hits[i])
          addReflected(hits[i], share, block + i, irradiance);
        else
          addSky(share, irradiance);
      }
    }
  }

 private:
  void addSky(float share, std::span<glm::vec3> irradiance) const {
    for (std::size_t l = 0; l < lights_.size(); ++l) {
      if (lights_[l].kind == TestLightKind::sky) irradiance[l] += share;
    }
  }

  void addReflected(const Hit& hit, float share, std::size_t turn, std::span<glm::vec3> irradiance) const {
    if (punctual_.empty()) return;
    const std::size_t l = punctual_[turn % punctual_.size()];
    const Scene& scene = tracer_.scene();
    const SurfacePoint point = hit.point();
    const glm::vec3 normal = (hit.back ? -1.0f : 1.0f) * geometricNormal(scene, point);
    const glm::vec3 position = pointOf(scene.corners(scene.instances[hit.instance], hit.triangle), hit.barycentric);
    const glm::vec3 direct = directIrradiance(tracer_, std::span(&lights_[l].light, 1),
                                              position + normal * tracer_.epsilonAt(position), normal);
    irradiance[l] += albedoAt(scene, point) * direct * (share / kPi * static_cast<float>(punctual_.size()));
  }

  const RayTracer& tracer_;
  std::span<const TestLight> lights_;
  std::vector<std::size_t> punctual_;
  DirectionStrata strata_;
};

}  // namespace

Result<TestRays> traceTestRays(const RayTracer& tracer, const PlaySpace& space, const Surfels& surfels,
                               const SurfelMap& map, const Hierarchy& hierarchy, std::uint64_t rays, std::uint64_t seed,
                               Context& context) {
  TestRays test;
  test.lights = chooseTestLights(tracer, space, surfels, hierarchy, seed, context);
  const std::size_t lights = test.lights.size();
  if (context.cancelled()) return cancelledError();
  if (lights == 0) return test;
  const std::uint64_t each = std::uint64_t{2} * kRaysPerLight * lights;
  const auto count = static_cast<std::size_t>(std::clamp(rays / each, kLeastReceivers, kMostReceivers));

  std::vector<std::uint32_t> seen(count);
  const Sights sights(tracer, space, map);
  parallelChunks(context, "", count, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) seen[i] = sights.find(i % 2 == 0, RandomStream(seed, kSeenStage, i));
  });
  for (const std::uint32_t surfel : seen) {
    if (surfel != kNone) test.receiver.push_back(surfel);
  }

  const Gather gather(tracer, test.lights);
  for (auto& set : test.irradiance) set.resize(test.receiver.size() * lights);
  parallelChunks(context, "test rays", test.receiver.size(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t s = test.receiver[i];
      for (std::size_t set = 0; set < test.irradiance.size(); ++set)
        gather.at(surfels.positionWorld[s], surfels.normal[s], RandomStream(seed, kRayStage, 2 * i + set),
                  std::span(test.irradiance[set]).subspan(i * lights, lights));
    }
  });
  if (context.cancelled()) return cancelledError();
  return test;
}

}  // namespace relume
