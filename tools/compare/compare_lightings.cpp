// SPDX-License-Identifier: MIT
// See compare_lightings.h.
#include "tools/compare/compare_lightings.h"

#include "formats/color.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

namespace relume {
namespace {

constexpr std::size_t kSuns = 8, kPoints = 8, kEmitters = 8;
// How far points of light keep from surfaces, if they can, in widths of a surfel: what is closer lights a spot that no
// surfel resolves, and the cache beside it would decide the whole error.
constexpr float kClearance = 3.0f;
constexpr int kMostCramped = 256;  // places looked at in vain

// Around the compass, low and high in turn.
Lighting sun(std::size_t i) {
  const float azimuth = glm::two_pi<float>() * (static_cast<float>(i) + 0.25f) / kSuns;
  const float elevation = i % 2 == 0 ? 0.5f : 1.1f;
  Light light;
  light.kind = LightKind::directional;
  light.direction =
      -glm::vec3(std::cos(elevation) * std::cos(azimuth), std::sin(elevation), std::cos(elevation) * std::sin(azimuth));
  return {"sun " + std::to_string(i + 1), "suns", {light}, false, {}};
}

// Where lights can hang: grid caches, which stand in free space; else a step off the surface caches.
std::vector<glm::vec3> freePlaces(const Bake& bake) {
  std::vector<glm::vec3> places;
  const Caches& c = bake.caches;
  for (std::uint32_t i = 0; i < c.count(); ++i) {
    if (c.normal[i] == glm::vec3(0.0f)) places.push_back(c.positionWorld[i]);
  }
  if (places.size() >= kPoints) return places;
  const float step = 4.0f * std::sqrt(bake.surfels.areaEach);
  for (std::uint32_t i = 0; i < c.count(); ++i) {
    if (c.normal[i] != glm::vec3(0.0f)) places.push_back(c.positionWorld[i] + step * c.normal[i]);
  }
  return places;
}

bool isClear(const Bake& bake, const glm::vec3& place) {
  const float least = kClearance * kClearance * bake.surfels.areaEach;
  return std::ranges::none_of(bake.surfels.positionWorld, [&](const glm::vec3& p) {
    const glm::vec3 way = p - place;
    return glm::dot(way, way) < least;
  });
}

// Farthest-point sampling: each place is the one farthest from those before it, the first the one nearest to the mean.
// Places near surfaces are taken where there are too few others.
std::vector<glm::vec3> spread(const Bake& bake, const std::vector<glm::vec3>& places, std::size_t count) {
  std::vector<glm::vec3> chosen;
  if (places.empty()) return chosen;
  glm::dvec3 mean(0.0);
  for (const glm::vec3& p : places) mean += glm::dvec3(p) / static_cast<double>(places.size());
  std::vector<float> fromMean, distance(places.size(), std::numeric_limits<float>::infinity());
  for (const glm::vec3& p : places) fromMean.push_back(glm::distance(p, glm::vec3(mean)));
  std::vector<std::uint8_t> out(places.size(), 0);
  const auto chooseFrom = [&](bool all) {
    int cramped = 0;
    while (chosen.size() < std::min(count, places.size()) && cramped < kMostCramped) {
      std::size_t next = places.size();
      for (std::size_t i = 0; i < places.size(); ++i) {
        if (out[i] != 0 || !(distance[i] > 0.0f)) continue;
        const bool better =
            next == places.size() || (chosen.empty() ? fromMean[i] < fromMean[next] : distance[i] > distance[next]);
        if (better) next = i;
      }
      if (next == places.size()) return;
      out[next] = 1;
      if (!all && !isClear(bake, places[next])) {
        ++cramped;
        continue;
      }
      chosen.push_back(places[next]);
      for (std::size_t i = 0; i < places.size(); ++i)
        distance[i] = std::min(distance[i], glm::distance(places[i], chosen.back()));
    }
  };
  chooseFrom(false);
  std::ranges::fill(out, std::uint8_t{0});
  chooseFrom(true);
  return chosen;
}

// Emitting nodes, by the power of either bake's surfels, the strongest first; ties by name.
std::vector<std::string> emittersByPower(const Bake& a, const Bake& b) {
  std::map<std::string, double> power;
  for (const Bake* bake : {&a, &b}) {
    std::map<std::string, double> own;
    for (std::uint32_t i = 0; i < bake->surfels.count(); ++i) {
      const double y = luminance(bake->surfels.emission[i]) * bake->surfels.areaEach;
      if (y > 0.0) own[bake->instances[bake->surfels.instance[i]].node] += y;
    }
    for (const auto& [node, y] : own) power[node] = std::max(power[node], y);
  }
  std::vector<std::string> names;
  for (const auto& [node, y] : power) names.push_back(node);
  std::stable_sort(names.begin(), names.end(), [&](const auto& x, const auto& y) { return power[x] > power[y]; });
  return names;
}

}  // namespace

std::vector<Lighting> makeLightings(const Bake& a, const Bake& b) {
  std::vector<Lighting> list;
  if (!a.hierarchy.skyDirection.empty() || !b.hierarchy.skyDirection.empty())
    list.push_back({"sky", "sky", {}, true, {}});
  for (std::size_t i = 0; i < kSuns; ++i) list.push_back(sun(i));

  const std::vector<glm::vec3> points = spread(a, freePlaces(a), kPoints);
  for (std::size_t i = 0; i < points.size(); ++i) {
    Light light;
    light.positionWorld = points[i];
    list.push_back({"point " + std::to_string(i + 1), "points", {light}, false, {}});
  }

  const std::vector<std::string> emitters = emittersByPower(a, b);
  for (std::size_t i = 0; i < std::min(kEmitters, emitters.size()); ++i)
    list.push_back({"emitter " + emitters[i], "emitters", {}, false, {emitters[i]}});
  if (emitters.size() > kEmitters)
    list.push_back({"other emitters", "emitters", {}, false, {emitters.begin() + kEmitters, emitters.end()}});
  return list;
}

std::vector<glm::vec3> emissionOf(const Bake& bake, const std::vector<std::string>& nodes) {
  const std::set<std::string> on(nodes.begin(), nodes.end());
  std::vector<glm::vec3> emission(bake.surfels.count(), glm::vec3(0.0f));
  for (std::uint32_t i = 0; i < bake.surfels.count(); ++i) {
    if (on.contains(bake.instances[bake.surfels.instance[i]].node)) emission[i] = bake.surfels.emission[i];
  }
  return emission;
}

}  // namespace relume
