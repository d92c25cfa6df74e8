// SPDX-License-Identifier: MIT
// Hot reload on either backend: the first frame of a new relighter has the bounces of the old one's light.
#pragma once

#include "relume/relighter.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <vector>

namespace relume::test {

inline double totalOf(const Relighter& relighter) {
  const std::vector<float> coefficients = relighter.cacheCoefficients();
  const auto stride = static_cast<std::size_t>(relighter.coefficientsPerCache());
  double total = 0.0;
  for (std::size_t i = 0; i < coefficients.size(); i += stride) total += coefficients[i];
  return total;
}

inline void expectLightIsHandedOver(BackendKind kind, const GetProcAddress& getProcAddress = {}) {
  const Bake bake = makeSyntheticBake({.surfels = 700, .lightmapCaches = 24, .linksPerCache = 32});
  RelightOptions options;
  options.backend = kind;
  options.getProcAddress = getProcAddress;
  Result<Relighter> old = Relighter::create(bake, options), fresh = Relighter::create(bake, options),
                    heir = Relighter::create(bake, options);
  ASSERT_TRUE(old && fresh && heir);
  const std::vector<Light> lights = someLights();
  LightSetup setup;
  setup.lights = lights;
  ASSERT_TRUE(relightUntilConverged(*old, setup));
  const double converged = totalOf(*old);
  ASSERT_TRUE(fresh->relight(setup));
  ASSERT_TRUE(heir->inherit(*old, bake));
  ASSERT_TRUE(heir->relight(setup));
  const double first = totalOf(*heir);
  const double without = std::abs(totalOf(*fresh) - converged), with = std::abs(first - converged);
  EXPECT_GT(without, 0.05 * converged) << "bounces are too weak for this test to see them";
  EXPECT_LT(with, 0.35 * without) << "converged " << converged << ", fresh " << totalOf(*fresh) << ", heir " << first;
  // It is handed over once: the frames that follow converge to what the level has.
  ASSERT_TRUE(relightUntilConverged(*heir, setup));
  EXPECT_NEAR(totalOf(*heir), converged, 2e-3 * converged);
  // A relighter that has light of its own takes the other's in its place.
  ASSERT_TRUE(heir->inherit(*old, bake));
  ASSERT_TRUE(heir->relight(setup));
  EXPECT_NEAR(totalOf(*heir), first, 1e-3 * converged);
  // Without bounces nothing is handed over; a reset forgets.
  LightSetup once = setup;
  once.bounceScale = 0.0f;
  heir->reset();
  ASSERT_TRUE(heir->inherit(*old, bake));
  ASSERT_TRUE(heir->relight(once));
  EXPECT_NEAR(totalOf(*heir), totalOf(*fresh), 1e-3 * converged);
  heir->reset();
  ASSERT_TRUE(heir->inherit(*old, bake));
  heir->reset();
  ASSERT_TRUE(heir->relight(setup));
  EXPECT_NEAR(totalOf(*heir), totalOf(*fresh), 1e-3 * converged);

  const Bake other = makeSyntheticBake({.surfels = 600, .lightmapCaches = 24, .linksPerCache = 32});
  const Status refused = heir->inherit(*old, other);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::usage);
}

}  // namespace relume::test
