// SPDX-License-Identifier: MIT
// See test_receivers.h.
#include "bake/certificate/test_receivers.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/rays/seen_surface.h"
#include "bake/scene/camera_rays.h"
#include "bake/visibility/find_starts.h"
#include "formats/frame_about.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace relume {
namespace {

constexpr std::uint32_t kSeenStage = 0x63736565;                // the random streams' stage
constexpr std::uint32_t kElsewhere = 8;                         // one of so many receivers is not a camera's
constexpr std::uint32_t kTries = 8;                             // to see something from somewhere
constexpr std::size_t kReceiverGrain = 16;                      // receivers
constexpr std::uint32_t kRows = 360;                            // of a camera's picture
constexpr float kDefaultAspect = 16.0f / 9.0f;                  // of cameras whose aspect is the viewport's
constexpr float kPixelRad = 0.003f;                             // of pictures from other places
constexpr float kPlaneTolerance = 0.02f, kCosTolerance = 0.9f;  // edges, as tests/accuracy has them
constexpr float kLeastAlbedo = 0.02f;

// Rays through a pixel and its four neighbours.
using PixelRays = std::array<Ray, 5>;

struct Seen {
  SurfelSeed seed;
  glm::vec3 geometricNormal{0.0f};
};

bool isEdge(const SeenSurface& a, float depthA, const SeenSurface& b, float depthB) {
  const glm::vec3 step = b.positionWorld - a.positionWorld;
  const float off = std::max(std::abs(glm::dot(step, a.normal)), std::abs(glm::dot(step, b.normal)));
  return off > kPlaneTolerance * std::min(depthA, depthB) || glm::dot(a.normal, b.normal) < kCosTolerance;
}

// Pictures from where players are.
class Sights {
 public:
  Sights(const RayTracer& tracer, const PlaySpace& space)
      : tracer_(tracer), places_(space.receivers), sources_(tracer.scene()) {
    for (const Camera& camera : sources_.cameras) {
      const float aspect = camera.aspect > 0.0f ? camera.aspect : kDefaultAspect;
      const auto columns = static_cast<std::uint32_t>(std::clamp(aspect * kRows, 1.0f, 16384.0f));
      cameras_.emplace_back(camera, columns, kRows);
    }
  }

  std::optional<Seen> find(bool byCamera, RandomStream random) const {
    for (std::uint32_t i = 0; i < kTries; ++i) {
      PixelRays rays;
      if (!cameras_.empty() && (byCamera || places_.empty()))
        rays = throughCamera(random);
      else if (!places_.empty())
        rays = from(places_[random.below(static_cast<std::uint32_t>(places_.size()))],
                    uniformDirection(random.uniform2()));
      else if (!sources_.empty()) {
        const Start start = drawStart(sources_, random);
        rays = from(start.position, start.direction);
      } else
        break;
      if (auto seen = look(rays)) return seen;
    }
    return std::nullopt;
  }

 private:
  PixelRays throughCamera(RandomStream& random) const {
    const CameraRays& camera = cameras_[random.below(static_cast<std::uint32_t>(cameras_.size()))];
    const glm::vec2 pixel = random.uniform2() * glm::vec2(camera.width, camera.height);
    constexpr std::array<glm::vec2, 5> kSteps{{{0, 0}, {1, 0}, {-1, 0}, {0, 1}, {0, -1}}};
    PixelRays rays;
    for (std::size_t i = 0; i < rays.size(); ++i)
      camera.at(pixel.x + kSteps[i].x, pixel.y + kSteps[i].y, rays[i].origin, rays[i].direction);
    return rays;
  }

  static PixelRays from(const glm::vec3& place, const glm::vec3& direction) {
    const glm::mat3 frame = frameAbout(direction);
    PixelRays rays;
    rays[0] = {place, 0.0f, direction};
    for (std::size_t i = 1; i < rays.size(); ++i) {
      const glm::vec3 step = frame[i < 3 ? 0 : 1] * (i % 2 == 1 ? kPixelRad : -kPixelRad);
      rays[i] = {place, 0.0f, glm::normalize(direction + step)};
    }
    return rays;
  }

  // What the pixel shows, if that counts.
  std::optional<Seen> look(const PixelRays& rays) const {
    const Scene& scene = tracer_.scene();
    std::array<Hit, 5> hits;
    tracer_.trace(rays, hits, RayOrder::coherent);
    if (!hits[0]) return std::nullopt;
    SeenSurface seen = seenAt(scene, rays[0], hits[0]);
    if (seen.normal == glm::vec3(0.0f)) seen.normal = seen.geometricNormal;
    if (seen.normal == glm::vec3(0.0f)) return std::nullopt;
    for (std::size_t i = 1; i < rays.size(); ++i) {
      if (!hits[i] || isEdge(seen, hits[0].distance, seenAt(scene, rays[i], hits[i]), hits[i].distance))
        return std::nullopt;
    }
    const glm::vec3 albedo = albedoAt(scene, seen.point);
    if (std::max({albedo.x, albedo.y, albedo.z}) < kLeastAlbedo || emissionAt(scene, seen.point) != glm::vec3(0.0f))
      return std::nullopt;
    const std::uint32_t triangle = scene.instances[seen.point.instance].firstTriangle + seen.point.triangle;
    return Seen{{seen.positionWorld, seen.normal, seen.point, 2 * triangle + (seen.back ? 1u : 0u)},
                seen.geometricNormal};
  }

  const RayTracer& tracer_;
  const std::vector<glm::vec3>& places_;
  StartSources sources_;
  std::vector<CameraRays> cameras_;
};

}  // namespace

TestReceivers findTestReceivers(const RayTracer& tracer, const PlaySpace& space, const PlacedCaches& caches,
                                std::size_t count, std::uint64_t seed, Context& context) {
  std::vector<std::optional<Seen>> seen(count);
  const Sights sights(tracer, space);
  parallelChunks(context, "", count, kReceiverGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      seen[i] = sights.find(i % kElsewhere != 0, RandomStream(seed, kSeenStage, i));
  });
  std::vector<SurfelSeed> seeds;
  TestReceivers receivers;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const std::optional<Seen>& one = seen[i];
    if (!one) continue;
    receivers.number.push_back(static_cast<std::uint32_t>(i));
    seeds.push_back(one->seed);
    receivers.positionWorld.push_back(one->seed.positionWorld);
    receivers.normal.push_back(one->seed.normal);
    receivers.geometricNormal.push_back(one->geometricNormal);
    receivers.instance.push_back(one->seed.point.instance);
  }
  receivers.at = findReceivers(tracer, caches, seeds, context);
  return receivers;
}

}  // namespace relume
