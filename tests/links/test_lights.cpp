// SPDX-License-Identifier: MIT
// See test_lights.h.
#include "tests/links/test_lights.h"

#include "bake/base/random.h"

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

namespace relume::test {
namespace {

constexpr std::uint64_t kSeed = 20161120;  // of the lights; no bake uses it
constexpr float kClearance = 0.008f;       // lights keep this share of the level's diagonal from surfaces
constexpr float kNearGround = 0.05f;       // a torch is at most that share of the diagonal above what is below it
constexpr float kFar = std::numeric_limits<float>::infinity();

float diagonalOf(const RayTracer& tracer) { return glm::length(tracer.boundsMax() - tracer.boundsMin()); }

glm::vec3 sphereDirection(float u, float turns) {
  const float z = 1.0f - 2.0f * u, r = std::sqrt(std::max(0.0f, 1.0f - z * z));
  const float phi = 2.0f * std::numbers::pi_v<float> * turns;
  return {r * std::cos(phi), z, r * std::sin(phi)};
}

bool isOpen(const RayTracer& tracer, const glm::vec3& place) {
  constexpr int kWays = 32;
  const float clearance = kClearance * diagonalOf(tracer);
  for (int i = 0; i < kWays; ++i) {
    const glm::vec3 way = sphereDirection((static_cast<float>(i) + 0.5f) / kWays, 0.618034f * static_cast<float>(i));
    if (tracer.occluded(Ray{place, 0.0f, way, clearance})) return false;
  }
  return true;
}

// Up to `count` random open places; nearGround: with something not far below.
std::vector<glm::vec3> openPlaces(const RayTracer& tracer, const PlaySpace& space, std::size_t count, bool nearGround) {
  std::vector<glm::vec3> places;
  RandomStream random(kSeed, nearGround ? 2 : 1, 0);
  for (std::size_t tries = 0; tries < 100 * count && places.size() < count; ++tries) {
    const glm::vec3 place = space.receivers[random.below(static_cast<std::uint32_t>(space.receivers.size()))];
    const bool high = nearGround && !tracer.occluded(Ray{place, 0.0f, {0, -1, 0}, kNearGround * diagonalOf(tracer)});
    if (!high && isOpen(tracer, place)) places.push_back(place);
  }
  return places;
}

// Places and the open ways between them.
struct Ways {
  std::vector<glm::vec3> place;
  std::vector<std::vector<std::uint32_t>> neighbours;
};

bool isOpenBetween(const RayTracer& tracer, const glm::vec3& a, const glm::vec3& b) {
  const float distance = glm::length(b - a);
  if (tracer.occluded(Ray{a, 0.0f, (b - a) / distance, distance})) return false;
  const int steps = static_cast<int>(std::ceil(distance / (kClearance * diagonalOf(tracer))));
  for (int i = 1; i < steps; ++i) {
    if (!isOpen(tracer, a + static_cast<float>(i) / static_cast<float>(steps) * (b - a))) return false;
  }
  return true;
}

Ways connect(const RayTracer& tracer, std::vector<glm::vec3> places, float reach) {
  Ways ways{std::move(places), {}};
  ways.neighbours.resize(ways.place.size());
  for (std::uint32_t a = 0; a < ways.place.size(); ++a) {
    for (std::uint32_t b = 0; b < a; ++b) {
      const float distance = glm::length(ways.place[b] - ways.place[a]);
      if (!(distance > 0.0f) || distance > reach || !isOpenBetween(tracer, ways.place[a], ways.place[b])) continue;
      ways.neighbours[a].push_back(b);
      ways.neighbours[b].push_back(a);
    }
  }
  return ways;
}

// Shortest way from `start` to the reachable place that is farthest, last place first (Dijkstra 1959).
std::vector<std::uint32_t> farthestWay(const Ways& ways, std::uint32_t start) {
  const std::size_t n = ways.place.size();
  std::vector<float> distance(n, kFar);
  std::vector<std::uint32_t> from(n, kNone);
  std::vector<std::uint8_t> done(n, 0);
  distance[start] = 0.0f;
  std::uint32_t last = start;
  for (;;) {
    std::uint32_t next = kNone;
    for (std::uint32_t i = 0; i < n; ++i) {
      if (!done[i] && distance[i] < kFar && (next == kNone || distance[i] < distance[next])) next = i;
    }
    if (next == kNone) break;
    done[next] = 1;
    last = next;
    for (const std::uint32_t i : ways.neighbours[next]) {
      const float through = distance[next] + glm::length(ways.place[i] - ways.place[next]);
      if (through < distance[i]) distance[i] = through, from[i] = next;
    }
  }
  std::vector<std::uint32_t> way;
  for (std::uint32_t i = last; i != kNone; i = from[i]) way.push_back(i);
  return way;
}

SceneLight pointLight(const std::string& name, const glm::vec3& place) {
  SceneLight light;
  light.name = name;
  light.positionWorld = place;
  return light;
}

}  // namespace

float directIrradiance(const RayTracer& tracer, const SceneLight& light, const glm::vec3& positionWorld,
                       const glm::vec3& normal) {
  const glm::vec3 from = positionWorld + normal * std::max(1e-3f, 4.0f * tracer.epsilonAt(positionWorld));
  glm::vec3 toLight = -light.direction;
  float distance = kFar;
  double irradiance = (light.intensity.x + light.intensity.y + light.intensity.z) / 3.0;
  if (light.kind != LightKind::directional) {
    distance = glm::length(light.positionWorld - from);
    toLight = (light.positionWorld - from) / distance;
    irradiance /= double{distance} * distance;
  }
  if (light.kind == LightKind::spot) {
    const double inner = std::cos(light.innerConeRad), outer = std::cos(light.outerConeRad);
    const double t =
        std::clamp((-glm::dot(toLight, light.direction) - outer) / std::max(inner - outer, 1e-4), 0.0, 1.0);
    irradiance *= t * t;
  }
  irradiance *= std::max(0.0f, glm::dot(toLight, normal));
  if (irradiance <= 0.0 || tracer.occluded(Ray{from, 0.0f, toLight, distance * 0.999f})) return 0.0f;
  return static_cast<float>(irradiance);
}

std::vector<SceneLight> makeSuns(std::uint32_t count) {
  std::vector<SceneLight> suns(count);
  for (std::uint32_t i = 0; i < count; ++i) {
    // The Fibonacci lattice over the cap of heights 1/2 to 1.
    const float height = 1.0f - 0.5f * (static_cast<float>(i) + 0.5f) / static_cast<float>(count);
    suns[i].kind = LightKind::directional;
    suns[i].name = "sun " + std::to_string(i);
    suns[i].direction = -sphereDirection(0.5f - 0.5f * height, 0.618034f * static_cast<float>(i));
  }
  return suns;
}

std::vector<SceneLight> makeSpots(const RayTracer& tracer, const PlaySpace& space, std::uint32_t count) {
  std::vector<SceneLight> spots;
  RandomStream random(kSeed, 3, 0);
  for (const glm::vec3& place : openPlaces(tracer, space, count, false)) {
    SceneLight spot = pointLight("spot " + std::to_string(spots.size()), place);
    const glm::vec2 u = random.uniform2();
    spot.kind = LightKind::spot;
    spot.direction = sphereDirection(u.x, u.y);
    spot.outerConeRad = (15.0f + 25.0f * random.uniform()) * std::numbers::pi_v<float> / 180.0f;
    spot.innerConeRad = 0.8f * spot.outerConeRad;
    spots.push_back(spot);
  }
  return spots;
}

std::vector<SceneLight> makeTorchPath(const RayTracer& tracer, const PlaySpace& space, std::uint32_t count) {
  const Ways ways = connect(tracer, openPlaces(tracer, space, 400, true), 0.15f * diagonalOf(tracer));
  if (ways.place.empty()) return {};
  // The ends of a longest way: the farthest place from the farthest place.
  std::vector<std::uint32_t> way = farthestWay(ways, 0);
  way = farthestWay(ways, way.front());
  std::vector<float> along{0.0f};
  for (std::size_t i = 1; i < way.size(); ++i) {
    along.push_back(along.back() + glm::length(ways.place[way[i]] - ways.place[way[i - 1]]));
  }

  std::vector<SceneLight> torches;
  for (std::uint32_t k = 0; k < count; ++k) {
    const float at = along.back() * static_cast<float>(k) / static_cast<float>(std::max(1u, count - 1));
    std::size_t i = 1;
    while (i + 1 < way.size() && along[i] < at) ++i;
    const glm::vec3 &a = ways.place[way[i - 1]], &b = ways.place[way[std::min(i, way.size() - 1)]];
    const float length = i < way.size() ? along[i] - along[i - 1] : 0.0f;
    const float t = length > 0.0f ? std::clamp((at - along[i - 1]) / length, 0.0f, 1.0f) : 0.0f;
    torches.push_back(pointLight("torch " + std::to_string(k), a + t * (b - a)));
  }
  return torches;
}

}  // namespace relume::test
