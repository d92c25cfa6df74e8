// SPDX-License-Identifier: MIT
// See walks.h.
#include "bake/visibility/walks.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/visibility/surface_parts.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <mutex>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kWalksPerChunk = 2048;
constexpr float kFreshStarts = 0.25f;  // share of a later round's walks that start at the sources again

// The state of one walk.
struct Walker {
  RandomStream random{0, 0, 0};
  glm::vec3 air{0.0f};     // [m] the last point in free space
  glm::vec3 origin{0.0f};  // [m]
  glm::vec3 direction{0.0f};
  bool inAir = true;         // the origin is a point in free space, not on a surface
  bool known = true;         // see Start
  bool mayBeHidden = false;  // see Start
  bool ended = false;
};

glm::vec3 cosineDirection(const glm::vec3& unitNormal, RandomStream& random) {
  const glm::vec3 d = unitNormal + 0.9999f * uniformDirection(random.uniform2());
  return glm::normalize(d);
}

// Where hits are counted: near ones by voxel, far ones by side.
struct Counts {
  VoxelGrid grid;
  float far = 0.0f;                              // [m] hits beyond this distance are far
  VoxelCounter near;                             // by voxel
  std::map<std::uint32_t, std::uint32_t> onFar;  // by side
  std::mutex mutex;                              // of onFar
};

// What the walkers of a chunk hit.
struct ChunkHits {
  std::vector<VoxelHits> near;
  std::vector<std::uint32_t> far;  // sides
};

// Count what a walker hit, and send it on.
void advance(const RayTracer& tracer, const Counts& counts, const Hit& hit, Walker& w, ChunkHits& hits) {
  const Scene& scene = tracer.scene();
  const bool far = hit && hit.distance > counts.far;
  if (far) {
    hits.far.push_back(2 * (scene.instances[hit.instance].firstTriangle + hit.triangle) + (hit.back ? 1 : 0));
  }
  if (!hit || far) {
    // Do not follow into the sky or so far away: look elsewhere from the last point in the air.
    w.origin = w.air;
    w.inAir = true;
    w.direction = uniformDirection(w.random.uniform2());
    return;
  }
  const Instance& instance = scene.instances[hit.instance];
  // A walk that is not known to be in free space has not left its start.
  if (!w.known && hit.back &&
      (!scene.bothSides(instance, hit.triangle) || (w.mayBeHidden && isHidden(tracer, w.origin)))) {
    w.ended = true;
    return;
  }
  w.known = true;

  const auto corners = scene.corners(instance, hit.triangle);
  const glm::vec3 position = pointOf(corners, hit.barycentric);
  const glm::vec3 cross = hit.back ? -crossOf(corners) : crossOf(corners);
  VoxelHits& voxel = hits.near.emplace_back(counts.grid.voxel(hit.instance, position, cross));
  (w.inAir ? voxel.direct : voxel.bounced) = 1;

  const float length = glm::length(cross);
  const glm::vec3 normal = length > 0.0f ? cross / length : -w.direction;
  const glm::vec3 off = normal * tracer.epsilonAt(position);
  if (w.random.uniform() < 0.5f) {
    // Move off the surface in any case: the point may be at the end of the chord, where rounding could carry it
    // through.
    w.air = glm::mix(w.origin, position, w.random.uniform()) + off;
    w.origin = w.air;
    w.inAir = true;
    w.direction = uniformDirection(w.random.uniform2());
  } else {
    w.origin = position + off;
    w.inAir = false;
    w.direction = cosineDirection(normal, w.random);
  }
}

