// SPDX-License-Identifier: MIT
// Every ray asks for every light: for what the surfel at its end receives of it, and, so that nothing is missing that
// surfels lose, for the light there itself of one of them, drawn among those that may reach the place:
//
//   E = sum of E_surfel + c (E_there - E_surfel of the one), c: how many it is drawn from
//
// A few of the rays go on, for the light of further bounces.
#include "bake/certificate/test_rays.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/links/directions.h"
#include "bake/rays/seen_surface.h"
#include "bake/reference/path_tracer.h"
#include "formats/frame_about.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cstddef>
#include <numbers>
#include <span>

namespace relume {
namespace {

constexpr std::uint32_t kRayStage = 0x63726179, kDrawStage = 0x63647277;  // the random streams' stages
constexpr std::uint32_t kRays = 32;                                       // of a set, at a receiver
constexpr std::uint32_t kGoOn = 8;                                        // one of so many rays goes on
constexpr std::uint32_t kMostBounces = 16;
constexpr float kMostSurvival = 0.8f;
constexpr std::uint64_t kLeastReceivers = 256, kMostReceivers = 8192;
constexpr std::size_t kGrain = 16;  // receivers
constexpr std::size_t kBlock = DirectionStrata::kBlock;
constexpr float kPi = std::numbers::pi_v<float>;

glm::vec3 startAt(const RayTracer& tracer, const SeenSurface& seen) {
  return seen.positionWorld + seen.geometricNormal * tracer.epsilonAt(seen.positionWorld);
}

// Cosine-weighted about the unit normal.
glm::vec3 cosineDirection(const glm::vec3& normal, const glm::vec2& u) {
  return glm::normalize(frameAbout(normal) * hemisphereDirection(u.x, u.y, 0.0f));
}

// Irradiance by each light along the rays of one set.
class Gather {
 public:
  struct Place {
    glm::vec3 positionWorld, normal, geometricNormal;
  };

  Gather(const RayTracer& tracer, const PlacedSurfels& surfels, std::span<const TestLight> lights)
      : tracer_(tracer), surfels_(surfels), lights_(lights), strata_(kRays, 0.0f) {
    bySurfel_.resize(surfels.surfels.count() * lights.size(), 0.0f);
    for (std::size_t l = 0; l < lights.size(); ++l) {
      const std::vector<float>& irradiance = lights[l].surfelIrradiance;
      for (std::size_t s = 0; s < irradiance.size(); ++s) bySurfel_[s * lights.size() + l] = irradiance[s];
    }
    none_.resize(lights.size(), 0.0f);
  }

  // Adds to `once` [W/m²] [Size lights] what arrives after one bounce, and to `later` what others add to it.
  void at(const Place& place, RandomStream directions, RandomStream& random, std::span<glm::vec3> once,
          std::span<glm::vec3> later) const {
    const glm::vec3 origin = place.positionWorld + place.geometricNormal * tracer_.epsilonAt(place.positionWorld);
    DirectionStrata::Sequence sequence(strata_, place.normal, directions);
    std::array<DirectionStrata::Sample, kBlock> samples;
    std::vector<Ray> rays;
    std::vector<float> shares;
    std::array<Hit, kBlock> hits;
    Drawn drawn;
    for (std::size_t block = 0; block < strata_.count() / kBlock; ++block) {
      sequence.next(samples);
      rays.clear();
      shares.clear();
      for (const DirectionStrata::Sample& sample : samples) {
        if (glm::dot(sample.direction, place.geometricNormal) <= 0.0f) continue;
        rays.push_back({origin, 0.0f, sample.direction});
        // E = sum of L pi w cos, w = 1 / (pi p K)
        shares.push_back(kPi * sample.weight * sample.cosine);
      }
      tracer_.trace(rays, hits, RayOrder::coherent);
      const std::size_t goesOn = random.below(kGoOn);
      // Surfels of all hits first, so that waiting for memory is not one after another.
      std::array<std::uint32_t, kBlock> surfel;
      for (std::size_t i = 0; i < rays.size(); ++i) surfel[i] = hits[i] ? surfelAt(hits[i]) : kNone;
      for (std::size_t i = 0; i < rays.size(); ++i) __builtin_prefetch(ofSurfel(surfel[i]).data());
      for (std::size_t i = 0; i < rays.size(); ++i) {
        if (!hits[i]) {
          addSky(glm::vec3(shares[i]), once);
          continue;
        }
        const SeenSurface seen = seenAt(tracer_.scene(), rays[i], hits[i]);
        const glm::vec3 reflected = albedoAt(tracer_.scene(), seen.point) * (shares[i] / kPi);
        addReflected(seen, surfel[i], reflected, random, once, drawn);
        if (i % kGoOn == goesOn) goOn(seen, reflected * static_cast<float>(kGoOn), random, later);
      }
      addDrawn(drawn, once);
    }
  }

