// SPDX-License-Identifier: MIT
// A frame in OpenGL creates no object and allocates nothing on the host once buffers have grown to what it needs.
#include "relume/relighter.h"
#include "tests/runtime/allocations.h"
#include "tests/runtime/counting_loader.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/hot_reload.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"

#include <epoxy/gl.h>

#include <limits>
#include <string>

namespace relume {
namespace {

class GlFrame : public test::GlTest {};

TEST_F(GlFrame, createsNoObjectAndAllocatesNothing) {
  const Bake bake = test::makeSyntheticBake({.surfels = 700, .lightmapCaches = 24, .linksPerCache = 32});
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.getProcAddress = test::countingLoader(0);
  Result<Relighter> made = Relighter::create(bake, options);
  ASSERT_TRUE(made) << made.error().message;
  EXPECT_GT(test::objectsMade(0), 20);
  const std::vector<Light> lights = test::someLights();
  const std::vector<glm::vec3> irradiance(bake.surfels.count(), glm::vec3(0.5f));
  const std::vector<glm::vec3> sky(bake.hierarchy.skyDirection.size(), glm::vec3(0.2f));
  LightSetup byLights, byHost;
  byLights.lights = lights;
  byLights.skyPatches = sky;
  byHost.surfelIrradiance = irradiance;
  const auto frames = [&] {
    for (int i = 0; i < 6; ++i) {
      EXPECT_TRUE(made->relight(byLights));
      EXPECT_TRUE(made->relight(byHost));
      made->gl()->bind();
    }
    glFinish();
  };
  frames();
  test::forgetCalls(0);
  const std::size_t before = test::allocations();
  frames();
  EXPECT_GT(test::calls(0), 0);
  EXPECT_EQ(test::objectsMade(0), 0);
  EXPECT_EQ(test::allocations(), before);
}

TEST_F(GlFrame, hotReloadHandsTheLightOver) {
  test::expectLightIsHandedOver(BackendKind::gl, EglContext::getProcAddress);
}

// The host's own compute shader lights the surfels as the runtime would: the same light comes out.
TEST_F(GlFrame, surfelsLitByTheHostsShader) {
  const Bake bake = test::makeSyntheticBake({.surfels = 700, .lightmapCaches = 24, .linksPerCache = 32});
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.getProcAddress = EglContext::getProcAddress;
  Result<Relighter> byLights = Relighter::create(bake, options), byShader = Relighter::create(bake, options);
  ASSERT_TRUE(byLights && byShader);
  Light sun;
  sun.kind = LightKind::directional;
  sun.direction = {0.6f, -0.8f, 0.0f};
  sun.intensity = {3.0f, 2.0f, 1.0f};
  LightSetup lit, onGpu;
  lit.lights = {&sun, 1};
  onGpu.surfelIrradianceOnGpu = true;

  const GlResolve& gl = *byShader->gl();
  const std::string source = "#version 430\n" + gl.surfelGlsl() + R"(
    layout(local_size_x = 64) in;
    uniform float scale;
    void main() {
      uint i = gl_GlobalInvocationID.x;
      if (i >= relumeSurfelSlots) return;
      bool inside = all(lessThan(abs(relumeSurfelPosition(i)), vec3(1e3))) && relumeSurfelRadius(i) > 0.0;
      vec3 e = vec3(3.0, 2.0, 1.0) * max(dot(relumeSurfelNormal(i), vec3(-0.6, 0.8, 0.0)), 0.0);
      relumeSetSurfelIrradiance(i, inside ? scale * e : vec3(1e9));
    })";
  const GLuint shader = glCreateShader(GL_COMPUTE_SHADER), program = glCreateProgram();
  const char* text = source.c_str();
  glShaderSource(shader, 1, &text, nullptr);
  glCompileShader(shader);
  glAttachShader(program, shader);
  glLinkProgram(program);
  GLint linked = GL_FALSE;
  glGetProgramiv(program, GL_LINK_STATUS, &linked);
  char log[2000] = "";
  glGetShaderInfoLog(shader, sizeof log, nullptr, log);
  ASSERT_EQ(linked, GL_TRUE) << log;
  const auto frame = [&](float scale) {
    glUseProgram(program);
    glUniform1f(glGetUniformLocation(program, "scale"), scale);
    gl.bindSurfels();
    glDispatchCompute((gl.surfelSlots() + 63) / 64, 1, 1);
    EXPECT_TRUE(byShader->relight(onGpu));
    EXPECT_TRUE(byLights->relight(lit));
  };
  for (int i = 0; i < 3; ++i) frame(1.0f);
  EXPECT_LT(test::coefficientDifference(byLights->cacheCoefficients(), byShader->cacheCoefficients(),
                                        byLights->coefficientsPerCache()),
            0.005);
  // What is not written again stays; what is not finite is no light.
  EXPECT_TRUE(byShader->relight(onGpu));
  EXPECT_TRUE(byLights->relight(lit));
  EXPECT_LT(test::coefficientDifference(byLights->cacheCoefficients(), byShader->cacheCoefficients(),
                                        byLights->coefficientsPerCache()),
            0.005);
  byShader->reset();
  frame(std::numeric_limits<float>::infinity());
  LightSetup dark;
  Result<Relighter> unlit = Relighter::create(bake, options);
  ASSERT_TRUE(unlit && unlit->relight(dark));
  EXPECT_EQ(byShader->nodeRadiosity(), unlit->nodeRadiosity());
  glDeleteProgram(program);
  glDeleteShader(shader);

  options.backend = BackendKind::cpu;
  Result<Relighter> cpu = Relighter::create(bake, options);
  ASSERT_TRUE(cpu);
  EXPECT_FALSE(cpu->relight(onGpu));
}

}  // namespace
}  // namespace relume
