// SPDX-License-Identifier: MIT
// Rays aimed at emitters. Of the rays that look everywhere, only a few hit a small or distant emitter, and the light
// that they find is noise. So points on emitters are sampled as well, and both kinds of rays are weighted by the
// balance heuristic (Veach and Guibas 1995). With K rays of density p, and K_e aimed ones whose points have density q
// per area, light from a point at distance r that is seen under cosine c has the weight
//   w = 1 / (pi (K p + K_e q r² / c)),
// whichever kind of ray found it.
#pragma once

#include "bake/base/random.h"
#include "bake/surfels/surfels.h"
#include "relume/bake/scene.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <vector>

namespace relume {

// The emitting sides of a level, in batches of neighbours. Immutable, shared by all threads.
class EmitterSampler {
 public:
  EmitterSampler(const Scene& scene, const Surfels& surfels, const SurfelMap& map);

  bool empty() const { return side_.empty(); }

  // The probability that a ray of a cache is aimed at each batch: roughly in proportion to the light that would arrive
  // from the batch if nothing were in the way. Memory of one thread.
  struct Distribution {
    std::vector<float> cdf;  // [Size batches] cumulative, the last is 1; empty when nothing can be seen
  };
  void prepare(const glm::vec3& positionWorld, const glm::vec3& normal, Distribution& emitters) const;

  // A random point on an emitter. u: [0..1) chooses the batch.
  glm::vec3 point(const Distribution& emitters, float u, RandomStream& random) const;

  // Probability density of point() per area of a side [1/m²]; 0 where the side does not emit. side: 2 * triangle + back
  float pdf(const Distribution& emitters, std::uint32_t side) const {
    return indexOf_.empty() || indexOf_[side] == kNone || emitters.cdf.empty() ? 0.0f : pdfOf(emitters, indexOf_[side]);
  }
  // Absolute cosine of an emitting side's normal with a direction.
  float cosine(std::uint32_t side, const glm::vec3& direction) const;

 private:
  struct Side {
    glm::vec3 corner, edge1, edge2;  // [m]
    glm::vec3 normal;                // unit, of the side that emits
    float radiance;                  // mean over the side, the mean of the three colours
    float powerUpTo;                 // radiance x area, cumulative within the batch
    std::uint32_t batch;
  };
  struct Batch {
    std::uint32_t begin, end;  // of side_
    glm::vec3 center;          // [m]
    float radius;              // [m] of a sphere around all
    float power;
  };
  float pdfOf(const Distribution& emitters, std::uint32_t index) const;
  void makeBatches();

  std::vector<Side> side_;
  std::vector<Batch> batch_;
  std::vector<std::uint32_t> indexOf_;  // [Size 0 or 2 * triangles] into side_, or kNone
};

}  // namespace relume
