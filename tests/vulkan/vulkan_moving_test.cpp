// SPDX-License-Identifier: MIT
// Moving parts in Vulkan, by the executor: the light of OpenGL and of the CPU, for all kinds of links, in frames in
// which parts move, appear and vanish; no bit of other frames changes; and a frame makes no object and takes no memory.
#include "formats/pack.h"
#include "relume/relighter.h"
#include "runtime/shared/bands.h"
#include "tests/long_tests.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/moving_frames.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/tracking_memory.h"
#include "tests/vulkan/vulkan_level.h"

#include <gtest/gtest.h>

#include <array>
#include <optional>

namespace relume {
namespace {

using test::kMiddle;
using test::relativeError;

class VulkanMoving : public test::VulkanTest {
 protected:
  void SetUp() override {
    VulkanTest::SetUp();
    if (IsSkipped()) return;
    Result<EglContext> context = EglContext::create();
    if (!context) GTEST_SKIP() << context.error().message;
    context_.emplace(std::move(*context));
  }
  void TearDown() override {
    context_.reset();
    VulkanTest::TearDown();
  }
  GpuDevice device(bool isSerial = true) const {
    GpuDevice made = gpuDeviceOf(host_->device());
    made.isSerial = made.isSerial && isSerial;
    return made;
  }

