// SPDX-License-Identifier: MIT
// See test_lights.h.
#include "bake/certificate/test_lights.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/reference/path_tracer.h"
#include "bake/visibility/find_starts.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <utility>

namespace relume {
namespace {

constexpr std::uint32_t kStage = 0x63657274;  // "cert": the random streams' stage
constexpr std::uint32_t kLightTries = 8;
constexpr float kWellLit = 1.0f / 8.0f, kLeastLit = 1.0f / 64.0f;  // shares of what is seen: enough, and the least
constexpr std::size_t kAsked = 256;                                // receivers that tell the share
constexpr float kLowestSun = 0.35f, kHighestSun = 0.95f;           // sine of its height
constexpr std::uint32_t kPlaces = 8;                               // tried for a lamp
constexpr float kRoom = 0.5f;               // [m] about a lamp, where there is a place that has it
constexpr std::uint32_t kLooks = 64;        // rays that measure the room
constexpr std::size_t kSurfelGrain = 1024;  // surfels

// Each in a sector of the horizon of its own.
SceneLight sunAt(std::uint32_t which, RandomStream& random) {
  const float turn = (static_cast<float>(which) + random.uniform()) / static_cast<float>(kTestSuns);
  const float angle = 2.0f * std::numbers::pi_v<float> * turn;
  const float sine = kLowestSun + (kHighestSun - kLowestSun) * random.uniform();
  const float across = std::sqrt(1.0f - sine * sine);
  SceneLight sun;
  sun.kind = LightKind::directional;
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

// Somewhere in the air, with room about it.
SceneLight lampAt(const RayTracer& tracer, const PlaySpace& space, const Surfels& surfels, RandomStream& random) {
  SceneLight lamp;
  float most = -1.0f;
  for (std::uint32_t i = 0; i < kPlaces && most < kRoom; ++i) {
    const glm::vec3 position = placeInAir(tracer, space, surfels, random);
    const float room = roomAt(tracer, position, random);
    if (room > most) most = room, lamp.positionWorld = position;
  }
  return lamp;
}

// From such a place toward something that is seen.
SceneLight spotAt(const RayTracer& tracer, const PlaySpace& space, const Surfels& surfels,
                  const TestReceivers& receivers, RandomStream& random) {
  SceneLight spot = lampAt(tracer, space, surfels, random);
  spot.kind = LightKind::spot;
  // The receiver of a number, or the next that there is.
  const auto found = std::ranges::lower_bound(receivers.number, random.below(receivers.number.back() + 1));
  const glm::vec3& target = receivers.positionWorld[static_cast<std::size_t>(found - receivers.number.begin())];
  const float distance = glm::distance(target, spot.positionWorld);
  if (distance > 0.0f) spot.direction = (target - spot.positionWorld) / distance;
  spot.innerConeRad = 0.5f * spot.outerConeRad;
  return spot;
}

// Share of the receivers that a light reaches straight, by some of them.
float litShare(const RayTracer& tracer, const TestReceivers& receivers, const SceneLight& light) {
  const std::uint32_t step =
      std::bit_floor(static_cast<std::uint32_t>(std::max<std::size_t>(1, receivers.count() / kAsked)));
  std::vector<glm::vec3> position, normal;
  for (std::size_t i = 0; i < receivers.count(); ++i) {
    if (receivers.number[i] % step != 0) continue;
    position.push_back(receivers.positionWorld[i]);
    normal.push_back(receivers.geometricNormal[i]);
  }
  std::vector<glm::vec3> irradiance(position.size());
  directIrradiance(tracer, {&light, 1}, position, normal, irradiance);
  if (position.empty()) return 0.0f;
  const auto lit = std::ranges::count_if(irradiance, [](const glm::vec3& e) { return e.x > 0.0f; });
  return static_cast<float>(lit) / static_cast<float>(irradiance.size());
}

// The first of some that shines on enough of what is seen, or the one that shines on most; nothing where that is next
// to nothing.
template <class Make>
std::optional<SceneLight> choose(const RayTracer& tracer, const TestReceivers& receivers, RandomStream random,
                                 const Make& make) {
  SceneLight best;
  float most = 0.0f;
  for (std::uint32_t i = 0; i < kLightTries && most < kWellLit; ++i) {
    const SceneLight light = make(random);
    const float share = litShare(tracer, receivers, light);
    if (share > most) most = share, best = light;
  }
  return most >= kLeastLit ? std::optional(best) : std::nullopt;
}

// What reaches the surfels.
TestLight lightSurfels(const RayTracer& tracer, const Surfels& surfels, TestLightKind kind, const SceneLight& light,
                       Context& context) {
  TestLight lit{kind, light, std::vector<float>(surfels.count())};
  parallelChunks(context, "", surfels.count(), kSurfelGrain, [&](std::size_t begin, std::size_t end) {
    std::vector<glm::vec3> irradiance(end - begin);
    directIrradiance(tracer, {&light, 1}, surfels.positionWorld.span().subspan(begin, end - begin),
                     surfels.normal.span().subspan(begin, end - begin), irradiance);
    for (std::size_t s = begin; s < end; ++s) lit.surfelIrradiance[s] = irradiance[s - begin].x;
  });
  return lit;
}

}  // namespace

std::vector<TestLight> chooseTestLights(const RayTracer& tracer, const PlaySpace& space, const Surfels& surfels,
                                        const Hierarchy& hierarchy, const TestReceivers& receivers, std::uint64_t seed,
                                        Context& context) {
  std::vector<TestLight> lights;
  if (!hierarchy.skyDirection.empty()) lights.push_back({TestLightKind::sky, {}, {}});
  if (surfels.count() == 0 || receivers.count() == 0) return lights;
  // All are chosen at the same time, as that is done by few rays each; then each lights all surfels.
  std::array<std::optional<SceneLight>, kTestSuns + kTestLamps> chosen;
  parallelChunks(context, "", chosen.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      chosen[i] = choose(tracer, receivers, RandomStream(seed, kStage, i), [&](RandomStream& random) {
        if (i < kTestSuns) return sunAt(static_cast<std::uint32_t>(i), random);
        return (i - kTestSuns) % 2 == 0 ? lampAt(tracer, space, surfels, random)
                                        : spotAt(tracer, space, surfels, receivers, random);
      });
    }
  });
  for (std::size_t i = 0; i < chosen.size() && !context.cancelled(); ++i) {
    const TestLightKind kind = i < kTestSuns ? TestLightKind::sun : TestLightKind::lamp;
    if (chosen[i]) lights.push_back(lightSurfels(tracer, surfels, kind, *chosen[i], context));
  }
  return lights;
}

}  // namespace relume
