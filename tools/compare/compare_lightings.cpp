// SPDX-License-Identifier: MIT
// See compare_lightings.h.
#include "tools/compare/compare_lightings.h"

#include "formats/color.h"
#include "tools/compare/compare_scene.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

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
  return {"sun " + std::to_string(i + 1), "suns", {light}, false, {}, {}, ""};
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

// A node that emits, from the surfels of it that do.
struct Emitter {
  std::string node;
  double power = 0.0;      // luminance of emission, times area
  double area = 0.0;       // [m²]
  glm::dvec3 centre{0.0};  // [m] mean place, weighted by power
  double extent = 0.0;     // [m] rms distance from it
};

std::vector<Emitter> emittersOf(const Bake& bake) {
  const Surfels& s = bake.surfels;
  std::map<std::string, Emitter> byNode;
  const auto eachEmitting = [&](const auto& visit) {
    for (std::uint32_t i = 0; i < s.count(); ++i) {
      const double power = luminance(s.emission[i]) * s.areaEach;
      if (power > 0.0) visit(byNode[bake.instances[s.instance[i]].node], glm::dvec3(s.positionWorld[i]), power);
    }
  };
  eachEmitting([&](Emitter& e, const glm::dvec3& p, double power) {
    e.power += power;
    e.area += s.areaEach;
    e.centre += power * p;
  });
  for (auto& [node, e] : byNode) {
    e.node = node;
    e.centre /= e.power;
  }
  eachEmitting([](Emitter& e, const glm::dvec3& p, double power) {
    e.extent += power / e.power * glm::dot(p - e.centre, p - e.centre);
  });
  std::vector<Emitter> list;
  for (auto& [node, e] : byNode) {
    e.extent = std::sqrt(e.extent);
    list.push_back(std::move(e));
  }
  return list;
}

// How little two emitters look like one: the distance of their centres, in halves of their extent and a surfel's width,
// and the ratios of area and power, in factors of two. Nothing when one of the three is above 1, which surfels placed
// by another seed are not.
double reachOf(double extent, double surfelWidth) { return 0.5 * extent + surfelWidth; }
std::optional<double> unlikeness(const Emitter& a, const Emitter& b, double surfelWidth) {
  const double distance = glm::distance(a.centre, b.centre) / reachOf(std::max(a.extent, b.extent), surfelWidth);
  const double area = std::abs(std::log2(a.area / b.area)), power = std::abs(std::log2(a.power / b.power));
  return distance <= 1.0 && area <= 1.0 && power <= 1.0 ? std::optional(distance + area + power) : std::nullopt;
}

// An emitter of either bake, or of both.
struct EmitterPair {
  const Emitter *a = nullptr, *b = nullptr;

  const std::string& name() const { return b != nullptr ? b->node : a->node; }
  double power() const { return std::max(a != nullptr ? a->power : 0.0, b != nullptr ? b->power : 0.0); }
};

// Pairs of emitters, each of which is in one pair.
class EmitterMatch {
 public:
  EmitterMatch(const std::vector<Emitter>& a, const std::vector<Emitter>& b, double surfelWidth)
      : a_(a), b_(b), takenA_(a.size(), false), takenB_(b.size(), false) {
    // Of numbered nodes the place decides first.
    takeByName(false);
    takeByPlace(surfelWidth);
    takeByName(true);
    for (std::size_t i = 0; i < a_.size(); ++i) {
      if (!takenA_[i]) pairs_.push_back({&a_[i], nullptr});
    }
    for (std::size_t i = 0; i < b_.size(); ++i) {
      if (!takenB_[i]) pairs_.push_back({nullptr, &b_[i]});
    }
  }

  const std::vector<EmitterPair>& pairs() const { return pairs_; }

 private:
  void take(std::size_t i, std::size_t k) {
    if (takenA_[i] || takenB_[k]) return;
    takenA_[i] = takenB_[k] = true;
    pairs_.push_back({&a_[i], &b_[k]});
  }

