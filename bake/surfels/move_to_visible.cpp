// SPDX-License-Identifier: MIT
// See move_to_visible.h.
#include "bake/surfels/move_to_visible.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/surfels/by_surfel.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

namespace relume {
namespace {

constexpr std::uint32_t kMinHits = 3;
constexpr float kSameWay = 0.85f;  // cosine of normals: a surfel does not move to a face that looks elsewhere
constexpr std::size_t kRaysAtOnce = 4096;
constexpr std::uint32_t kMoveStage = 0x5E771Eu;

// What a ray found: a point of a surfel's footprint.
struct Sight {
  std::uint32_t side;
  glm::vec2 barycentric;
  glm::vec3 positionWorld;
};
struct Sights {
  std::vector<std::uint32_t> surfel;  // of each ray; kNone = it found none
  std::unique_ptr<Sight[]> found;     // of rays that found one
};

// The point of the unit square at `at` [0, 1) along a Morton curve, jittered within a square of 1/256 side. Values of
// `at` that are evenly spread give evenly spread points, and values near each other give points near each other.
glm::vec2 alongMortonCurve(float at, const glm::vec2& jitter) {
  const auto code = static_cast<std::uint32_t>(at * 65536.0f);
  const auto everySecondBit = [](std::uint32_t v) {
    v &= 0x5555u;
    v = (v | v >> 1) & 0x3333u;
    v = (v | v >> 2) & 0x0F0Fu;
    v = (v | v >> 4) & 0x00FFu;
    return static_cast<float>(v);
  };
  return (glm::vec2(everySecondBit(code), everySecondBit(code >> 1)) + jitter) / 256.0f;
}

glm::vec3 sphereDirection(const glm::vec2& u) {
  const float z = 1.0f - 2.0f * u.x;
  const float r = std::sqrt(std::max(0.0f, 1.0f - z * z));
  const float phi = 2.0f * std::numbers::pi_v<float> * u.y;
  return {r * std::cos(phi), r * std::sin(phi), z};
}

// Look around from where receivers can be: the same number of rays from each point, spread over the sphere.
Sights lookAround(const RayTracer& tracer, const PlaySpace& playSpace, const SurfelMap& map,
                  std::span<const SurfaceSample> surfels, std::size_t rayCount, std::uint64_t seed, Context& context) {
  const Scene& scene = tracer.scene();
  Sights sights;
  sights.surfel.assign(rayCount, kNone);
  sights.found = std::make_unique_for_overwrite<Sight[]>(rayCount);
  const std::size_t receiverCount = playSpace.receivers.size();
  parallelChunks(context, "", rayCount, kRaysAtOnce, [&](std::size_t begin, std::size_t end) {
    std::vector<Ray> rays(end - begin);
    std::vector<Hit> hits(end - begin);
    for (std::size_t i = begin; i < end; ++i) {
      RandomStream random(seed, kMoveStage, i);
      const std::size_t receiver = i * receiverCount / rayCount;
      const std::size_t first = (receiver * rayCount + receiverCount - 1) / receiverCount,
                        next = ((receiver + 1) * rayCount + receiverCount - 1) / receiverCount;
      const float at = (static_cast<float>(i - first) + random.uniform()) / static_cast<float>(next - first);
      rays[i - begin].origin = playSpace.receivers[receiver];
      rays[i - begin].direction = sphereDirection(alongMortonCurve(at, random.uniform2()));
    }
    tracer.trace(rays, hits);
    for (std::size_t i = begin; i < end; ++i) {
      const Hit& hit = hits[i - begin];
      if (!hit) continue;
      const std::uint32_t side = 2 * (scene.instances[hit.instance].firstTriangle + hit.triangle) + (hit.back ? 1 : 0);
      const std::uint32_t surfel = map.at(side, hit.barycentric);
      if (surfel == kNone) continue;
      const glm::vec3 front = geometricNormal(scene, hit.point());
      const glm::vec3 normal = hit.back ? -front : front;
      if (!(glm::dot(normal, surfels[surfel].normal) > kSameWay)) continue;
      sights.surfel[i] = surfel;
      sights.found[i] = {side, hit.barycentric, rays[i - begin].origin + hit.distance * rays[i - begin].direction};
    }
  });
  return sights;
}

}  // namespace

std::vector<SurfelSeed> moveToVisible(const RayTracer& tracer, const PlaySpace& playSpace, const SurfelMap& map,
                                      std::span<const SurfaceSample> surfels, std::uint64_t seed, Context& context) {
  std::vector<SurfelSeed> seeds(surfels.size());
  const auto stay = [&](std::size_t s) {
    seeds[s] = {surfels[s].positionWorld, surfels[s].normal, surfels[s].point, surfels[s].side};
  };
  if (playSpace.receivers.empty()) {
    for (std::size_t s = 0; s < surfels.size(); ++s) stay(s);
    return seeds;
  }
  const Sights sights = lookAround(tracer, playSpace, map, surfels, kMoveRaysPerSurfel * surfels.size(), seed, context);
  if (context.cancelled()) return {};
  std::vector<glm::vec3> middle(surfels.size(), glm::vec3(0.0f));
  std::vector<std::uint32_t> count(surfels.size(), 0);
  std::vector<float> nearest(surfels.size(), INFINITY);
  std::vector<const Sight*> chosen(surfels.size(), nullptr);
  forEachSurfelRange(context, surfels.size(), [&](std::size_t first, std::size_t last) {
    // Find the middle of what is seen of each footprint. Sums run in the order of the rays.
    forEachSampleOf(sights.surfel, first, last, [&](std::size_t i) {
      // Sum offsets from the surfel: sums of positions far from the origin would lose digits.
      const std::uint32_t s = sights.surfel[i];
      middle[s] += sights.found[i].positionWorld - surfels[s].positionWorld;
      ++count[s];
    });
    for (std::size_t s = first; s < last; ++s) {
      if (count[s] > 0) middle[s] = surfels[s].positionWorld + middle[s] / static_cast<float>(count[s]);
    }

    // Choose the seen point nearest to it.
    forEachSampleOf(sights.surfel, first, last, [&](std::size_t i) {
      const std::uint32_t s = sights.surfel[i];
      if (count[s] < kMinHits) return;
      const glm::vec3 way = sights.found[i].positionWorld - middle[s];
      const float distance = glm::dot(way, way);
      if (!(distance < nearest[s])) return;
      nearest[s] = distance;
      chosen[s] = &sights.found[i];
    });
    const Scene& scene = tracer.scene();
    for (std::size_t s = first; s < last; ++s) {
      if (chosen[s] == nullptr) {
        stay(s);
        continue;
      }
      const SurfaceSample at =
          sampleAt(scene, scene.instanceOf(chosen[s]->side / 2), chosen[s]->side, chosen[s]->barycentric);
      seeds[s] = {chosen[s]->positionWorld, at.normal, at.point, at.side};
    }
  });
  if (context.cancelled()) return {};
  return seeds;
}

}  // namespace relume