 private:
  // Lights that were drawn, of a block of rays: what is to be added where they reach the place.
  struct Drawn {
    std::vector<Ray> toLight;
    std::vector<std::size_t> light;
    std::vector<glm::vec3> irradiance;
  };

  std::uint32_t surfelAt(const Hit& hit) const {
    const Instance& instance = tracer_.scene().instances[hit.instance];
    return surfels_.map.at(2 * (instance.firstTriangle + hit.triangle) + (hit.back ? 1u : 0u), hit.barycentric);
  }

  // What a surfel receives of each light; kNone: nothing.
  std::span<const float> ofSurfel(std::uint32_t surfel) const {
    return surfel == kNone ? std::span(none_) : std::span(bySurfel_).subspan(surfel * none_.size(), none_.size());
  }

  void addSky(const glm::vec3& share, std::span<glm::vec3> irradiance) const {
    for (std::size_t l = 0; l < lights_.size(); ++l) {
      if (lights_[l].kind == TestLightKind::sky) irradiance[l] += share;
    }
  }

  void addReflected(const SeenSurface& seen, std::uint32_t surfel, const glm::vec3& reflected, RandomStream& random,
                    std::span<glm::vec3> irradiance, Drawn& drawn) const {
    const glm::vec3 origin = startAt(tracer_, seen);
    const std::span<const float> bySurfel = ofSurfel(surfel);
    std::uint32_t candidates = 0;
    std::size_t picked = 0;
    float there = 0.0f;
    Ray toLight;
    for (std::size_t l = 0; l < lights_.size(); ++l) {
      if (lights_[l].kind == TestLightKind::sky) continue;
      irradiance[l] += reflected * bySurfel[l];
      glm::vec3 direction;
      float distance = 0.0f;
      const float unshadowed = lightIrradiance(lights_[l].light, origin, seen.geometricNormal, direction, distance).x;
      if (!(unshadowed > 0.0f) && !(bySurfel[l] > 0.0f)) continue;
      // Each of n candidates in turn takes the place of the one before with 1 / n, so that all are alike in the end.
      if (random.below(++candidates) != 0) continue;
      picked = l;
      there = unshadowed;
      toLight = {origin, 0.0f, direction, distance};
    }
    if (candidates == 0) return;
    const glm::vec3 each = reflected * static_cast<float>(candidates);
    irradiance[picked] -= each * bySurfel[picked];
    if (!(there > 0.0f)) return;
    drawn.toLight.push_back(toLight);
    drawn.light.push_back(picked);
    drawn.irradiance.push_back(each * there);
  }

  // Adds what is not in shadow, and empties the list.
  void addDrawn(Drawn& drawn, std::span<glm::vec3> irradiance) const {
    std::array<std::uint8_t, kBlock> occluded;
    tracer_.occluded(drawn.toLight, occluded);
    for (std::size_t i = 0; i < drawn.toLight.size(); ++i) {
      if (occluded[i] == 0) irradiance[drawn.light[i]] += drawn.irradiance[i];
    }
    drawn.toLight.clear();
    drawn.light.clear();
    drawn.irradiance.clear();
  }