// Walk one round. Each walk starts at a source or, in later rounds, in the pool: where a walk of the round before
// ended. The points in the air where this round's walks end become the next pool.
void walkRound(const RayTracer& tracer, const PlaySpaceOptions& options, std::uint64_t seed, std::uint32_t round,
               const StartSources& sources, WalkEnds& pool, Counts& counts, Context& context) {
  const std::size_t walks = std::max<std::size_t>(options.walks / kWalkRounds, 1);
  std::vector<glm::vec3> reached(walks);
  std::vector<std::uint8_t> valid(walks, 0);

  parallelChunks(context, "play space", walks, kWalksPerChunk, [&](std::size_t begin, std::size_t end) {
    const std::size_t count = end - begin;
    std::vector<Walker> walkers(count);
    std::vector<Ray> rays(count);
    std::vector<Hit> found(count);
    ChunkHits hits;
    hits.near.reserve(count * options.maxBounces);
    for (std::size_t i = 0; i < count; ++i) {
      Walker& w = walkers[i];
      w.random = RandomStream(seed, kWalkStage + round, begin + i);
      const bool fresh = pool.empty() || w.random.uniform() < kFreshStarts;
      const Start start = fresh ? drawStart(sources, w.random)
                                : Start{pool[w.random.below(pool.walks())], uniformDirection(w.random.uniform2())};
      w.origin = w.air = start.position;
      w.direction = start.direction;
      w.known = start.known;
      w.mayBeHidden = start.mayBeHidden;
    }

    // Step all walkers of the chunk together, so that rays are traced in packets.
    for (std::uint32_t step = 0; step < options.maxBounces; ++step) {
      for (std::size_t i = 0; i < count; ++i) rays[i] = {walkers[i].origin, 0.0f, walkers[i].direction};
      tracer.trace(rays, found);
      for (std::size_t i = 0; i < count; ++i) {
        if (!walkers[i].ended) advance(tracer, counts, found[i], walkers[i], hits);
      }
    }
    counts.near.add(hits.near);
    if (!hits.far.empty()) {
      const std::lock_guard lock(counts.mutex);
      for (const std::uint32_t side : hits.far) ++counts.onFar[side];
    }
    for (std::size_t i = 0; i < count; ++i) {
      reached[begin + i] = walkers[i].air;
      valid[begin + i] = !walkers[i].ended && walkers[i].known ? 1 : 0;
    }
  });

  pool.set(std::move(reached), valid);
}

}  // namespace

void WalkEnds::set(std::vector<glm::vec3> reached, std::span<const std::uint8_t> valid) {
  reached_ = std::move(reached);
  next_.resize(reached_.size());
  auto after = static_cast<std::uint32_t>(std::ranges::find(valid, 1) - valid.begin());  // of walk 0, once around
  count_ = static_cast<std::size_t>(std::ranges::count(valid, 1));
  for (std::size_t i = reached_.size(); i-- > 0;) {
    if (valid[i] != 0) after = static_cast<std::uint32_t>(i);
    next_[i] = after;
  }
}

std::vector<glm::vec3> WalkEnds::some(std::size_t most) const {
  std::vector<glm::vec3> points;
  if (count_ <= most) {
    for (std::size_t i = 0; i < reached_.size(); ++i)
      if (next_[i] == i) points.push_back(reached_[i]);
  } else {
    for (std::size_t i = 0; i < most; ++i) points.push_back((*this)[i * reached_.size() / most]);
  }
  return points;
}

Walks walkThrough(const RayTracer& tracer, const PlaySpaceOptions& options, std::uint64_t seed,
                  const StartSources& sources, float voxelSize, float farDistance, Context& context) {
  Walks walks;
  walks.grid.size = voxelSize;
  walks.grid.origin = tracer.boundsMin() - 0.3719f * voxelSize;  // off the round coordinates that levels are built on
  Counts counts;
  counts.grid = walks.grid;
  counts.far = farDistance;
  for (std::uint32_t round = 0; round < kWalkRounds && !context.cancelled(); ++round)
    walkRound(tracer, options, seed, round, sources, walks.ends, counts, context);
  walks.voxels = counts.near.sorted();
  for (const VoxelHits& c : walks.voxels) walks.nearHits += static_cast<double>(c.direct) + c.bounced;
  walks.farHits = std::move(counts.onFar);
  return walks;
}

}  // namespace relume
