// SPDX-License-Identifier: MIT
// See gather.h.
#include "bake/links/gather.h"

#include "bake/base/place_number.h"
#include "formats/octahedron.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

namespace relume {
namespace {

constexpr std::uint32_t kStage = 0x4C4E4B53, kAimStage = 0x4C4E4B41;  // random numbers of this stage
constexpr float kSamePoint = 1e-3f;    // relative; an aimed ray that ends this near to its point has met it
constexpr std::uint32_t kBatch = 256;  // hits looked up together: their data stay in the first-level cache

void prefetch([[maybe_unused]] const void* address) {
#if defined(__GNUC__)
  __builtin_prefetch(address);
#endif
}

// Limit the sum of a cache's weights. Both kinds of rays find emitters, and where few rays are cast, their weights may
// add up to more than 4, which stands for light from all around (4 pi sr). No reader accepts that, so a sum that
// exceeds 4 by more than the noise of many rays is scaled back.
void keepToSphere(std::span<Arrival> arrivals) {
  constexpr double kSphere = 4.0, kNoise = 1.04;
  double sum = 0.0;
  for (const Arrival& arrival : arrivals) sum += static_cast<double>(arrival.weight);
  if (!(sum > kSphere * kNoise)) return;
  for (Arrival& arrival : arrivals) arrival.weight *= static_cast<float>(kSphere / sum);
}

}  // namespace

RayCount& RayCount::operator+=(const RayCount& other) {
  rays += other.rays;
  backFaces += other.backFaces;
  misses += other.misses;
  unmapped += other.unmapped;
  aimed += other.aimed;
  return *this;
}

SkyLookup::SkyLookup(std::span<const glm::vec3> directions) {
  if (directions.empty()) return;
  side_ = std::clamp(8u * static_cast<std::uint32_t>(std::ceil(std::sqrt(static_cast<double>(directions.size())))), 32u,
                     256u);
  patch_.resize(std::size_t{side_} * side_);
  for (std::uint32_t i = 0; i < patch_.size(); ++i) {
    const glm::vec2 entry(static_cast<float>(i % side_) + 0.5f, static_cast<float>(i / side_) + 0.5f);
    const glm::vec3 d = fromOctahedron(entry * (2.0f / static_cast<float>(side_)) - 1.0f);
    float best = -2.0f;
    for (std::size_t k = 0; k < directions.size(); ++k) {
      const float cosine = glm::dot(d, directions[k]);
      if (cosine > best) best = cosine, patch_[i] = static_cast<std::uint16_t>(k);
    }
  }
}

std::uint32_t SkyLookup::nearest(const glm::vec3& direction) const {
  const glm::vec2 p = (toOctahedron(direction) * 0.5f + 0.5f) * static_cast<float>(side_);
  const std::uint32_t x = std::min(static_cast<std::uint32_t>(p.x), side_ - 1);
  const std::uint32_t y = std::min(static_cast<std::uint32_t>(p.y), side_ - 1);
  return patch_[std::size_t{y} * side_ + x];
}

Gatherer::Gatherer(const RayTracer& tracer, const Surfels& surfels, const SurfelMap& map, const Hierarchy& hierarchy,
                   std::uint32_t raysPerCache, float emitterRays, std::uint64_t seed)
    : tracer_(tracer),
      map_(map),
      hierarchy_(hierarchy),
      surfelCount_(surfels.count()),
      seed_(seed),
      strata_(raysPerCache),
      sampler_(tracer.scene(), surfels, map),
      aimedCount_(sampler_.empty() ? 0 : static_cast<std::uint32_t>(emitterRays * static_cast<float>(strata_.count()))),
      sky_(hierarchy.skyDirection) {
  leafOfTile_.reserve(map.tile.size());
  for (const std::uint32_t surfel : map.tile) {
    leafOfTile_.push_back(surfel == kNone || SurfelMap::isInner(surfel) ? kNone : hierarchy.leafNode[surfel]);
  }
}

// The arrays of sides and of leaves are larger than the second-level cache: prefetch all entries before the first is
// read.
void Gatherer::lookUp(std::span<const Hit> hits, Scratch& scratch) const {
  const std::size_t count = hits.size();
  scratch.sides.resize(count);
  scratch.tiles.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Hit& hit = hits[i];
    if (!hit) continue;
    const std::uint32_t triangle = tracer_.scene().instances[hit.instance].firstTriangle + hit.triangle;
    scratch.sides[i] = 2 * triangle + (hit.back ? 1u : 0u);
    prefetch(map_.sides.address(scratch.sides[i]));
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Hit& hit = hits[i];
    scratch.tiles[i] = hit ? map_.tileOf(scratch.sides[i], hit.barycentric) : kNone;
    if (scratch.tiles[i] != kNone) prefetch(&leafOfTile_[scratch.tiles[i]]);
  }
}

std::uint32_t Gatherer::leafOf(std::uint32_t side, std::uint32_t tile) const {
  if (tile != kNone) return leafOfTile_[tile];
  const std::uint32_t surfel = map_.onDemandAt(side);
  return surfel == kNone ? kNone : hierarchy_.leafNode[surfel];
}

