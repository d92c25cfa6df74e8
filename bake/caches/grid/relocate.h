// SPDX-License-Identifier: MIT
// Tells caches that see the level from those behind or inside its geometry, by what their rays hit.
#pragma once

#include "bake/caches/charts/patches.h"
#include "bake/rays/ray_tracer.h"

#include <cstdint>
#include <limits>
#include <vector>

namespace relume {

// Shares of all rays, and how far it is to the nearest hit.
struct Surroundings {
  float back = 0.0f;     // hit the back of a one-sided surface: geometry is seen from inside
  float ownBack = 0.0f;  // of these, one of the instance that was named
  float near = 0.0f;     // hit something within `contact`
  float seen = 0.0f;     // hit a side that the play space sees
  float free = std::numeric_limits<float>::infinity();  // [m] no ray hits anything nearer
};

// Casts the same rays from every place: a hemisphere around a normal (cosine-weighted), or the sphere for normal 0. A
// quarter of them decides where they agree.
// Immutable, thread-safe.
class Prober {
 public:
  Prober(const RayTracer& tracer, const PlaySpace& playSpace);
  Surroundings probe(const glm::vec3& positionWorld, const glm::vec3& normal, float contact,
                     std::uint32_t instance = kNone) const;
  // Whether nothing stands between two places.
  bool connected(const glm::vec3& from, const glm::vec3& to) const;
  // Distance off a surface at which a cache starts: visible to rounding, small beside a texel. [m]
  float liftAt(const glm::vec3& positionWorld, float texelSize) const;
  const RayTracer& tracer() const { return tracer_; }

 private:
  const RayTracer& tracer_;
  const PlaySpace& playSpace_;
  std::vector<glm::vec3> hemisphere_, sphere_;  // unit directions, +Z up
};

}  // namespace relume
