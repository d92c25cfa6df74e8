// SPDX-License-Identifier: MIT
// See test_lights.h.
#include "bake/certificate/test_lights.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/reference/path_tracer.h"
#include "bake/visibility/find_starts.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

namespace relume {
namespace {

constexpr std::uint32_t kStage = 0x63657274;              // "cert": the random streams' stage
constexpr std::uint32_t kLightTries = 4;                  // of a light that reaches nothing
constexpr float kLeastLit = 1.0f / 256.0f;                // share of the surfels that a light must reach
constexpr float kLowestSun = 0.35f, kHighestSun = 0.95f;  // sine of its height
constexpr std::uint32_t kPlaces = 8;                      // tried for a lamp
constexpr float kRoom = 0.5f, kRoomAtWall = 0.15f;        // [m] about a lamp, where there is a place that has it
constexpr float kOffWall = 0.4f;                          // [m] of a lamp at a wall
constexpr std::uint32_t kLooks = 64;                      // rays that measure the room
constexpr std::size_t kSurfelGrain = 1024;                // surfels

SceneLight sunAt(float sine, float angle) {
  SceneLight sun;
  sun.kind = LightKind::directional;
  const float across = std::sqrt(1.0f - sine * sine);
  sun.direction = {-across * std::cos(angle), -sine, -across * std::sin(angle)};
  return sun;
}

// [m] The nearest of what rays meet all around.
float roomAt(const RayTracer& tracer, const glm::vec3& position, RandomStream& random) {
  float room = std::numeric_limits<float>::infinity();
  for (std::uint32_t i = 0; i < kLooks; ++i)
    room = std::min(room, tracer.trace({position, 0.0f, uniformDirection(random.uniform2())}).distance);
  return room;
}

// A place in free space: where a walk passed, or before a surfel.
glm::vec3 placeInAir(const RayTracer& tracer, const PlaySpace& space, const Surfels& surfels, RandomStream& random) {
  if (!space.receivers.empty())
    return space.receivers[random.below(static_cast<std::uint32_t>(space.receivers.size()))];
  const std::uint32_t s = random.below(surfels.count());
  const glm::vec3 from = surfels.positionWorld[s] + surfels.normal[s] * tracer.epsilonAt(surfels.positionWorld[s]);
  const float free = std::min(tracer.trace({from, 0.0f, surfels.normal[s]}).distance, 2.0f);
  return from + surfels.normal[s] * (free * random.uniform());
}

// Somewhere in the air, or at a wall that is seen from there, as torches hang.
SceneLight lampAt(const RayTracer& tracer, const PlaySpace& space, const Surfels& surfels, bool atWall,
                  RandomStream& random) {
  SceneLight lamp;
  float most = -1.0f;
  for (std::uint32_t i = 0; i < kPlaces && most < (atWall ? kRoomAtWall : kRoom); ++i) {
    glm::vec3 position = placeInAir(tracer, space, surfels, random);
    if (atWall) {
      const glm::vec3 direction = uniformDirection(random.uniform2());
      if (const Hit wall = tracer.trace({position, 0.0f, direction}))
        position += direction * std::max(0.0f, wall.distance - kOffWall);
    }
    const float room = roomAt(tracer, position, random);
    if (room > most) most = room, lamp.positionWorld = position;
  }
  return lamp;
}

// What reaches the surfels; nothing where that is too few of them.
std::optional<TestLight> lightSurfels(const RayTracer& tracer, const Surfels& surfels, TestLightKind kind,
                                      const SceneLight& light, Context& context) {
  TestLight lit{kind, light, std::vector<float>(surfels.count())};
  parallelChunks(context, "", surfels.count(), kSurfelGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<Ray> rays;
    std::vector<std::size_t> surfel;
    for (std::size_t s = begin; s < end; ++s) {
      const glm::vec3 from = surfels.positionWorld[s] + surfels.normal[s] * tracer.epsilonAt(surfels.positionWorld[s]);
      glm::vec3 toLight;
      float distance = 0.0f;
      lit.surfelIrradiance[s] = lightIrradiance(light, from, surfels.normal[s], toLight, distance).x;
      if (lit.surfelIrradiance[s] > 0.0f) rays.push_back({from, 0.0f, toLight, distance}), surfel.push_back(s);
    }
    std::vector<std::uint8_t> occluded(rays.size());
    tracer.occluded(rays, occluded);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (occluded[i] != 0) lit.surfelIrradiance[surfel[i]] = 0.0f;
    }
  });
  const auto reached = std::count_if(lit.surfelIrradiance.begin(), lit.surfelIrradiance.end(),
                                     [](float irradiance) { return irradiance > 0.0f; });
  if (static_cast<float>(reached) < kLeastLit * static_cast<float>(surfels.count())) return std::nullopt;
  return lit;
}

}  // namespace

std::vector<TestLight> chooseTestLights(const RayTracer& tracer, const PlaySpace& space, const Surfels& surfels,
                                        const Hierarchy& hierarchy, std::uint64_t seed, Context& context) {
  std::vector<TestLight> lights;
  if (!hierarchy.skyDirection.empty()) lights.push_back({TestLightKind::sky, {}, {}});
  if (surfels.count() == 0) return lights;
  const auto add = [&](TestLightKind kind, std::uint32_t item, const auto& make) {
    RandomStream random(seed, kStage, item);
    for (std::uint32_t i = 0; i < kLightTries && !context.cancelled(); ++i) {
      if (auto lit = lightSurfels(tracer, surfels, kind, make(random), context)) {
        lights.push_back(std::move(*lit));
        return;
      }
    }
  };
  for (std::uint32_t i = 0; i < kTestSuns; ++i) {
    add(TestLightKind::sun, i, [&](RandomStream& random) {
      const float turn = (static_cast<float>(i) + random.uniform()) / static_cast<float>(kTestSuns);
      return sunAt(kLowestSun + (kHighestSun - kLowestSun) * random.uniform(), 2.0f * std::numbers::pi_v<float> * turn);
    });
  }
  for (std::uint32_t i = 0; i < kTestLamps; ++i) {
    add(TestLightKind::lamp, kTestSuns + i,
        [&](RandomStream& random) { return lampAt(tracer, space, surfels, i % 2 == 1, random); });
  }
  return lights;
}

}  // namespace relume