float Gatherer::misWeight(std::uint32_t side, float distance, const glm::vec3& direction,
                          const EmitterSampler::Distribution& emitters, float even) const {
  const float pdf = sampler_.pdf(emitters, side);
  if (!(pdf > 0.0f)) return even;
  // 1 / w = 1 / w_even + pi K_e q r² / c
  const float apart = distance * distance / std::max(sampler_.cosine(side, direction), 1e-6f);
  return even / (1.0f + even * std::numbers::pi_v<float> * static_cast<float>(aimedCount_) * pdf * apart);
}

void Gatherer::gather(const glm::vec3& positionWorld, const glm::vec3& normal, Scratch& scratch,
                      std::vector<Arrival>& arrivals, RayCount& count) const {
  arrivals.resize(strata_.count());
  std::size_t arrived = 0;
  const glm::vec3 origin = positionWorld + normal * tracer_.epsilonAt(positionWorld);
  const std::uint64_t place = placeNumber(positionWorld, normal);
  DirectionStrata::Sequence sequence(strata_, normal, RandomStream(seed_, kStage, place));
  count.rays += strata_.count();
  if (aimedCount_ > 0) sampler_.prepare(origin, normal, scratch.emitters);

  // Cast the rays.
  scratch.samples.resize(strata_.count());
  scratch.directions.resize(strata_.count());
  scratch.hits.resize(strata_.count());
  for (std::uint32_t i = 0; i < strata_.count(); i += DirectionStrata::kBlock) {
    sequence.next(std::span(scratch.samples).subspan(i).first<DirectionStrata::kBlock>());
  }
  for (std::uint32_t i = 0; i < strata_.count(); ++i) scratch.directions[i] = scratch.samples[i].direction;
  scratch.bundle.trace(tracer_, origin, normal, scratch.directions, scratch.hits);

  // Find the sender that each ray ends at.
  for (std::uint32_t begin = 0; begin < strata_.count(); begin += kBatch) {
    const std::uint32_t size = std::min(kBatch, strata_.count() - begin);
    const std::span hits = std::span<const Hit>(scratch.hits).subspan(begin, size);
    lookUp(hits, scratch);
    for (std::uint32_t i = 0; i < size; ++i) {
      const DirectionStrata::Sample& sample = scratch.samples[begin + i];
      const Hit& hit = hits[i];
      std::uint32_t leaf = kNone;
      float weight = sample.weight;
      if (hit) {
        if (aimedCount_ > 0) {
          weight = misWeight(scratch.sides[i], hit.distance, sample.direction, scratch.emitters, weight);
        }
        leaf = leafOf(scratch.sides[i], scratch.tiles[i]);
        count.backFaces += hit.back;
        count.unmapped += leaf == kNone;
      } else {
        count.misses += 1;
        if (!sky_.empty()) leaf = hierarchy_.leafNode[surfelCount_ + sky_.nearest(sample.direction)];
      }
      if (leaf == kNone) continue;
      arrivals[arrived++] = {leaf, weight, sample.cosine, sample.direction};
    }
  }
  arrivals.resize(arrived);
  if (aimedCount_ > 0 && !scratch.emitters.cdf.empty()) {
    gatherAimed(place, origin, normal, scratch, arrivals, count);
    keepToSphere(arrivals);
  }
}

void Gatherer::gatherAimed(std::uint64_t place, const glm::vec3& origin, const glm::vec3& normal, Scratch& scratch,
                           std::vector<Arrival>& arrivals, RayCount& count) const {
  RandomStream random(seed_, kAimStage, place);
  const bool onSurface = glm::dot(normal, normal) > 0.0f;
  count.aimed += aimedCount_;
  for (std::uint32_t begin = 0; begin < aimedCount_; begin += kBatch) {
    // Cast a block of rays without those below the horizon.
    const std::uint32_t end = std::min(begin + kBatch, aimedCount_);
    scratch.rays.clear();
    scratch.distances.clear();
    for (std::uint32_t i = begin; i < end; ++i) {
      const float u = (static_cast<float>(i) + random.uniform()) / static_cast<float>(aimedCount_);
      const glm::vec3 to = sampler_.point(scratch.emitters, u, random) - origin;
      const float distance = glm::length(to);
      if (!(distance > 0.0f) || (onSurface && glm::dot(to, normal) <= 0.0f)) continue;
      scratch.rays.push_back(Ray{origin, 0.0f, to / distance});
      scratch.distances.push_back(distance);
    }
    scratch.hits.resize(scratch.rays.size());
    tracer_.trace(scratch.rays, scratch.hits, RayOrder::coherent);
    lookUp(scratch.hits, scratch);

    for (std::size_t i = 0; i < scratch.rays.size(); ++i) {
      const Hit& hit = scratch.hits[i];
      if (!hit || std::abs(hit.distance - scratch.distances[i]) > kSamePoint * scratch.distances[i]) continue;
      const glm::vec3& direction = scratch.rays[i].direction;
      const float cosine = onSurface ? glm::dot(direction, normal) : 1.0f;
      const float even = strata_.weight(cosine, onSurface);
      const float weight = misWeight(scratch.sides[i], hit.distance, direction, scratch.emitters, even);
      const std::uint32_t leaf = leafOf(scratch.sides[i], scratch.tiles[i]);
      if (weight == even || leaf == kNone) continue;  // not an emitter
      arrivals.push_back({leaf, weight, cosine, direction});
    }
  }
}

}  // namespace relume
