// SPDX-License-Identifier: MIT
// The lights that a bake is tried with: its sky, suns, and lamps where players can be, every other one a spot. Chosen
// from seed and level to shine on what is seen, never from the level's own lights, which may change while a bake stays
// what it is.
#pragma once

#include "bake/certificate/test_receivers.h"
#include "bake/rays/ray_tracer.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/certificate.h"
#include "relume/hierarchy.h"
#include "relume/surfels.h"

#include <cstdint>
#include <vector>

namespace relume {

// White, and alone.
struct TestLight {
  TestLightKind kind = TestLightKind::lamp;
  SceneLight light;                     // of suns and lamps
  std::vector<float> surfelIrradiance;  // [W/m²] [Size n_S] direct, with shadows; empty for the sky, of 1 W/m²/sr
};

inline constexpr std::uint32_t kTestSuns = 2, kTestLamps = 4;

// The sky where the bake has one, and at most kTestSuns and kTestLamps: fewer where next to no receiver is reached.
std::vector<TestLight> chooseTestLights(const RayTracer& tracer, const PlaySpace& space, const Surfels& surfels,
                                        const Hierarchy& hierarchy, const TestReceivers& receivers, std::uint64_t seed,
                                        Context& context);

}  // namespace relume
