// SPDX-License-Identifier: MIT
// Casts a cache's rays and finds the sender at the end of each: rays to leaf transfers (PIC 4.5, App. A).
//
// Deviation: the paper samples every sender from every cache; here K rays per cache find the senders that are visible.
// It is the same estimate of c_{s,i} (PIC Eq. (8), the rays that miss s add zero to it), linear in what is visible and
// independent of n_S.
#pragma once

#include "bake/links/directions.h"
#include "bake/links/emitter_sampler.h"
#include "bake/rays/bundle/ray_bundle.h"
#include "bake/surfels/surfels.h"
#include "relume/bake/options.h"
#include "relume/hierarchy.h"

#include <cstdint>
#include <vector>

namespace relume {

// Light that arrives along a ray: from which leaf of the hierarchy.
struct Arrival {
  std::uint32_t leaf;   // node
  float weight;         // w = 1 / (pi p K): sum of w y_i over rays estimates c_i
  float cosine;         // with the cache's normal; 1 at grid caches
  glm::vec3 direction;  // unit, cache toward sender
};

// Counts of how the rays ended. They are integers, so that sums over caches do not depend on the order.
struct RayCount {
  std::uint64_t rays = 0, backFaces = 0, misses = 0, unmapped = 0;
  std::uint64_t aimed = 0;  // at emitters, in addition to `rays`
  RayCount& operator+=(const RayCount& other);
};

// Finds the sky patch whose direction is nearest, by a table over the octahedron that is much finer than the patches.
class SkyLookup {
 public:
  explicit SkyLookup(std::span<const glm::vec3> directions);
  bool empty() const { return patch_.empty(); }
  std::uint32_t nearest(const glm::vec3& direction) const;

 private:
  std::uint32_t side_ = 0;
  std::vector<std::uint16_t> patch_;  // [Size side²]
};

// Immutable, shared by all threads. Keeps references to what it is made from.
class Gatherer {
 public:
  // emitterRays [0..1]: rays aimed at emitters in addition to raysPerCache, as a share of it.
  Gatherer(const RayTracer& tracer, const Surfels& surfels, const SurfelMap& map, const Hierarchy& hierarchy,
           std::uint32_t raysPerCache, float emitterRays, std::uint64_t seed);

  // Memory of one thread, kept from cache to cache.
  struct Scratch {
    RayBundle bundle;
    std::vector<glm::vec3> directions;
    std::vector<Ray> rays;  // aimed
    std::vector<Hit> hits;
    std::vector<std::uint32_t> sides, tiles;  // that the rays hit, of the surfel map
    std::vector<DirectionStrata::Sample> samples;
    std::vector<float> distances;  // [m] to the points that are aimed at
    EmitterSampler::Distribution emitters;
  };

  // Replace `arrivals` by the light that reaches a cache. The random numbers depend on seed and place alone.
  void gather(const glm::vec3& positionWorld, const glm::vec3& normal, Scratch& scratch, std::vector<Arrival>& arrivals,
              RayCount& count) const;

 private:
  void gatherAimed(std::uint64_t place, const glm::vec3& origin, const glm::vec3& normal, Scratch& scratch,
                   std::vector<Arrival>& arrivals, RayCount& count) const;
  // Find the sides and the tiles of the surfel map that were hit.
  void lookUp(std::span<const Hit> hits, Scratch& scratch) const;
  // The node of what was hit; kNone: no surfel.
  std::uint32_t leafOf(std::uint32_t side, std::uint32_t tile) const;
  // The MIS weight of a hit on an emitter, which both kinds of rays can find; `even`, the weight of a ray without aimed
  // ones, for any other hit.
  float misWeight(std::uint32_t side, float distance, const glm::vec3& direction,
                  const EmitterSampler::Distribution& emitters, float even) const;

  const RayTracer& tracer_;
  const SurfelMap& map_;
  const Hierarchy& hierarchy_;
  std::vector<std::uint32_t> leafOfTile_;  // [Size map tiles] node, kNone: no surfel
  std::uint32_t surfelCount_;
  std::uint64_t seed_;
  DirectionStrata strata_;
  EmitterSampler sampler_;
  std::uint32_t aimedCount_;  // K_e
  SkyLookup sky_;
};

}  // namespace relume