  std::optional<EglContext> context_;
};

RelightOptions movingOptions(std::uint32_t parts, std::uint32_t lag = 32) {
  RelightOptions options;
  options.movingParts = parts;
  options.movingLag = lag;
  return options;
}

Relighter relighterOf(const Bake& bake, RelightOptions options, BackendKind backend) {
  options.backend = backend;
  if (backend == BackendKind::gl) options.getProcAddress = EglContext::getProcAddress;
  Result<Relighter> made = Relighter::create(bake, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

// As Relighter::cacheCoefficients() has them.
std::vector<float> coefficientsOf(const test::Level& level, const Bake& bake, bool glossy = false) {
  const CacheBands bands{level.passes.lumaBands(), level.passes.chromaBands(), bake.links.kind == LinkKind::irradiance,
                         glossy};
  const std::array<int, 3> channels{bands.lumaBands, bands.chromaBands, bands.chromaBands};
  const std::array<const char*, 3> images{"light map Y", "light map Co", "light map Cg"};
  const std::size_t stride = bands.stride();
  std::vector<float> all(stride * bake.caches.count());
  // Channels begin on words of four.
  const std::vector<std::uint16_t> grid = level.read<std::uint16_t>("caches");
  std::size_t from = 0;
  for (std::size_t cache = 0; cache < bake.caches.firstMapCache(); ++cache) {
    float* to = &all[stride * cache];
    for (const int l : channels) {
      const auto count = static_cast<std::size_t>(l * l);
      for (std::size_t i = 0; i < count; ++i) *to++ = unpackHalf(grid[from + i]);
      from += (count + 3) / 4 * 4;
    }
  }
  const auto& map = bake.caches.lightmap.cache;
  std::size_t first = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::vector<std::uint16_t> texels = level.read<std::uint16_t>(images[k]);
    const int held = bands.onMap(channels[k]);
    for (std::size_t t = 0; t < map.size(); ++t) {
      if (map[t] == kNoCache) continue;
      for (std::size_t i = 0; i < static_cast<std::size_t>(held * held); ++i)
        all[stride * map[t] + first + i] = unpackHalf(texels[4 * (i / 4 * map.size() + t) + i % 4]);
    }
    first += static_cast<std::size_t>(channels[k] * channels[k]);
  }
  return all;
}

// Coefficients of three frames from darkness.
std::vector<float> litBy(test::Level& level, const Bake& bake, const LightSetup& setup, bool glossy = false) {
  level.passes.reset();
  for (int frame = 0; frame < 3; ++frame) level.relight(setup);
  return coefficientsOf(level, bake, glossy);
}
std::vector<float> litBy(Relighter& relighter, const LightSetup& setup) {
  relighter.reset();
  for (int frame = 0; frame < 3; ++frame) EXPECT_TRUE(relighter.relight(setup));
  return relighter.cacheCoefficients();
}

void expectClose(const std::vector<float>& expected, const std::vector<float>& found, int perCache) {
  ASSERT_EQ(expected.size(), found.size());
  EXPECT_LT(test::coefficientDifference(expected, found, perCache), 0.005);
  EXPECT_LT(relativeError(expected, found), 0.001);
}

// All kinds in long runs: drivers take seconds to compile for each. Others are GlMoving's, and below.
TEST_F(VulkanMoving, givesTheLightOfOpenGlAndOfTheCpu) {
  const MovingShapes shapes = test::someShapes();
  const std::vector<Light> lights = test::someLights();
  for (const LinkKind kind : kLinkKinds) {
    if (kind != LinkKind::oct6 && kind != LinkKind::irradiance && !test::longTests()) continue;
    const Bake bake = test::room(kind);
    const std::vector<glm::vec3> sky(bake.hierarchy.skyDirection.size(), glm::vec3(0.2f, 0.3f, 0.5f));
    const RelightOptions options = movingOptions(16);
    test::Level vulkan(*host_, bake, options, device()), plain(*host_, bake, {}, device());
    Relighter cpu = relighterOf(bake, options, BackendKind::cpu), gl = relighterOf(bake, options, BackendKind::gl);
    LightSetup open = test::setupOf(lights, sky);
    open.emissionScale = {0.5f, 1.0f, 2.0f};
    const std::vector<float> without = litBy(plain, bake, open);
    for (const auto& [name, parts] : test::someFrames()) {
      SCOPED_TRACE(std::string(linkKindName(kind)) + ", " + name);
      LightSetup setup = open;
      setup.movingShapes = &shapes;
      setup.movingParts = parts;
      const std::vector<float> found = litBy(vulkan, bake, setup);
      expectClose(litBy(cpu, setup), found, cpu.coefficientsPerCache());
      expectClose(litBy(gl, setup), found, cpu.coefficientsPerCache());
      if (name == "none" || name == "outside") {
        EXPECT_EQ(found, without);
      } else {
        EXPECT_GT(relativeError(without, found), 0.015);
      }
    }
  }
}

// Work groups as hardware has them, every kind of result, and as many parts as there may be: no loop is cut short.
TEST_F(VulkanMoving, takesPartInEveryKindOfResultByEveryCutOfGroups) {
  const MovingShapes shapes = test::someShapes();
  const std::vector<Light> lights = test::someLights();
  const Bake bake = test::makeSyntheticBake(
      {.surfels = 4096, .grid = {2, 2, 2}, .lightmapCaches = 40, .linksPerCache = 254, .kind = LinkKind::oct6});
  std::vector<MovingPart> parts;
  for (std::uint32_t i = 0; i < kMaxMovingParts; ++i) {
    const auto x = static_cast<float>(i % 16), z = static_cast<float>(i / 16);
    parts.push_back(
        test::at(i % 3, {0.6f + 0.72f * x, 0.6f + 0.7f * static_cast<float>(i % 5), 0.3f + 0.36f * z}, 0.35f, x));
  }
  for (const auto& [count, isSerial] : {std::pair{2u, false}, {kMaxMovingParts, true}, {kMaxMovingParts, false}}) {
    if (count == kMaxMovingParts && !isSerial && !test::longTests()) continue;
    SCOPED_TRACE(std::to_string(count) + (isSerial ? ", serial" : ", parallel"));
    RelightOptions options = movingOptions(count, 1);
    options.lumaBands = 3;
    options.chromaBands = 2;
    options.glossy = options.gridTexture = count == 2;
    LightSetup setup = test::setupOf(lights, {});
    setup.movingShapes = &shapes;
    setup.movingParts = std::span(parts).first(count);
    Relighter cpu = relighterOf(bake, options, BackendKind::cpu);
    test::Level vulkan(*host_, bake, options, device(isSerial));
    expectClose(litBy(cpu, setup), litBy(vulkan, bake, setup, options.glossy), cpu.coefficientsPerCache());
  }
}

// Parts move, another appears, and all vanish and come back, under lights that fade: caches have the turns that they
// have elsewhere.
TEST_F(VulkanMoving, takesTurnsAsOpenGlAndTheCpuDo) {
  const MovingShapes shapes = test::someShapes();
  const Bake bake = test::room(LinkKind::oct6);
  for (const std::uint32_t lag : {1u, 16u}) {
    const RelightOptions options = movingOptions(2, lag);
    test::Level vulkan(*host_, bake, options, device());
    Relighter cpu = relighterOf(bake, options, BackendKind::cpu), gl = relighterOf(bake, options, BackendKind::gl);
    std::vector<Light> lights = test::someLights();
    for (int frame = 0; frame < 10; ++frame) {
      SCOPED_TRACE("lag " + std::to_string(lag) + ", frame " + std::to_string(frame));
      const float way = 0.1f * static_cast<float>(frame);
      const std::array<MovingPart, 2> parts{test::at(0, kMiddle + glm::vec3(way, 0.0f, 0.0f)),
                                            test::at(2, {2.0f, 1.0f + way, 1.5f})};
      for (Light& each : lights) each.intensity *= 0.9f;
      LightSetup setup = test::setupOf(lights, {});
      setup.movingShapes = &shapes;
      setup.movingParts = std::span(parts).first(frame == 7 ? 0 : frame < 3 ? 1 : 2);
      vulkan.relight(setup);
      ASSERT_TRUE(cpu.relight(setup) && gl.relight(setup));
      const std::vector<float> found = coefficientsOf(vulkan, bake);
      EXPECT_LT(relativeError(cpu.cacheCoefficients(), found), frame == 0 ? 0.001 : 0.002);
      EXPECT_LT(relativeError(gl.cacheCoefficients(), found), frame == 0 ? 0.001 : 0.002);
    }
  }
}

// Shapes may be others, and a frame that was never run takes none of them along.
TEST_F(VulkanMoving, shapesMayChangeAndFramesMayBeLost) {
  const Bake bake = test::room(LinkKind::cone);
  const std::vector<Light> lights = test::someLights();
  const MovingPart part = test::at(0, kMiddle);
  test::Level level(*host_, bake, movingOptions(1), device());
  Relighter cpu = relighterOf(bake, movingOptions(1), BackendKind::cpu);
  LightSetup setup = test::setupOf(lights, {});
  const std::vector<float> open = litBy(level, bake, setup);
  setup.movingParts = {&part, 1};
  std::vector<std::vector<float>> found;
  for (const float radius : {0.4f, 0.8f, 0.4f}) {
    const test::Ball ball(radius, 24);
    const glm::vec3 grey(0.5f);
    const MovingMesh mesh{ball.position, ball.triangle, {&grey, 1}};
    const Result<MovingShapes> shapes = MovingShapes::create({&mesh, 1});
    ASSERT_TRUE(shapes);
    setup.movingShapes = &*shapes;
    ASSERT_TRUE(level.passes.frame(setup));  // lost: litBy() resets
    found.push_back(litBy(level, bake, setup));
    expectClose(litBy(cpu, setup), found.back(), cpu.coefficientsPerCache());
  }
  EXPECT_EQ(found[0], found[2]);
  EXPECT_GT(relativeError(found[0], found[1]), 0.01);
  setup.movingParts = {};
  EXPECT_EQ(litBy(level, bake, setup), open);
}

TEST_F(VulkanMoving, createsNoObjectAndTakesNoMemory) {
  const MovingShapes shapes = test::someShapes();
  const std::vector<Light> lights = test::someLights();
  const Bake bake = test::room(LinkKind::oct6);
  test::TrackingMemory memory;
  RelightOptions options = movingOptions(16);
  options.memory = &memory;
  test::Level level(*host_, bake, options, device());
  LightSetup setup = test::setupOf(lights, {});
  setup.movingShapes = &shapes;
  const auto frames = test::someFrames();
  const auto run = [&] {
    for (const auto& [name, parts] : frames) {
      setup.movingParts = parts;
      level.relight(setup);
    }
  };
  run();
  const int made = test::VulkanHost::objectsMade();
  const std::size_t requests = memory.requests();
  run();
  level.passes.reset();
  run();
  EXPECT_EQ(test::VulkanHost::objectsMade(), made);
  EXPECT_EQ(memory.requests(), requests);
}

}  // namespace
}  // namespace relume
