// SPDX-License-Identifier: MIT
// Moving parts in OpenGL: the light of the CPU backend, for balls, capsules and boxes, none, one outside and many; no
// bit of other frames changes; and a frame makes no object and takes no memory.
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "relume/relume.h"
#include "tests/runtime/allocations.h"
#include "tests/runtime/ball.h"
#include "tests/runtime/c_handles.h"
#include "tests/runtime/c_lights.h"
#include "tests/runtime/counting_loader.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/moving_frames.h"
#include "tests/runtime/some_lights.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <memory_resource>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

using test::at;
using test::kMiddle;
using test::relativeError;
using test::room;
using test::setupOf;
using test::someFrames;
using test::someShapes;

class GlMoving : public test::GlTest {};

RelightOptions optionsOf(BackendKind backend, std::uint32_t parts) {
  RelightOptions options;
  options.backend = backend;
  options.movingParts = parts;
  if (backend == BackendKind::gl) options.getProcAddress = EglContext::getProcAddress;
  return options;
}

Relighter relighterOf(const Bake& bake, const RelightOptions& options) {
  Result<Relighter> made = Relighter::create(bake, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

// Coefficients of three frames from darkness.
std::vector<float> lit(Relighter& relighter, const LightSetup& setup) {
  relighter.reset();
  for (int frame = 0; frame < 3; ++frame) {
    const Status ok = relighter.relight(setup);
    EXPECT_TRUE(ok) << (ok ? "" : ok.error().message);
  }
  return relighter.cacheCoefficients();
}

TEST_F(GlMoving, givesTheLightOfTheCpu) {
  const MovingShapes shapes = someShapes();
  const std::vector<Light> lights = test::someLights();
  for (const LinkKind kind : kLinkKinds) {
    const Bake bake = room(kind);
    const std::vector<glm::vec3> sky(bake.hierarchy.skyDirection.size(), glm::vec3(0.2f, 0.3f, 0.5f));
    Relighter cpu = relighterOf(bake, optionsOf(BackendKind::cpu, 16)),
              gl = relighterOf(bake, optionsOf(BackendKind::gl, 16)),
              plain = relighterOf(bake, optionsOf(BackendKind::gl, 0));
    LightSetup open = setupOf(lights, sky);
    open.emissionScale = {0.5f, 1.0f, 2.0f};
    const std::vector<float> without = lit(plain, open);
    for (const auto& [name, parts] : someFrames()) {
      SCOPED_TRACE(std::string(linkKindName(kind)) + ", " + name);
      LightSetup setup = open;
      setup.movingShapes = &shapes;
      setup.movingParts = parts;
      const std::vector<float> expected = lit(cpu, setup), found = lit(gl, setup);
      EXPECT_LT(test::coefficientDifference(expected, found, cpu.coefficientsPerCache()), 0.005);
      EXPECT_LT(relativeError(expected, found), 0.001);
      if (name == "none" || name == "outside") {
        EXPECT_EQ(found, without);
      } else {
        EXPECT_GT(relativeError(without, found), 0.015);
      }
    }
  }
}

// Caches have the turns that they have on the CPU, with a part that moves under a light that fades.
TEST_F(GlMoving, takesTurnsAsTheCpuDoes) {
  const MovingShapes shapes = someShapes();
  const Bake bake = room(LinkKind::oct6);
  for (const std::uint32_t lag : {1u, 16u}) {
    SCOPED_TRACE(lag);
    std::vector<float> found[2], first[2];
    for (const BackendKind backend : {BackendKind::cpu, BackendKind::gl}) {
      RelightOptions options = optionsOf(backend, 1);
      options.movingLag = lag;
      Relighter relighter = relighterOf(bake, options);
      const auto i = static_cast<std::size_t>(backend == BackendKind::gl);
      std::vector<Light> lights = test::someLights();
      for (int frame = 0; frame < 7; ++frame) {
        const MovingPart part = at(0, kMiddle + glm::vec3(0.1f * static_cast<float>(frame), 0.0f, 0.0f));
        for (Light& each : lights) each.intensity *= 0.9f;
        LightSetup setup = setupOf(lights, {});
        setup.movingShapes = &shapes;
        setup.movingParts = {&part, 1};
        ASSERT_TRUE(relighter.relight(setup));
        if (frame == 0) first[i] = relighter.cacheCoefficients();
      }
      found[i] = relighter.cacheCoefficients();
    }
    EXPECT_LT(relativeError(first[0], first[1]), 0.001);
    EXPECT_LT(relativeError(found[0], found[1]), 0.002);
  }
}

// As many parts as there may be, and as many as a software driver's threads get more links for: no loop is cut short.
TEST_F(GlMoving, manyPartsAreAllLookedAt) {
  const MovingShapes shapes = someShapes();
  const std::vector<Light> lights = test::someLights();
  const Bake bake = test::makeSyntheticBake(
      {.surfels = 4096, .grid = {2, 2, 2}, .lightmapCaches = 40, .linksPerCache = 254, .kind = LinkKind::oct6});
  for (const std::uint32_t count : {16u, kMaxMovingParts}) {
    SCOPED_TRACE(count);
    std::vector<MovingPart> parts;
    for (std::uint32_t i = 0; i < count; ++i) {
      const auto x = static_cast<float>(i % 16), z = static_cast<float>(i / 16);
      parts.push_back(
          at(i % 3, {0.6f + 0.72f * x, 0.6f + 0.7f * static_cast<float>(i % 5), 0.3f + 0.36f * z}, 0.35f, x));
    }
    LightSetup setup = setupOf(lights, {});
    setup.movingShapes = &shapes;
    setup.movingParts = parts;
    // In every frame: which of two senders alike is hidden most, and scales what is kept, is a matter of rounding.
    RelightOptions options[2] = {optionsOf(BackendKind::cpu, count), optionsOf(BackendKind::gl, count)};
    options[0].movingLag = options[1].movingLag = 1;
    Relighter cpu = relighterOf(bake, options[0]), gl = relighterOf(bake, options[1]);
    const std::vector<float> expected = lit(cpu, setup), found = lit(gl, setup);
    EXPECT_LT(test::coefficientDifference(expected, found, cpu.coefficientsPerCache()), 0.005);
    EXPECT_LT(relativeError(expected, found), 0.001);
  }
}

// All bands, one band, the grid's texture, and the map that glossy receivers read.
TEST_F(GlMoving, takesPartInEveryKindOfResult) {
  const MovingShapes shapes = someShapes();
  const std::vector<Light> lights = test::someLights();
  const Bake bake = room(LinkKind::oct6);
  const std::vector<MovingPart> parts{at(0, kMiddle), at(2, {2.0f, 1.0f, 1.5f})};
  for (const auto& [luma, chroma] : {std::pair{1, 1}, {3, 2}}) {
    SCOPED_TRACE(luma);
    std::vector<float> light[2];
    glm::vec3 read[2];
    for (const BackendKind backend : {BackendKind::cpu, BackendKind::gl}) {
      RelightOptions options = optionsOf(backend, 2);
      options.lumaBands = luma;
      options.chromaBands = chroma;
      options.gridTexture = options.glossy = true;
      Relighter relighter = relighterOf(bake, options);
      LightSetup setup = setupOf(lights, {});
      setup.movingShapes = &shapes;
      setup.movingParts = parts;
      const auto i = static_cast<std::size_t>(backend == BackendKind::gl);
      light[i] = lit(relighter, setup);
      read[i] = relighter.irradianceInGrid({6.0f, 3.5f, 3.0f}, {0.0f, -1.0f, 0.0f}, GridLookup::texture);
    }
    EXPECT_LT(test::coefficientDifference(light[0], light[1], luma * luma + 2 * chroma * chroma), 0.005);
    EXPECT_LT(glm::length(read[1] - read[0]), 0.005f * glm::length(read[0]));
  }
}

// The host's shadows fall on parts, by the uniforms of a program of their own.
TEST_F(GlMoving, standInTheHostsShadows) {
  const MovingShapes shapes = someShapes();
  const Bake bake = room(LinkKind::oct6);
  const MovingPart part = at(0, kMiddle);
  const Light lamp{.intensity = glm::vec3(50.0f), .positionWorld = {6.0f, 3.9f, 3.0f}};
  const std::vector<glm::vec3> darkness(bake.surfels.count(), glm::vec3(0.0f));
  LightSetup setup;
  setup.lights = {&lamp, 1};
  setup.surfelIrradiance = setup.surfelEmission = darkness;  // surfaces send nothing
  setup.movingShapes = &shapes;
  setup.movingParts = {&part, 1};
  RelightOptions options = optionsOf(BackendKind::gl, 1);
  options.visibilityGlsl = "uniform float open; float relumeVisibility(uint light, vec3 p, vec3 n) { return open; }";
  Relighter relighter = relighterOf(bake, options);
  const std::uint32_t program = relighter.gl()->movingProgram();
  ASSERT_NE(program, 0u);
  const auto seen = [&](float open) {
    glProgramUniform1f(program, glGetUniformLocation(program, "open"), open);
    lit(relighter, setup);
    return relighter.irradianceInGrid({6.0f, 3.7f, 3.0f}, {0.0f, -1.0f, 0.0f}).r;
  };
  const float all = seen(1.0f);
  EXPECT_GT(all, 0.05f);
  EXPECT_NEAR(seen(0.5f), 0.5f * all, 0.02f * all);
  EXPECT_EQ(seen(0.0f), 0.0f);
  EXPECT_EQ(relighterOf(bake, optionsOf(BackendKind::gl, 0)).gl()->movingProgram(), 0u);
}

// A part that emits is dark where emitters are off, and as bright as on the CPU where they are not.
TEST_F(GlMoving, shineByTheEmissionScale) {
  const MovingShapes shapes = someShapes();
  const Bake bake = room(LinkKind::oct6);
  const MovingPart box = at(2, kMiddle);
  const std::vector<glm::vec3> darkness(bake.surfels.count(), glm::vec3(0.0f));
  LightSetup setup;
  setup.surfelEmission = darkness;
  setup.movingShapes = &shapes;
  setup.movingParts = {&box, 1};
  Relighter cpu = relighterOf(bake, optionsOf(BackendKind::cpu, 1)),
            gl = relighterOf(bake, optionsOf(BackendKind::gl, 1));
  setup.emissionScale = {1.0f, 3.0f, 0.5f};
  const std::vector<float> expected = lit(cpu, setup), found = lit(gl, setup);
  EXPECT_LT(test::coefficientDifference(expected, found, cpu.coefficientsPerCache()), 0.005);
  EXPECT_LT(relativeError(expected, found), 0.001);
  setup.emissionScale = glm::vec3(0.0f);
  const std::vector<float> dark(expected.size(), 0.0f);
  EXPECT_NE(expected, dark);
  EXPECT_EQ(lit(cpu, setup), dark);
  EXPECT_EQ(lit(gl, setup), dark);
}

// Other shapes at the place in memory where some were before are other shapes, and parts leave no traces.
TEST_F(GlMoving, shapesMayChangeAndPartsLeave) {
  const Bake bake = room(LinkKind::cone);
  const std::vector<Light> lights = test::someLights();
  const MovingPart part = at(0, kMiddle);
  Relighter relighter = relighterOf(bake, optionsOf(BackendKind::gl, 1));
  LightSetup setup = setupOf(lights, {});
  const std::vector<float> open = lit(relighter, setup);
  std::optional<MovingShapes> shapes;
  std::vector<std::vector<float>> found;
  for (const float radius : {0.4f, 0.8f, 0.4f}) {
    const test::Ball ball(radius, 24);
    const glm::vec3 grey(0.5f);
    const MovingMesh mesh{ball.position, ball.triangle, {&grey, 1}};
    Result<MovingShapes> made = MovingShapes::create({&mesh, 1});
    ASSERT_TRUE(made);
    shapes.emplace(std::move(*made));
    setup.movingShapes = &*shapes;
    setup.movingParts = {&part, 1};
    found.push_back(lit(relighter, setup));
  }
  EXPECT_EQ(found[0], found[2]);
  EXPECT_GT(relativeError(found[0], found[1]), 0.01);
  setup.movingParts = {};
  EXPECT_EQ(lit(relighter, setup), open);
}

TEST_F(GlMoving, createsNoObjectAndAllocatesNothing) {
  const MovingShapes shapes = someShapes();
  const std::vector<Light> lights = test::someLights();
  for (const LinkKind kind : kLinkKinds) {
    SCOPED_TRACE(linkKindName(kind));
    const Bake bake = room(kind);
    RelightOptions options = optionsOf(BackendKind::gl, 16);
    options.getProcAddress = test::countingLoader(0);
    Relighter relighter = relighterOf(bake, options);
    const auto frames = someFrames();
    LightSetup setup = setupOf(lights, {});
    setup.movingShapes = &shapes;
    const auto run = [&] {
      for (const auto& [name, parts] : frames) {
        setup.movingParts = parts;
        EXPECT_TRUE(relighter.relight(setup));
      }
      glFinish();
    };
    run();
    test::forgetCalls(0);
    const std::size_t before = test::allocations();
    run();
    EXPECT_GT(test::calls(0), 0);
    EXPECT_EQ(test::objectsMade(0), 0);
    EXPECT_EQ(test::allocations(), before);
  }
}

// Through relume.h: the same light, and the program for uniforms.
TEST_F(GlMoving, servesTheCApi) {
  Bake bake = room(LinkKind::oct6);
  bake.instances = std::vector<BakedInstance>{{"room", {}, {}}};
  bake.caches.lightmap.parts = std::vector<LightmapPart>(1);
  const Result<std::vector<std::byte>> bytes = serializeBake(bake);
  ASSERT_TRUE(bytes) << bytes.error().message;
  test::Handles h;
  relume_context_desc describe{};
  describe.struct_size = sizeof describe;
  describe.api_version = RELUME_API_VERSION;
  ASSERT_EQ(relume_context_create(&describe, &h.context), RELUME_OK);
  ASSERT_EQ(relume_bake_from_memory(h.context, bytes->data(), bytes->size(), nullptr, nullptr, &h.bake), RELUME_OK);
  relume_relighter_desc desc{};
  desc.struct_size = sizeof desc;
  desc.backend = RELUME_BACKEND_GL;
  desc.get_proc_address = [](void*, const char* name) { return EglContext::getProcAddress(name); };
  desc.moving_parts = 1;
  ASSERT_EQ(relume_relighter_create(h.bake, &desc, &h.relighter), RELUME_OK) << relume_bake_error(h.bake);
  EXPECT_NE(relume_gl_moving_program(h.relighter), 0u);

  const test::Ball ball(0.6f, 24);
  const float grey[3] = {0.5f, 0.5f, 0.5f};
  const relume_moving_mesh mesh = {
      &ball.position[0].x, ball.position.size(), &ball.triangle[0].x, ball.triangle.size(), grey, 1, nullptr, 0};
  relume_moving_shapes* shapes = nullptr;
  ASSERT_EQ(relume_moving_shapes_create(h.context, &mesh, 1, &shapes), RELUME_OK);
  const relume_moving_part part = {0, {1, 0, 0, 0, 1, 0, 0, 0, 1, kMiddle.x, kMiddle.y, kMiddle.z}};
  const std::vector<Light> lights = test::someLights();
  const std::vector<relume_light> cLights = test::cLights(lights);
  relume_light_setup setup;
  relume_light_setup_default(&setup, sizeof setup);
  setup.lights = cLights.data();
  setup.light_count = cLights.size();
  setup.moving_parts = &part;
  setup.moving_part_count = 1;
  setup.moving_shapes = shapes;
  for (int frame = 0; frame < 3; ++frame)
    ASSERT_EQ(relume_relight(h.relighter, &setup), RELUME_OK) << relume_relighter_error(h.relighter);
  std::vector<float> found(relume_coefficients_per_cache(h.relighter) * bake.caches.count());
  ASSERT_EQ(relume_cache_coefficients(h.relighter, found.data(), found.size() * sizeof(float)), RELUME_OK);

  Relighter same = relighterOf(bake, optionsOf(BackendKind::gl, 1));
  const glm::vec3 albedo(0.5f);
  const MovingMesh cppMesh{ball.position, ball.triangle, {&albedo, 1}};
  const Result<MovingShapes> cppShapes = MovingShapes::create({&cppMesh, 1});
  ASSERT_TRUE(cppShapes);
  const MovingPart cppPart = at(0, kMiddle);
  LightSetup cppSetup = setupOf(lights, {});
  cppSetup.movingShapes = &*cppShapes;
  cppSetup.movingParts = {&cppPart, 1};
  EXPECT_EQ(lit(same, cppSetup), found);
  relume_moving_shapes_destroy(shapes);
}

TEST_F(GlMoving, refusesWhatTheCpuRefuses) {
  const Bake bake = room(LinkKind::oct6);
  const MovingShapes shapes = someShapes();
  Relighter relighter = relighterOf(bake, optionsOf(BackendKind::gl, 2));
  LightSetup setup;
  setup.movingShapes = &shapes;
  std::vector<MovingPart> parts(3);
  setup.movingParts = parts;
  EXPECT_FALSE(relighter.relight(setup));
  parts.resize(1);
  setup.movingParts = parts;
  EXPECT_TRUE(relighter.relight(setup));
  parts[0].toWorld[1].y = std::nanf("");
  EXPECT_FALSE(relighter.relight(setup));
  parts[0] = {.shape = 3};
  EXPECT_FALSE(relighter.relight(setup));
  bool named = false;
  for (const PassTime& each : relighter.passTimes()) named = named || std::string(each.pass) == "moving parts";
  EXPECT_TRUE(named);
}

}  // namespace
}  // namespace relume
