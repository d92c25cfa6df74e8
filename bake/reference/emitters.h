// SPDX-License-Identifier: MIT
// The emitting triangles of a level as one light: points on them are drawn by area times radiance.
#pragma once

#include "bake/base/random.h"
#include "bake/rays/ray_tracer.h"
#include "relume/bake/scene.h"

#include <cstdint>
#include <vector>

namespace relume {

// A point drawn on an emitter.
struct EmitterSample {
  glm::vec3 position{0.0f};  // [m]
  glm::vec3 normal{0.0f};    // unit, geometric, front side
  glm::vec3 radiance{0.0f};  // [W/m²/sr] of the side it emits from
  bool bothSides = false;
  float density = 0.0f;  // [1/m²] probability per area
};

class Emitters {
 public:
  // Collect the emitting triangles of the fixed instances, or of all that are drawn.
  explicit Emitters(const Scene& scene, RayGeometry geometry = RayGeometry::fixed);

  bool empty() const { return cumulative_.empty(); }
  // Draw a point; density 0 when there is no emitter.
  EmitterSample sample(RandomStream& random) const;
  // [1/m²] probability per area with which sample() finds this point; 0 where nothing emits.
  float density(const SurfacePoint& p) const;

 private:
  const Scene& scene_;
  std::vector<std::uint32_t> instance_, triangle_;  // [Size emitters]
  std::vector<double> cumulative_;                  // [Size emitters] power up to and with this one, sums to 1
  std::vector<float> perInstance_;                  // [1/m²] [Size instances] density on an instance's triangles
};

}  // namespace relume
