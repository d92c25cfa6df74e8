// SPDX-License-Identifier: MIT
// Light beyond what halves hold: the OpenGL backend dims each cache as a whole, so that lamps in candela are clipped
// light and no black spots.
#include "formats/color.h"
#include "relume/relighter.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/synthetic_bake.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace relume {
namespace {

class GlRange : public test::GlTest {};

Relighter brightRoom(const Bake& bake, BackendKind backend) {
  RelightOptions options;
  options.backend = backend;
  options.getProcAddress = EglContext::getProcAddress;
  options.lumaBands = 4;
  options.chromaBands = 2;
  options.gridTexture = true;
  options.gridTrust = 1.0f;
  Result<Relighter> made = Relighter::create(bake, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  const Light lamp{.kind = LightKind::point, .intensity = 1e5f * glm::vec3(60, 30, 10), .positionWorld = {2, 1, 1}};
  LightSetup setup;
  setup.lights = {&lamp, 1};
  setup.emissionScale = glm::vec3(0.0f);
  EXPECT_TRUE(made->relight(setup));
  return std::move(*made);
}

TEST_F(GlRange, cachesBeyondHalvesAreDimmedAsOne) {
  for (const LinkKind kind : kLinkKinds) {
    SCOPED_TRACE(static_cast<int>(kind));
    const Bake bake = test::makeSyntheticBake({.kind = kind});
    const Relighter cpu = brightRoom(bake, BackendKind::cpu), gl = brightRoom(bake, BackendKind::gl);
    const std::vector<float> expected = cpu.cacheCoefficients(), found = gl.cacheCoefficients();
    ASSERT_EQ(expected.size(), found.size());
    const auto stride = static_cast<std::size_t>(cpu.coefficientsPerCache());
    std::size_t dimmed = 0;
    for (std::size_t first = 0; first < expected.size(); first += stride) {
      float largest = 0.0f;
      for (std::size_t i = 0; i < stride; ++i) largest = std::max(largest, std::abs(expected[first + i]));
      const float factor = std::min(1.0f, 65504.0f / std::max(largest, 1.0f));
      dimmed += factor < 1.0f;
      for (std::size_t i = 0; i < stride; ++i)
        ASSERT_NEAR(found[first + i], factor * expected[first + i], 5e-3f * factor * largest + 1e-3f)
            << "cache " << first / stride << ", coefficient " << i;
    }
    EXPECT_GT(dimmed, 10u);
    EXPECT_LT(dimmed, expected.size() / stride);
  }
}

// What a receiver reads is a mean of caches, of which the most dimmed have `least` of their light.
TEST_F(GlRange, nothingIsBlackWhereTheCpuIsBright) {
  const Bake bake = test::makeSyntheticBake({.kind = LinkKind::oct6});
  const Relighter cpu = brightRoom(bake, BackendKind::cpu), gl = brightRoom(bake, BackendKind::gl);
  float largest = 0.0f;
  for (const float c : cpu.cacheCoefficients()) largest = std::max(largest, std::abs(c));
  const float least = 65504.0f / largest;
  ASSERT_LT(least, 0.5f);
  std::mt19937 random(8);
  std::uniform_real_distribution<float> uniform(0.02f, 0.98f);
  std::normal_distribution<float> gauss;
  const CacheGrid& grid = bake.caches.grid;
  int bright = 0;
  for (int i = 0; i < 2000; ++i) {
    const glm::vec3 p = grid.originWorld + glm::vec3(uniform(random), uniform(random), uniform(random)) * grid.spacing *
                                               glm::vec3(grid.resolution - 1u);
    const glm::vec3 n = glm::normalize(glm::vec3(gauss(random), gauss(random), gauss(random)));
    const glm::vec2 uv(uniform(random), uniform(random));
    const std::array<std::pair<glm::vec3, glm::vec3>, 4> reads{
        {{cpu.irradianceInGrid(p, n), gl.irradianceInGrid(p, n)},
         {cpu.irradianceInGrid(p, n, GridLookup::texture), gl.irradianceInGrid(p, n, GridLookup::texture)},
         {cpu.irradianceInGrid(p, n, GridLookup::smooth), gl.irradianceInGrid(p, n, GridLookup::smooth)},
         {cpu.irradianceOnLightmap(uv, n), gl.irradianceOnLightmap(uv, n)}}};
    for (std::size_t k = 0; k < reads.size(); ++k) {
      const float expected = rgbToYCoCg(reads[k].first).x, found = rgbToYCoCg(reads[k].second).x;
      if (expected < 30000.0f) continue;
      ++bright;
      ASSERT_GT(found, 0.9f * least * expected) << "read " << k << " of " << expected;
      ASSERT_LT(found, 1.05f * expected) << "read " << k;
    }
  }
  EXPECT_GT(bright, 1000);
}

}  // namespace
}  // namespace relume
