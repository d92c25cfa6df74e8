// SPDX-License-Identifier: MIT
// Tracers and light by a function of the place hit, so that every answer is known.
#pragma once

#include "bake/preview/gather.h"

#include "relume/bake/context.h"

#include <gtest/gtest.h>

#include <functional>
#include <utility>

namespace relume::test {

inline RayTracer tracerOf(const Scene& scene) {
  Context context;
  auto tracer = RayTracer::create(scene, "avx2", context, RayStructure::bundles);
  EXPECT_TRUE(tracer);
  return std::move(*tracer);
}

// Radiance by the place that is hit.
inline HitRadiance lightAt(std::function<glm::vec3(const glm::vec3&)> radiance) {
  return [radiance = std::move(radiance)](std::uint64_t, float, std::span<const Ray> rays, std::span<const Hit> hits,
                                          std::span<glm::vec3> found) {
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (hits[i]) found[i] = radiance(rays[i].origin + hits[i].distance * rays[i].direction);
    }
  };
}

}  // namespace relume::test
