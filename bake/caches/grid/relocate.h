// SPDX-License-Identifier: MIT
// Tells caches that see the level from those behind or inside its geometry, by what their rays hit.
#pragma once

#include "bake/caches/charts/patches.h"
#include "bake/rays/ray_tracer.h"

#include <cstdint>
#include <limits>
#include <vector>

namespace relume {

// What rays around a position hit, as shares of all rays, and how far away it is.
struct Surroundings {
  float back = 0.0f;     // hit the back of a one-sided surface: geometry is seen from inside
  float ownBack = 0.0f;  // of these, one of the instance that was named
  float near = 0.0f;     // hit something within `contact`
  float seen = 0.0f;     // hit a side that the play space sees
  float missed = 0.0f;   // hit nothing
  float free = std::numeric_limits<float>::infinity();  // [m] no ray hits anything nearer
  float nearness = 0.0f;  // [1/m] mean of 1 / distance to what is hit, which is taken to be `contact` away at least
};

// Casts the same rays from every position: over the hemisphere around a normal (cosine-weighted), or over the sphere
// for normal 0. Where the first quarter of the rays agrees, the rest is not cast. Immutable, thread-safe.
class Prober {
 public:
  Prober(const RayTracer& tracer, const PlaySpace& playSpace);
  Surroundings probe(const glm::vec3& positionWorld, const glm::vec3& normal, float contact,
                     std::uint32_t instance = kNone) const;
  // Whether nothing lies between two positions.
  bool connected(const glm::vec3& from, const glm::vec3& to) const;
  // Distance [m] off a surface at which a cache is placed: larger than rounding errors, small compared with a texel.
  float liftAt(const glm::vec3& positionWorld, float texelSize) const;
  const RayTracer& tracer() const { return tracer_; }

 private:
  const RayTracer& tracer_;
  const PlaySpace& playSpace_;
  std::vector<glm::vec3> hemisphere_, sphere_;  // unit directions, +Z up
};

}  // namespace relume
