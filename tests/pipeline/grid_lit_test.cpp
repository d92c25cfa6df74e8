// SPDX-License-Identifier: MIT
// extras.relume.bake "gridLit": such a node blocks light and sends it as a static one does, has no place on the light
// map, and receives what the grid has. So does what is too small for the map, however little is around, and what stands
// on top of all else.
#include "formats/validate.h"
#include "relume/bake/bake.h"
#include "relume/relighter.h"

#include "tests/surfels/make_level.h"

#include <algorithm>
#include <map>
#include <numbers>
#include <string>
#include <vector>

namespace relume {
namespace {

// A room of 4 x 2 x 2 m with a lamp on the wall at x = 0, and a partition at x = 2 that leaves no gap.
constexpr std::uint32_t kPartition = 2;  // instance

Scene roomWithPartition(BakeMode mode) {
  Level level;
  level.begin("room");
  level.addRoom({4, 2, 2});
  level.begin("lamp").emission = glm::vec3(5.0f);
  level.addRectangle({0.01f, 0.5f, 0.5f}, {0, 1, 0}, {0, 0, 1});
  level.begin("partition");
  level.addRectangle({1.9f, 0, 0}, {0, 0, 2}, {0, 2, 0});
  level.addRectangle({2.1f, 0, 0}, {0, 2, 0}, {0, 0, 2});
  level.scene().instances[kPartition].mode = mode;
  return level.scene();
}

Bake bakeRoom(const Scene& scene) {
  BakeOptions options = presetOptions(Preset::draft);
  options.playSpace.mode = PlaySpaceOptions::Mode::all;
  options.surfels.count = 2048;
  options.caches.gridCaches = 400;
  options.caches.lightmapCaches = 400;
  Context context;
  Result<Bake> made = bake(scene, options, context);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  for (const Finding& finding : validateBake(*made))
    EXPECT_NE(finding.severity, FindingSeverity::error) << toString(finding);
  return std::move(*made);
}

Relighter lit(const Bake& bake) {
  Result<Relighter> relighter = Relighter::create(bake, {});
  EXPECT_TRUE(relighter);
  EXPECT_TRUE(relightUntilConverged(*relighter, {}));
  return std::move(*relighter);
}

std::uint32_t surfelsOf(const Bake& bake, std::uint32_t instance) {
  return static_cast<std::uint32_t>(std::count(bake.surfels.instance.begin(), bake.surfels.instance.end(), instance));
}

// Mean irradiance in the grid on the lamp's side (x = 1) and on the other (x = 3).
float meanAt(const Relighter& relighter, float x) {
  float sum = 0.0f;
  for (const float y : {0.5f, 1.0f, 1.5f}) {
    for (const float z : {0.5f, 1.0f, 1.5f}) {
      for (const glm::vec3& n : {glm::vec3(1, 0, 0), glm::vec3(-1, 0, 0), glm::vec3(0, 1, 0), glm::vec3(0, -1, 0)})
        sum += relighter.irradianceInGrid({x, y, z}, n).g / 36.0f;
    }
  }
  return sum;
}

class GridLit : public testing::Test {
 protected:
  const Bake& bakeOf(BakeMode mode) {
    static std::map<BakeMode, Bake> bakes;
    const auto found = bakes.find(mode);
    return found != bakes.end() ? found->second : bakes.emplace(mode, bakeRoom(roomWithPartition(mode))).first->second;
  }
};

TEST_F(GridLit, hasNoPlaceOnTheLightMap) {
  const auto chartedCorners = [&](BakeMode mode) {
    const Lightmap& map = bakeOf(mode).caches.lightmap;
    const LightmapPart& part = map.parts[kPartition];
    EXPECT_EQ(part.triangleCount, 4u);
    std::size_t charted = 0;
    for (std::uint64_t c = part.firstCorner; c < part.firstCorner + 12; ++c) charted += map.cornerUv[c] != kGridLit;
    return charted;
  };
  EXPECT_EQ(chartedCorners(BakeMode::fixed), 12u);
  EXPECT_EQ(chartedCorners(BakeMode::gridLit), 0u);
  EXPECT_EQ(chartedCorners(BakeMode::dynamic), 0u);
}

TEST_F(GridLit, blocksAsStaticDoes) {
  const float still = meanAt(lit(bakeOf(BakeMode::fixed)), 3.0f),
              blocked = meanAt(lit(bakeOf(BakeMode::gridLit)), 3.0f);
  const float open = meanAt(lit(bakeOf(BakeMode::dynamic)), 3.0f), near = meanAt(lit(bakeOf(BakeMode::gridLit)), 1.0f);
  EXPECT_GT(open, 0.1f) << "light must reach the other side when nothing is between, or nothing is tested";
  EXPECT_GT(near, 0.1f);
  // Grids blur what is at a wall: some light comes through either.
  EXPECT_LT(still, 0.1f * open);
  EXPECT_LT(blocked, 0.1f * open);
}

TEST_F(GridLit, sendsLightAsStaticDoes) {
  const std::uint32_t still = surfelsOf(bakeOf(BakeMode::fixed), kPartition);
  EXPECT_GT(still, 100u);
  EXPECT_NEAR(surfelsOf(bakeOf(BakeMode::gridLit), kPartition), still, 0.05 * still);
  EXPECT_EQ(surfelsOf(bakeOf(BakeMode::dynamic), kPartition), 0u);

  // Its surfels are lit by the grid, and as brightly as on the map.
  const auto meanRadiosity = [&](BakeMode mode) {
    const Bake& bake = bakeOf(mode);
    const Relighter relighter = lit(bake);
    const std::vector<glm::vec3> nodes = relighter.nodeRadiosity();
    double sum = 0.0, count = 0.0;
    for (std::uint32_t s = 0; s < bake.surfels.count(); ++s) {
      if (bake.surfels.instance[s] != kPartition || bake.surfels.normal[s].x > 0.0f) continue;
      EXPECT_EQ(bake.surfels.receiver[s] == kGridReceiver, mode == BakeMode::gridLit);
      sum += nodes[bake.hierarchy.leafNode[s]].g;
      ++count;
    }
    return sum / count;
  };
  const double onMap = meanRadiosity(BakeMode::fixed), grid = meanRadiosity(BakeMode::gridLit);
  EXPECT_GT(onMap, 0.05);
  EXPECT_NEAR(grid, onMap, 0.25 * onMap);
}

TEST_F(GridLit, isNotStaticToProvenance) {
  EXPECT_NE(bakeOf(BakeMode::fixed).provenance.sceneHash, bakeOf(BakeMode::gridLit).provenance.sceneHash);
  EXPECT_NE(bakeOf(BakeMode::fixed).instances[kPartition].contentHash,
            bakeOf(BakeMode::gridLit).instances[kPartition].contentHash);
}

TEST_F(GridLit, withoutAGridThereIsAWarning) {
  const Scene scene = roomWithPartition(BakeMode::gridLit);
  BakeOptions options = presetOptions(Preset::draft);
  options.playSpace.mode = PlaySpaceOptions::Mode::all;
  options.surfels.count = 512;
  options.caches.gridCaches = 0;
  options.caches.lightmapCaches = 100;
  std::string warnings;
  Context context;
  context.onMessage = [&](Severity severity, std::string_view text) {
    if (severity == Severity::warning) warnings += std::string(text) + "\n";
  };
  ASSERT_TRUE(bake(scene, options, context));
  EXPECT_NE(warnings.find("node \"partition\" is gridLit, but this bake has no grid"), std::string::npos) << warnings;
}

// Cubes of 3 cm, 40 cm apart, smaller than any texel: what they read of the grid has the light of the sky.
TEST(SmallPieces, farFromEachOtherAreLitByTheGrid) {
  Level level;
  for (int i = 0; i < 36; ++i) {
    const float size = 0.03f;
    const glm::vec3 at(0.4f * static_cast<float>(i % 6), 0.1f * static_cast<float>(i / 6),
                       0.4f * static_cast<float>(i / 6));
    level.begin(("cube" + std::to_string(i)).c_str());
    for (int k = 0; k < 3; ++k) {
      glm::vec3 u(0.0f), v(0.0f), n(0.0f);
      u[k] = v[(k + 1) % 3] = n[(k + 2) % 3] = size;
      level.addRectangle(at, v, u);
      level.addRectangle(at + n, u, v);
    }
  }
  BakeOptions options = presetOptions(Preset::draft);
  options.surfels.count = 1024;
  options.caches.lightmapCaches = 2;
  Context context;
  const Result<Bake> made = bake(level.scene(), options, context);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_TRUE(made->caches.lightmap.cache.empty());
  Result<Relighter> relighter = Relighter::create(*made, {});
  ASSERT_TRUE(relighter);
  LightSetup setup;
  setup.skyRadiance = glm::vec3(1.0f);
  ASSERT_TRUE(relightUntilConverged(*relighter, setup));
  for (const Instance& cube : level.scene().instances) {
    const glm::vec3 middle = level.scene().meshes[cube.mesh].position[0] + 0.015f;
    for (const glm::vec3& n : {glm::vec3(1, 0, 0), glm::vec3(0, 1, 0), glm::vec3(0, 0, -1)})
      EXPECT_NEAR(relighter->irradianceInGrid(middle + 0.016f * n, n).g, std::numbers::pi_v<float>, 0.2f) << cube.node;
  }
}

// A solid stage on a ground, the highest of the level: on it the sky is seen as everywhere.
TEST(Grid, lightsWhatStandsOnTheHighestSolid) {
  for (const float height : {0.3f, 1.0f, 3.35f}) {
    Level level;
    level.begin("ground");
    level.addRectangle({0, 0, 0}, {0, 0, 10}, {10, 0, 0});
    level.begin("stage");
    for (int k = 0; k < 3; ++k) {
      glm::vec3 u(0.0f), v(0.0f), n(0.0f);
      const glm::vec3 size(4, height, 4);
      u[k] = size[k], v[(k + 1) % 3] = size[(k + 1) % 3], n[(k + 2) % 3] = size[(k + 2) % 3];
      level.addRectangle({3, 0, 3}, v, u);
      level.addRectangle(glm::vec3(3, 0, 3) + n, u, v);
    }
    BakeOptions options = presetOptions(Preset::draft);
    options.surfels.count = 2048;
    for (const glm::uvec3& resolution : {glm::uvec3(0), glm::uvec3(9, 4, 9)}) {
      options.caches.gridResolution = resolution;
      Context context;
      const Result<Bake> made = bake(level.scene(), options, context);
      ASSERT_TRUE(made) << made.error().message;
      Result<Relighter> relighter = Relighter::create(*made, {});
      ASSERT_TRUE(relighter);
      LightSetup setup;
      setup.skyRadiance = glm::vec3(1.0f);
      ASSERT_TRUE(relightUntilConverged(*relighter, setup));
      for (const float above : {0.1f, 0.5f, 1.5f, 20.0f})
        EXPECT_NEAR(relighter->irradianceInGrid({5, height + above, 5}, {0, 1, 0}).g, std::numbers::pi_v<float>, 0.15f)
            << height << " m, " << above << " m above, " << resolution.x;
    }
  }
}

}  // namespace
}  // namespace relume
