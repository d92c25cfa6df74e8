// SPDX-License-Identifier: MIT
// What rays find of the test lights at random receivers, before there are links. All that a certificate needs of the
// level, so that a bake in shards is certified where they are merged.
#pragma once

#include "bake/caches/caches.h"
#include "bake/certificate/test_lights.h"
#include "bake/certificate/test_receivers.h"
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
  TestReceivers receivers;
  // [W/m²] [Size receivers * lights each] irradiance after one bounce by two independent sets of rays, the lights of
  // one receiver side by side. Each is unbiased, and noise may take it below 0.
  std::array<std::vector<glm::vec3>, 2> irradiance;
  // [W/m²] [Size lights] mean over receivers and channels of irradiance after all bounces, of which those beyond the
  // first are by surfels.
  std::vector<float> meanLight;
};

// rays: about so many in all; the least is 256 receivers. failed: cancelled. The same at any number of threads.
Result<TestRays> traceTestRays(const RayTracer& tracer, const PlaySpace& space, const PlacedSurfels& surfels,
                               const Hierarchy& hierarchy, const PlacedCaches& caches, std::uint64_t rays,
                               std::uint64_t seed, Context& context);

}  // namespace relume
