// SPDX-License-Identifier: MIT
// The grid as a texture, on the CPU backend: what it may answer for, threads, frames.
#include "relume/relighter.h"

#include "tests/on_threads.h"
#include "tests/runtime/furnace_bake.h"
#include "tests/runtime/make_relighter.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace relume {
namespace {

using test::makeRelighter;

// Random places in the room of a synthetic bake, and a normal each.
std::pair<std::vector<glm::vec3>, std::vector<glm::vec3>> receivers(std::size_t count) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  std::normal_distribution<float> gauss;
  std::vector<glm::vec3> positions, normals;
  for (std::size_t i = 0; i < count; ++i) {
    positions.emplace_back(12.0f * uniform(random), 4.0f * uniform(random), 6.0f * uniform(random));
    normals.push_back(glm::normalize(glm::vec3(gauss(random), gauss(random), gauss(random))));
  }
  return {positions, normals};
}

TEST(GridTexture, withoutTrustOrRoomIsReadLikeTheCachesAround) {
  const Bake bake = test::makeBakeWithBricks({5, 4, 4}, true, true);
  RelightOptions none, closed, tiny;
  closed.gridTexture = tiny.gridTexture = true;
  closed.gridTrust = 0.0f;
  tiny.gridTextureBytes = 72 * 5 * 4 * 4 - 1;
  LightSetup setup;
  const std::vector<Light> lights{{.kind = LightKind::point, .intensity = {60, 20, 10}, .positionWorld = {3, 2, 3}}};
  setup.lights = lights;
  const auto [positions, normals] = receivers(300);
  for (const RelightOptions& options : {none, closed, tiny}) {
    Relighter relighter = makeRelighter(bake, options);
    ASSERT_TRUE(relighter.relight(setup));
    EXPECT_EQ(relighter.gridTexture().openCells, 0u);
    EXPECT_EQ(relighter.gridTexture().resolution.x > 0, options.gridTrust == 0.0f);
    int lit = 0;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      const glm::vec3 expected = relighter.irradianceInGrid(positions[i], normals[i]);
      lit += expected.r > 0.0f;
      EXPECT_EQ(relighter.irradianceInGrid(positions[i], normals[i], GridLookup::texture), expected);
      EXPECT_EQ(relighter.irradianceInGrid(positions[i], normals[i], GridLookup::smooth), expected);
    }
    EXPECT_GT(lit, 150);
  }
}

TEST(GridTexture, isThatOfTheLastFrame) {
  const Bake bake = test::makeBakeWithBricks({5, 4, 4}, true, false);
  RelightOptions options;
  options.gridTexture = true;
  options.gridTrust = 1.0f;
  Relighter relighter = makeRelighter(bake, options), fresh = makeRelighter(bake, options);
  const auto [positions, normals] = receivers(300);
  std::vector<glm::vec3> first(300), again(300), expected(300), before(300, glm::vec3(1.0f));
  ASSERT_TRUE(fresh.irradianceInGrid(positions, normals, before, GridLookup::texture));
  EXPECT_EQ(before, std::vector<glm::vec3>(300, glm::vec3(0.0f))) << "before the first frame";
  LightSetup dim, bright;
  const std::vector<Light> lights{{.kind = LightKind::point, .intensity = {60, 20, 10}, .positionWorld = {3, 2, 3}}};
  const std::vector<Light> others{{.kind = LightKind::point, .intensity = {5, 60, 90}, .positionWorld = {9, 2, 3}}};
  dim.lights = lights, bright.lights = others;
  dim.bounceScale = bright.bounceScale = 0.0f;
  ASSERT_TRUE(relighter.relight(dim));
  ASSERT_TRUE(relighter.irradianceInGrid(positions, normals, first, GridLookup::smooth));
  ASSERT_TRUE(relighter.relight(bright));
  ASSERT_TRUE(fresh.relight(bright));
  for (const GridLookup lookup : {GridLookup::texture, GridLookup::smooth}) {
    ASSERT_TRUE(relighter.irradianceInGrid(positions, normals, again, lookup));
    ASSERT_TRUE(fresh.irradianceInGrid(positions, normals, expected, lookup));
    EXPECT_EQ(again, expected);
  }
  EXPECT_NE(again, first);
  EXPECT_STREQ(fresh.passTimes().back().pass, "grid texture");
  EXPECT_EQ(fresh.bufferSizes().back().first, "grid texture");
  relighter.reset();
  ASSERT_TRUE(relighter.irradianceInGrid(positions, normals, again, GridLookup::texture));
  EXPECT_EQ(again, std::vector<glm::vec3>(300, glm::vec3(0.0f)));
}

TEST(GridTexture, threadsChangeNothing) {
  const Bake bake = test::makeBakeWithBricks({5, 4, 4}, true, true);
  const auto [positions, normals] = receivers(300);
  std::vector<std::vector<glm::vec3>> found;
  for (const std::uint32_t threads : {1u, 2u, 7u}) {
    RelightOptions options;
    options.gridTexture = true;
    options.gridTrust = 0.6f;
    options.parallelFor = [threads](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
      test::onThreads(threads, tasks, body);
    };
    Relighter relighter = makeRelighter(bake, options);
    const std::vector<Light> lights{{.kind = LightKind::point, .intensity = {60, 20, 10}, .positionWorld = {3, 2, 3}}};
    LightSetup setup;
    setup.lights = lights;
    ASSERT_TRUE(relighter.relight(setup));
    found.emplace_back(300);
    ASSERT_TRUE(relighter.irradianceInGrid(positions, normals, found.back(), GridLookup::smooth));
    EXPECT_NE(found.back()[0], glm::vec3(0.0f));
    EXPECT_EQ(found.back(), found.front()) << threads << " threads";
  }
}

TEST(GridTexture, trustOutOfRangeIsRefused) {
  const Bake bake = test::makeFurnaceBake(0.5f, 1.0f, 2);
  for (const float trust : {-0.1f, 1.01f, std::numeric_limits<float>::quiet_NaN()}) {
    RelightOptions options;
    options.gridTrust = trust;
    const auto made = Relighter::create(bake, options);
    ASSERT_FALSE(made);
    EXPECT_EQ(made.error().code, ErrorCode::usage);
    EXPECT_NE(made.error().message.find("gridTrust is "), std::string::npos) << made.error().message;
  }
}

// A closed box of one albedo: every receiver has the same light, which six vectors hold exactly.
TEST(GridTexture, furnaceHasTheLightOfTheCachesAround) {
  const float rho = 0.6f, emission = 2.0f, limit = std::numbers::pi_v<float> * emission / (1.0f - rho);
  for (const std::uint32_t bands : {2u, 3u, 4u, 6u}) {
    RelightOptions options;
    options.gridTexture = true;
    options.gridTrust = 1.0f;
    Relighter relighter = makeRelighter(test::makeFurnaceBake(rho, emission, bands), options);
    EXPECT_TRUE(relightUntilConverged(relighter, {}, 1e-6f));
    std::mt19937 random(2);
    std::normal_distribution<float> gauss;
    for (int i = 0; i < 200; ++i) {
      const glm::vec3 n = glm::normalize(glm::vec3(gauss(random), gauss(random), gauss(random)));
      const glm::vec3 e = relighter.irradianceInGrid({0, 0, 0}, n, GridLookup::texture);
      EXPECT_NEAR(e.g, limit, 0.01f * limit) << bands;
    }
  }
}

}  // namespace
}  // namespace relume
