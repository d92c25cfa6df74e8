// SPDX-License-Identifier: MIT
// Many rays from one point, traced together: up to twice as fast as in packets (docs/notes/tracing.md). They hit the
// same triangles; barycentrics differ from those of packets in their last bits, and are the same on any processor.
#pragma once

#include "bake/rays/ray_tracer.h"

#include <cstddef>
#include <span>
#include <vector>

namespace relume {

// Memory of one thread, kept from bundle to bundle.
class RayBundle {
 public:
  // Which instruction set is used: the best one of this processor, or the one that every processor has (for tests).
  enum class Simd { best, baseline };
  explicit RayBundle(Simd simd = Simd::best) : simd_(simd) {}

  // Nearest hits of rays from `origin`. axis: zero, or an axis in whose hemisphere all directions lie: what is below it
  // is not looked at. A tracer without a structure for bundles (RayStructure) traces packets. [Size hits >= directions]
  void trace(const RayTracer& tracer, const glm::vec3& origin, const glm::vec3& axis,
             std::span<const glm::vec3> directions, std::span<Hit> hits);

 private:
  struct alignas(64) Line {
    std::byte bytes[64];
  };

  Simd simd_;
  std::vector<Line> memory_;
  std::vector<Ray> rays_;
};

}  // namespace relume
