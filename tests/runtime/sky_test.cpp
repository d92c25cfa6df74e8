// SPDX-License-Identifier: MIT
// Light of the sky: what reaches caches, and what hosts make of maps and harmonics.
#include "relume/relighter.h"

#include "tests/runtime/make_relighter.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <span>
#include <vector>

namespace relume {
namespace {

TEST(Sky, patchesAndConstantReachTheCaches) {
  // Only sky: no surfel sends light.
  const Bake bake = test::makeSyntheticBake({.surfels = 64, .skyPatches = 32, .linksPerCache = 64});
  Relighter relighter = test::makeRelighter(bake);
  LightSetup setup;
  setup.emissionScale = glm::vec3(0.0f);
  setup.bounceScale = 0.0f;
  setup.skyRadiance = glm::vec3(2.0f);
  EXPECT_TRUE(relighter.relight(setup));
  const std::vector<float> constant = relighter.cacheCoefficients();
  EXPECT_GT(constant[0], 0.0f);
  std::vector<glm::vec3> patches(32, glm::vec3(2.0f));
  setup.skyPatches = patches;
  setup.skyRadiance = glm::vec3(77.0f);
  EXPECT_TRUE(relighter.relight(setup));
  EXPECT_EQ(relighter.cacheCoefficients(), constant);
}

TEST(Environment, patchesAverageTheirTexels) {
  const std::vector<glm::vec3> centres = {{0, 1, 0}, {0, -1, 0}};
  // Four rows of eight: the upper half 1, the lower half 3.
  std::vector<glm::vec3> texels(32, glm::vec3(1.0f));
  std::fill(texels.begin() + 16, texels.end(), glm::vec3(3.0f));
  const std::vector<glm::vec3> radiance = projectEnvironment(centres, texels, 8, 4);
  ASSERT_EQ(radiance.size(), 2u);
  EXPECT_NEAR(radiance[0].x, 1.0f, 1e-6f);
  EXPECT_NEAR(radiance[1].x, 3.0f, 1e-6f);
  EXPECT_TRUE(projectEnvironment(centres, texels, 8, 5).empty());
  EXPECT_TRUE(projectEnvironment(centres, {}, 0, 0).empty());
}

TEST(Sky, ofTwoColorsAndOfSphericalHarmonics) {
  const std::vector<glm::vec3> directions{{0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {0, 0.6f, 0.8f}};
  const glm::vec3 blue(1, 2, 4), brown(0.4f, 0.2f, 0.0f);
  const std::vector<glm::vec3> two = twoColorSky(directions, blue, brown);
  EXPECT_EQ(two[0], blue);
  EXPECT_EQ(two[1], brown);
  EXPECT_LT(glm::distance(two[2], 0.5f * (blue + brown)), 1e-6f);
  EXPECT_LT(glm::distance(two[3], 0.8f * blue + 0.2f * brown), 1e-6f);

  // The same sky in two bands: its mean, and half its difference along y.
  const float y0 = 0.28209479f, y1 = 0.48860251f;
  const std::vector<glm::vec3> coefficients{0.5f * (blue + brown) / y0, 0.5f * (blue - brown) / y1, {}, {}};
  const std::vector<glm::vec3> harmonics = shSky(directions, coefficients);
  for (std::size_t i = 0; i < two.size(); ++i) EXPECT_LT(glm::distance(harmonics[i], two[i]), 1e-5f) << i;
  EXPECT_EQ(shSky(directions, std::vector<glm::vec3>{{}, {0, -9, 0}, {}, {}})[0], glm::vec3(0.0f))
      << "no light below 0";
  EXPECT_TRUE(shSky(directions, std::span(coefficients).first(3)).empty());
  EXPECT_TRUE(shSky(directions, {}).empty());
}

TEST(Environment, theMiddleOfARowIsMinusZAndColumnsTurnTowardPlusX) {
  const std::vector<glm::vec3> centres = {{0, 0, -1}, {1, 0, 0}, {0, 0, 1}, {-1, 0, 0}};
  std::vector<glm::vec3> texels(64 * 3, glm::vec3(0.0f));
  // Columns 24..39 are the quarter around the middle, 40..55 the next one.
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 24; column < 40; ++column) texels[row * 64 + column] = glm::vec3(1.0f);
    for (std::size_t column = 40; column < 56; ++column) texels[row * 64 + column] = glm::vec3(2.0f);
  }
  const std::vector<glm::vec3> radiance = projectEnvironment(centres, texels, 64, 3);
  EXPECT_NEAR(radiance[0].x, 1.0f, 1e-6f);
  EXPECT_NEAR(radiance[1].x, 2.0f, 1e-6f);
  EXPECT_EQ(radiance[2].x, 0.0f);
  EXPECT_EQ(radiance[3].x, 0.0f);
}

}  // namespace
}  // namespace relume