  void takeByName(bool numbered) {
    std::map<std::string, std::size_t> ofB;
    for (std::size_t k = 0; k < b_.size(); ++k) ofB.emplace(b_[k].node, k);
    for (std::size_t i = 0; i < a_.size(); ++i) {
      const auto found = ofB.find(a_[i].node);
      if (found != ofB.end() && isNumbered(a_[i].node) == numbered) take(i, found->second);
    }
  }

  void takeByPlace(double surfelWidth) {
    // Left over of B, from one side of the level to the other, so that only those near by are looked at.
    std::vector<std::size_t> left;
    double extent = 0.0;
    for (std::size_t k = 0; k < b_.size(); ++k) {
      if (takenB_[k]) continue;
      left.push_back(k);
      extent = std::max(extent, b_[k].extent);
    }
    const auto alongX = [this](std::size_t k) { return b_[k].centre.x; };
    std::ranges::sort(left, {}, alongX);
    std::vector<std::tuple<double, std::size_t, std::size_t>> likely;
    for (std::size_t i = 0; i < a_.size(); ++i) {
      if (takenA_[i]) continue;
      const double reach = reachOf(std::max(a_[i].extent, extent), surfelWidth), x = a_[i].centre.x;
      for (auto k = std::ranges::lower_bound(left, x - reach, {}, alongX); k != left.end() && alongX(*k) <= x + reach;
           ++k) {
        if (const auto apart = unlikeness(a_[i], b_[*k], surfelWidth)) likely.emplace_back(*apart, i, *k);
      }
    }
    std::ranges::sort(likely);
    for (const auto& [apart, i, k] : likely) take(i, k);
  }

  const std::vector<Emitter>&a_, &b_;
  std::vector<bool> takenA_, takenB_;
  std::vector<EmitterPair> pairs_;
};

// Add the emitters to what a lighting switches on.
void switchOn(const EmitterPair& pair, Lighting& lighting) {
  if (pair.a != nullptr) lighting.emittersA.push_back(pair.a->node);
  if (pair.b != nullptr) lighting.emittersB.push_back(pair.b->node);
}

// The strongest emitting nodes alone, ties by name, and the others together.
void addEmitters(const Bake& a, const Bake& b, std::vector<Lighting>& list) {
  const std::vector<Emitter> ofA = emittersOf(a), ofB = emittersOf(b);
  const double surfelWidth = 2.0 * std::sqrt(std::max(a.surfels.areaEach, b.surfels.areaEach) / glm::pi<double>());
  std::vector<EmitterPair> pairs = EmitterMatch(ofA, ofB, surfelWidth).pairs();
  std::ranges::sort(pairs, [](const EmitterPair& x, const EmitterPair& y) {
    return x.power() != y.power() ? x.power() > y.power() : x.name() < y.name();
  });
  Lighting others{"other emitters", "emitters", {}, false, {}, {}, ""};
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const EmitterPair& pair = pairs[i];
    if (i >= kEmitters) {
      switchOn(pair, others);
      continue;
    }
    Lighting alone{"emitter " + pair.name(), "emitters", {}, false, {}, {}, ""};
    if (pair.a != nullptr && pair.a->node != pair.name()) alone.was = pair.a->node;
    switchOn(pair, alone);
    list.push_back(std::move(alone));
  }
  if (pairs.size() > kEmitters) list.push_back(std::move(others));
}

}  // namespace

std::vector<Lighting> makeLightings(const Bake& a, const Bake& b) {
  std::vector<Lighting> list;
  if (!a.hierarchy.skyDirection.empty() || !b.hierarchy.skyDirection.empty())
    list.push_back({"sky", "sky", {}, true, {}, {}, ""});
  for (std::size_t i = 0; i < kSuns; ++i) list.push_back(sun(i));

  const std::vector<glm::vec3> points = spread(a, freePlaces(a), kPoints);
  for (std::size_t i = 0; i < points.size(); ++i) {
    Light light;
    light.positionWorld = points[i];
    list.push_back({"point " + std::to_string(i + 1), "points", {light}, false, {}, {}, ""});
  }

  addEmitters(a, b, list);
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
