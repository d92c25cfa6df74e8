// SPDX-License-Identifier: MIT
// What rays find of the test lights at random receivers, before there are links. All that a certificate needs of the
// level, so that a bake in shards is certified where they are merged.
#pragma once

#include "bake/certificate/test_lights.h"
#include "bake/surfels/surfels.h"
#include "relume/bake/context.h"
#include "relume/result.h"

#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace relume {

struct TestRays {
  std::vector<TestLight> lights;
  std::vector<std::uint32_t> receiver;  // surfels that players see; the same one more than once where many do
  // [W/m²] [Size receivers * lights each] irradiance after one bounce by two independent sets of rays, the lights of
  // one receiver side by side. Direct light, with shadows, is that where the rays end, not of a surfel there.
  std::array<std::vector<glm::vec3>, 2> irradiance;
};

// rays: about so many in all; the least is 256 receivers. failed: cancelled. The same at any number of threads.
Result<TestRays> traceTestRays(const RayTracer& tracer, const PlaySpace& space, const Surfels& surfels,
                               const SurfelMap& map, const Hierarchy& hierarchy, std::uint64_t rays, std::uint64_t seed,
                               Context& context);

}  // namespace relume
