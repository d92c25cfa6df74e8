// SPDX-License-Identifier: MIT
// See emitter_sampler.h.
#include "bake/links/emitter_sampler.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace relume {
namespace {

constexpr std::size_t kMaxBatches = 512;  // every cache looks at all of them

// Mean emission of what a tile of the surfel map holds: a surfel, or finer tiles.
double meanEmission(const Surfels& surfels, const std::vector<std::uint32_t>& tile, std::uint32_t content) {
  if (content == kNone) return 0.0;
  if (!SurfelMap::isInner(content)) {
    const glm::vec3& e = surfels.emission[content];
    return double{e.x + e.y + e.z} / 3.0;
  }
  constexpr std::uint32_t kTiles = SurfelMap::kInnerAlong * SurfelMap::kInnerAlong;
  double sum = 0.0;
  for (std::uint32_t i = 0; i < kTiles; ++i)
    sum += meanEmission(surfels, tile, tile[SurfelMap::firstInner(content) + i]);
  return sum / kTiles;
}

// Mean emission of a side over all its tiles; those without a surfel count as dark. 0 for a side that does not emit.
float meanEmission(const Surfels& surfels, const SurfelMap& map, std::uint32_t side) {
  const std::uint32_t begin = map.sides[side].firstTile, end = begin + map.sides[side].tileCount();
  double sum = 0.0;
  for (std::uint32_t i = begin; i < end; ++i) {
    if (map.tile[i] == kNone) continue;
    const double e = meanEmission(surfels, map.tile, map.tile[i]);
    if (!(e > 0.0) && !SurfelMap::isInner(map.tile[i])) return 0.0f;  // an emitting side has emitters only
    sum += e;
  }
  return end > begin ? static_cast<float>(sum / static_cast<double>(end - begin)) : 0.0f;
}

}  // namespace

EmitterSampler::EmitterSampler(const Scene& scene, const Surfels& surfels, const SurfelMap& map) {
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
  makeBatches();
}

void EmitterSampler::makeBatches() {
  const std::size_t each = (side_.size() + kMaxBatches - 1) / kMaxBatches;
  for (std::size_t begin = 0; begin < side_.size(); begin += each) {
    const std::size_t end = std::min(side_.size(), begin + each);
    Batch batch{static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end), glm::vec3(0.0f), 0.0f, 0.0f};
    glm::vec3 low(std::numeric_limits<float>::infinity()), high(-low);
    for (std::size_t i = begin; i < end; ++i) {
      Side& side = side_[i];
      for (const glm::vec3& p : {side.corner, side.corner + side.edge1, side.corner + side.edge2}) {
        low = glm::min(low, p);
        high = glm::max(high, p);
      }
      batch.power += side.powerUpTo;
      side.powerUpTo = batch.power;
      side.batch = static_cast<std::uint32_t>(batch_.size());
    }
    batch.center = 0.5f * (low + high);
    batch.radius = 0.5f * glm::length(high - low);
    batch_.push_back(batch);
  }
}

void EmitterSampler::prepare(const glm::vec3& positionWorld, const glm::vec3& normal, Distribution& emitters) const {
  emitters.cdf.clear();
  double sum = 0.0;
  const bool onSurface = glm::dot(normal, normal) > 0.0f;
  for (const Batch& batch : batch_) {
    const glm::vec3 to = batch.center - positionWorld;
    const float distance = glm::length(to), reach = distance + batch.radius;
    // Nothing arrives from below the horizon, or from the back of a side.
    float facing = onSurface ? std::min((glm::dot(normal, to) + batch.radius) / reach, 1.0f) : 1.0f;
    if (batch.end - batch.begin == 1) facing *= -glm::dot(side_[batch.begin].normal, to) / reach;
    if (facing > 0.0f) {
      sum += double{batch.power} * double{facing} /
             (double{distance} * double{distance} + double{batch.radius} * double{batch.radius});
    }
    emitters.cdf.push_back(static_cast<float>(sum));
  }
  if (!(sum > 0.0) || !std::isfinite(sum)) {
    emitters.cdf.clear();
    return;
  }
  for (float& c : emitters.cdf) c = static_cast<float>(double{c} / sum);
  emitters.cdf.back() = 1.0f;
}

glm::vec3 EmitterSampler::point(const Distribution& emitters, float u, RandomStream& random) const {
  const auto chosen =
      std::min<std::ptrdiff_t>(std::upper_bound(emitters.cdf.begin(), emitters.cdf.end(), u) - emitters.cdf.begin(),
                               static_cast<std::ptrdiff_t>(batch_.size()) - 1);
  const Batch& batch = batch_[static_cast<std::size_t>(chosen)];
  const float power = random.uniform() * batch.power;
  const auto found = std::partition_point(side_.begin() + batch.begin, side_.begin() + batch.end - 1,
                                          [&](const Side& s) { return s.powerUpTo <= power; });
  // Choose the point evenly over the triangle.
  const glm::vec2 r = random.uniform2();
  const float root = std::sqrt(r.x);
  return found->corner + (1.0f - root) * found->edge1 + (r.y * root) * found->edge2;
}

float EmitterSampler::pdfOf(const Distribution& emitters, std::uint32_t index) const {
  const Side& side = side_[index];
  const float chance = emitters.cdf[side.batch] - (side.batch > 0 ? emitters.cdf[side.batch - 1] : 0.0f);
  return chance * side.radiance / batch_[side.batch].power;
}

float EmitterSampler::cosine(std::uint32_t side, const glm::vec3& direction) const {
  return std::abs(glm::dot(side_[indexOf_[side]].normal, direction));
}

}  // namespace relume
