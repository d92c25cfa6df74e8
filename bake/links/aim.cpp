// SPDX-License-Identifier: MIT
// See aim.h.
#include "bake/links/aim.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace relume {
namespace {

constexpr std::size_t kMostBundles = 512;  // each is looked at for each cache

// Mean emission of what a cell of the map holds: a surfel, or cells.
double meanEmission(const Surfels& surfels, const std::vector<std::uint32_t>& cell, std::uint32_t content) {
  if (content == kNone) return 0.0;
  if (!SurfelMap::isInner(content)) {
    const glm::vec3& e = surfels.emission[content];
    return double{e.x + e.y + e.z} / 3.0;
  }
  constexpr std::uint32_t kCells = SurfelMap::kInnerAlong * SurfelMap::kInnerAlong;
  double sum = 0.0;
  for (std::uint32_t i = 0; i < kCells; ++i)
    sum += meanEmission(surfels, cell, cell[SurfelMap::firstInner(content) + i]);
  return sum / kCells;
}

// Mean emission of a side, over the cells of the map that have a surfel and those that have none.
float meanEmission(const Surfels& surfels, const SurfelMap& map, std::uint32_t side) {
  const std::uint32_t begin = map.sides[side].firstCell, end = begin + map.sides[side].cellCount();
  double sum = 0.0;
  for (std::uint32_t i = begin; i < end; ++i) {
    if (map.cell[i] == kNone) continue;
    const double e = meanEmission(surfels, map.cell, map.cell[i]);
    if (!(e > 0.0) && !SurfelMap::isInner(map.cell[i])) return 0.0f;  // an emitting side has emitters only
    sum += e;
  }
  return end > begin ? static_cast<float>(sum / static_cast<double>(end - begin)) : 0.0f;
}

}  // namespace

EmitterAim::EmitterAim(const Scene& scene, const Surfels& surfels, const SurfelMap& map) {
  const auto emits = [](const glm::vec3& e) { return e.x + e.y + e.z > 0.0f; };
  if (std::none_of(surfels.emission.begin(), surfels.emission.end(), emits)) return;
  indexOf_.assign(map.sides.size(), kNone);
  for (const Instance& instance : scene.instances) {
    const auto triangles = static_cast<std::uint32_t>(scene.meshes[instance.mesh].triangle.size());
    for (std::uint32_t t = 0; t < 2 * triangles; ++t) {
      const std::uint32_t id = 2 * instance.firstTriangle + t;
      const float radiance = meanEmission(surfels, map, id);
      if (!(radiance > 0.0f)) continue;
      const std::array<glm::vec3, 3> corner = scene.corners(instance, t / 2);
      Side side{corner[0], corner[1] - corner[0], corner[2] - corner[0], {}, radiance, 0.0f, 0};
      const glm::vec3 cross = glm::cross(side.edge1, side.edge2);
      const float twiceArea = glm::length(cross);
      if (!(twiceArea > 0.0f) || !std::isfinite(twiceArea)) continue;
      side.normal = cross * ((t % 2 ? -1.0f : 1.0f) / twiceArea);
      side.powerUpTo = radiance * 0.5f * twiceArea;
      if (!(side.powerUpTo > 0.0f) || !std::isfinite(side.powerUpTo)) continue;
      indexOf_[id] = static_cast<std::uint32_t>(side_.size());
      side_.push_back(side);
    }
  }
  bundleUp();
}

void EmitterAim::bundleUp() {
  const std::size_t each = (side_.size() + kMostBundles - 1) / kMostBundles;
  for (std::size_t begin = 0; begin < side_.size(); begin += each) {
    const std::size_t end = std::min(side_.size(), begin + each);
    Bundle bundle{static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end), glm::vec3(0.0f), 0.0f, 0.0f};
    glm::vec3 low(std::numeric_limits<float>::infinity()), high(-low);
    for (std::size_t i = begin; i < end; ++i) {
      Side& side = side_[i];
      for (const glm::vec3& p : {side.corner, side.corner + side.edge1, side.corner + side.edge2}) {
        low = glm::min(low, p);
        high = glm::max(high, p);
      }
      bundle.power += side.powerUpTo;
      side.powerUpTo = bundle.power;
      side.bundle = static_cast<std::uint32_t>(bundle_.size());
    }
    bundle.center = 0.5f * (low + high);
    bundle.radius = 0.5f * glm::length(high - low);
    bundle_.push_back(bundle);
  }
}

void EmitterAim::prepare(const glm::vec3& positionWorld, const glm::vec3& normal, Chances& chances) const {
  chances.upTo.clear();
  double sum = 0.0;
  const bool onSurface = glm::dot(normal, normal) > 0.0f;
  for (const Bundle& bundle : bundle_) {
    const glm::vec3 to = bundle.center - positionWorld;
    const float distance = glm::length(to), reach = distance + bundle.radius;
    // Nothing arrives from below the horizon, or from the back of a side.
    float facing = onSurface ? std::min((glm::dot(normal, to) + bundle.radius) / reach, 1.0f) : 1.0f;
    if (bundle.end - bundle.begin == 1) facing *= -glm::dot(side_[bundle.begin].normal, to) / reach;
    if (facing > 0.0f) {
      sum += double{bundle.power} * double{facing} /
             (double{distance} * double{distance} + double{bundle.radius} * double{bundle.radius});
    }
    chances.upTo.push_back(static_cast<float>(sum));
  }
  if (!(sum > 0.0) || !std::isfinite(sum)) {
    chances.upTo.clear();
    return;
  }
  for (float& c : chances.upTo) c = static_cast<float>(double{c} / sum);
  chances.upTo.back() = 1.0f;
}

glm::vec3 EmitterAim::point(const Chances& chances, float u, RandomStream& random) const {
  const auto chosen =
      std::min<std::ptrdiff_t>(std::upper_bound(chances.upTo.begin(), chances.upTo.end(), u) - chances.upTo.begin(),
                               static_cast<std::ptrdiff_t>(bundle_.size()) - 1);
  const Bundle& bundle = bundle_[static_cast<std::size_t>(chosen)];
  const float power = random.uniform() * bundle.power;
  const auto found = std::partition_point(side_.begin() + bundle.begin, side_.begin() + bundle.end - 1,
                                          [&](const Side& s) { return s.powerUpTo <= power; });
  // Even over the triangle.
  const glm::vec2 r = random.uniform2();
  const float root = std::sqrt(r.x);
  return found->corner + (1.0f - root) * found->edge1 + (r.y * root) * found->edge2;
}

float EmitterAim::densityOf(const Chances& chances, std::uint32_t index) const {
  const Side& side = side_[index];
  const float chance = chances.upTo[side.bundle] - (side.bundle > 0 ? chances.upTo[side.bundle - 1] : 0.0f);
  return chance * side.radiance / bundle_[side.bundle].power;
}

float EmitterAim::cosine(std::uint32_t side, const glm::vec3& direction) const {
  return std::abs(glm::dot(side_[indexOf_[side]].normal, direction));
}

}  // namespace relume