  // Follow the light of further bounces back, lit as surfels are.
  void goOn(SeenSurface seen, const glm::vec3& reflected, RandomStream& random, std::span<glm::vec3> irradiance) const {
    glm::vec3 throughput(1.0f);
    for (std::uint32_t bounce = 0; bounce < kMostBounces; ++bounce) {
      if (seen.geometricNormal == glm::vec3(0.0f)) return;
      const Ray ray{startAt(tracer_, seen), 0.0f, cosineDirection(seen.geometricNormal, random.uniform2())};
      const Hit hit = tracer_.trace(ray);
      if (!hit) return addSky(reflected * throughput * kPi, irradiance);
      const std::uint32_t surfel = surfelAt(hit);
      if (surfel == kNone) return;
      throughput *= surfels_.surfels.albedo[surfel];
      const std::span<const float> bySurfel = ofSurfel(surfel);
      for (std::size_t l = 0; l < lights_.size(); ++l) irradiance[l] += reflected * throughput * bySurfel[l];
      const float survival = std::min(kMostSurvival, std::max({throughput.x, throughput.y, throughput.z}));
      if (random.uniform() >= survival) return;
      throughput /= survival;
      seen = seenAt(tracer_.scene(), ray, hit);
    }
  }

  const RayTracer& tracer_;
  const PlacedSurfels& surfels_;
  std::span<const TestLight> lights_;
  DirectionStrata strata_;
  std::vector<float> bySurfel_;  // [W/m²] the lights of one surfel side by side: a hit finds them together
  std::vector<float> none_;
};

}  // namespace

Result<TestRays> traceTestRays(const RayTracer& tracer, const PlaySpace& space, const PlacedSurfels& surfels,
                               const Hierarchy& hierarchy, const PlacedCaches& caches, std::uint64_t rays,
                               std::uint64_t seed, Context& context) {
  TestRays test;
  const auto wanted = static_cast<std::size_t>(std::clamp(rays / (2 * kRays), kLeastReceivers, kMostReceivers));
  test.receivers = findTestReceivers(tracer, space, caches, wanted, seed, context);
  test.lights = chooseTestLights(tracer, space, surfels.surfels, hierarchy, test.receivers, seed, context);
  const std::size_t lights = test.lights.size();
  if (context.cancelled()) return cancelledError();

  const TestReceivers& receivers = test.receivers;
  const Gather gather(tracer, surfels, test.lights);
  for (auto& set : test.irradiance) set.resize(receivers.count() * lights, glm::vec3(0.0f));
  std::vector<glm::vec3> later(receivers.count() * lights, glm::vec3(0.0f));  // both sets together
  parallelChunks(context, "test rays", receivers.count(), kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint64_t number = receivers.number[i];
      for (std::size_t set = 0; set < test.irradiance.size(); ++set) {
        RandomStream random(seed, kDrawStage, 2 * number + set);
        gather.at({receivers.positionWorld[i], receivers.normal[i], receivers.geometricNormal[i]},
                  RandomStream(seed, kRayStage, 2 * number + set), random,
                  std::span(test.irradiance[set]).subspan(i * lights, lights),
                  std::span(later).subspan(i * lights, lights));
      }
    }
  });
  if (context.cancelled()) return cancelledError();

  std::vector<double> sum(lights, 0.0);
  for (std::size_t i = 0; i < later.size(); ++i) {
    const glm::vec3 all = test.irradiance[0][i] + test.irradiance[1][i] + later[i];
    sum[i % lights] += static_cast<double>(all.x + all.y + all.z) / 6.0;
  }
  for (const double light : sum)
    test.meanLight.push_back(receivers.count() == 0
                                 ? 0.0f
                                 : static_cast<float>(std::max(0.0, light / static_cast<double>(receivers.count()))));
  return test;
}

}  // namespace relume
