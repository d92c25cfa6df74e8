// SPDX-License-Identifier: MIT
// The OpenGL backend as a guest of its host: the host's visibility function and its blocks, several relighters in one
// context, bakes with parts missing, timing without waiting, and every binding as the host left it.
#include "relume/relighter.h"

#include "tests/runtime/furnace_bake.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>

#include <bit>
#include <numbers>
#include <string>
#include <vector>

namespace relume {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

using test::makeRelighter, test::manySurfels;

class GlHost : public test::GlTest {};

TEST_F(GlHost, hostsVisibilityIsCompiledInAndItsUniformsReachable) {
  const Bake bake = test::makeFurnaceBake(0.5f, 0.0f, 3);
  Relighter gl =
      makeRelighter(bake, BackendKind::gl, 0, 0,
                    "uniform float hostShadow;\n"
                    "float relumeVisibility(uint light, vec3 p, vec3 n) { return light == 1u ? hostShadow : 0.0; }\n");
  std::vector<Light> lights(2);
  for (Light& light : lights) light = {.kind = LightKind::directional, .direction = {-1, 0, 0}};
  LightSetup setup;
  setup.lights = lights;
  glProgramUniform1f(gl.gl()->surfelProgram(), glGetUniformLocation(gl.gl()->surfelProgram(), "hostShadow"), 0.25f);
  EXPECT_TRUE(gl.relight(setup));
  EXPECT_NEAR(gl.nodeRadiosity()[5].r, 0.5f * 0.25f, 1e-3f);
}

// What relume/lights.h says of a host's function on the CPU.
TEST_F(GlHost, visibilityOutOfItsRangeCountsAsOnTheCpu) {
  const Bake bake = test::makeFurnaceBake(0.5f, 0.0f, 3);
  const std::vector<std::uint32_t> bits{0x7FC00000u, 0xFFC00000u, 0xBF800000u, 0xFF800000u,
                                        0x40400000u, 0x7F800000u, 0x3E800000u};  // NaN, -NaN, -1, -inf, 3, inf, 1/4
  std::string glsl = "float relumeVisibility(uint light, vec3 p, vec3 n) {\n";
  for (std::size_t i = 0; i < bits.size(); ++i)
    glsl += "  if (light == " + std::to_string(i) + "u) return uintBitsToFloat(" + std::to_string(bits[i]) + "u);\n";
  glsl += "  return 0.0;\n}\n";
  Relighter gl = makeRelighter(bake, BackendKind::gl, 0, 0, glsl), cpu = makeRelighter(bake, BackendKind::cpu);
  std::vector<Light> lights(bits.size());
  for (Light& light : lights) light = {.kind = LightKind::directional, .direction = {-1, 0, 0}};
  LightSetup setup;
  setup.lights = lights;
  setup.visibility = [&](std::uint32_t light, const glm::vec3&, const glm::vec3&) {
    return std::bit_cast<float>(bits[light]);
  };
  for (int frame = 0; frame < 2; ++frame) ASSERT_TRUE(gl.relight(setup) && cpu.relight(setup));
  EXPECT_NEAR(cpu.nodeRadiosity()[5].r, 0.5f * 2.25f, 1e-2f);
  const std::vector<glm::vec3> expected = cpu.nodeRadiosity(), found = gl.nodeRadiosity();
  for (std::size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(found[i].r, expected[i].r, 1e-2f) << i;
}

TEST_F(GlHost, visibilityThatDoesNotCompileGivesItsLog) {
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.getProcAddress = EglContext::getProcAddress;
  options.visibilityGlsl = "\n\nfloat relumeVisibility(uint light, vec3 p, vec3 n) { return noSuchThing; }\n";
  const Result<Relighter> made = Relighter::create(test::makeFurnaceBake(0.5f, 0.0f, 3), options);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::failed);
  EXPECT_NE(made.error().message.find("noSuchThing"), std::string::npos) << made.error().message;
  // By lines of its own: the third one of string 1, as drivers write it.
  EXPECT_NE(made.error().message.find("string 1 of its source is visibilityGlsl"), std::string::npos);
  EXPECT_TRUE(made.error().message.find("1:3") != std::string::npos ||
              made.error().message.find("1(3)") != std::string::npos)
      << made.error().message;
  context_->forgetErrors();  // Mesa's complaint
}

// Visibility that is the first number of a block which is declared so.
std::string readingABlock(const std::string& block) {
  return block + " HostShadow { vec4 hostValue; };\n" +
         "float relumeVisibility(uint light, vec3 p, vec3 n) { return hostValue.x; }\n";
}

TEST_F(GlHost, visibilityReadsBlocksOfTheHosts) {
  const Bake bake = test::makeFurnaceBake(0.5f, 0.0f, 3);
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  glBindBuffer(GL_UNIFORM_BUFFER, buffer);
  const std::vector<float> quarters(4, 0.25f);
  glBufferData(GL_UNIFORM_BUFFER, 16, quarters.data(), GL_STATIC_DRAW);
  GLint most = 0;
  glGetIntegerv(GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS, &most);
  for (const GLuint slot : {0u, 6u, 8u}) {
    if (slot == 8 && most < 9) continue;
    glBindBufferBase(slot == 8 ? GL_SHADER_STORAGE_BUFFER : GL_UNIFORM_BUFFER, slot, buffer);
    const std::string at = "layout(binding = " + std::to_string(slot);
    Relighter gl =
        makeRelighter(bake, BackendKind::gl, 0, 0,
                      readingABlock(slot == 8 ? at + ", std430) readonly buffer" : at + ", std140) uniform"));
    const Light sun{.kind = LightKind::directional, .direction = {-1, 0, 0}};
    LightSetup setup;
    setup.lights = {&sun, 1};
    EXPECT_TRUE(gl.relight(setup));
    EXPECT_NEAR(gl.nodeRadiosity()[5].r, 0.5f * 0.25f, 1e-3f) << slot;
  }
  glBindBuffer(GL_UNIFORM_BUFFER, 0);
  glDeleteBuffers(1, &buffer);
}

TEST_F(GlHost, blocksOfTheHostsAtBindingsOfRelumesAreRefused) {
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.getProcAddress = EglContext::getProcAddress;
  const std::vector<std::pair<std::string, std::string>> blocks = {
      {"layout(binding = 7, std140) uniform", "uniform block HostShadow has binding 7"},
      {"layout(binding = 0, std430) readonly buffer", "storage block HostShadow has binding 0"},
      {"layout(binding = 7, std430) readonly buffer", "storage block HostShadow has binding 7"}};
  GLint most = 0;
  glGetIntegerv(GL_MAX_COMPUTE_SHADER_STORAGE_BLOCKS, &most);
  for (const auto& [block, message] : blocks) {
    // A driver may have no more storage blocks than the pass has itself: that is a link error.
    if (most < 9 && block.find("buffer") != std::string::npos) continue;
    options.visibilityGlsl = readingABlock(block);
    const Result<Relighter> made = Relighter::create(test::makeFurnaceBake(0.5f, 0.0f, 3), options);
    ASSERT_FALSE(made) << block;
    EXPECT_EQ(made.error().code, ErrorCode::usage);
    EXPECT_NE(made.error().message.find(message), std::string::npos) << made.error().message;
    EXPECT_NE(made.error().message.find("light_surfels.comp"), std::string::npos) << made.error().message;
  }
}

TEST_F(GlHost, twoRelightersShareABakeAndAContext) {
  const Bake bake = test::makeFurnaceBake(0.5f, 1.0f, 4);
  Relighter one = makeRelighter(bake, BackendKind::gl), two = makeRelighter(bake, BackendKind::gl, 2, 1);
  LightSetup dark;
  dark.emissionScale = glm::vec3(0.0f);
  EXPECT_TRUE(one.relight({}));
  EXPECT_TRUE(two.relight(dark));
  EXPECT_NEAR(one.nodeRadiosity()[0].g, kPi, 1e-3f);
  EXPECT_EQ(two.nodeRadiosity()[0], glm::vec3(0.0f));
}

TEST_F(GlHost, bakesWithoutLightmapGridOrLinksAreLit) {
  Bake bake = test::makeSyntheticBake({.surfels = 100, .grid = {0, 0, 0}, .lightmapSize = 8, .lightmapCaches = 0});
  Relighter none = makeRelighter(bake, BackendKind::gl);
  EXPECT_TRUE(none.relight({}));
  EXPECT_TRUE(none.cacheCoefficients().empty());
  EXPECT_EQ(none.irradianceInGrid({0, 0, 0}, {0, 0, 1}), glm::vec3(0.0f));
  bake.caches = Caches{};
  bake.surfels.receiver = std::vector<std::uint32_t>(100, kGridReceiver);
  Relighter empty = makeRelighter(bake, BackendKind::gl);
  EXPECT_TRUE(empty.relight({}));
  EXPECT_TRUE(empty.relight({}));
}

TEST_F(GlHost, timesEachPassWithoutWaiting) {
  Relighter gl = makeRelighter(test::makeSyntheticBake(manySurfels(LinkKind::cone, 4)), BackendKind::gl);
  for (int frame = 0; frame < 6; ++frame) EXPECT_TRUE(gl.relight({}));
  glFinish();
  const std::vector<PassTime> times = gl.passTimes();
  ASSERT_EQ(times.size(), 3u);
  EXPECT_STREQ(times[2].pass, "caches");
  EXPECT_GT(times[2].ms, 0.0);
}

TEST_F(GlHost, timesArriveBesideAQueryBufferOfTheHosts) {
  Relighter gl = makeRelighter(test::makeSyntheticBake(manySurfels(LinkKind::cone, 4)), BackendKind::gl);
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  glBindBuffer(GL_QUERY_BUFFER, buffer);
  glBufferData(GL_QUERY_BUFFER, 64, nullptr, GL_STATIC_DRAW);
  for (int frame = 0; frame < 6; ++frame) {
    EXPECT_TRUE(gl.relight({}));
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR)) << frame;
  }
  glFinish();
  EXPECT_GT(gl.passTimes()[2].ms, 0.0);
  GLint bound = 0;
  glGetIntegerv(GL_QUERY_BUFFER_BINDING, &bound);
  EXPECT_EQ(static_cast<GLuint>(bound), buffer);
  glDeleteBuffers(1, &buffer);
}

// A program that is deleted while it is in use lives until another is used, and cannot be used again.
TEST_F(GlHost, programsDeletedInUseLeaveNoneInUse) {
  Relighter gl = makeRelighter(test::makeFurnaceBake(0.5f, 0.0f, 3), BackendKind::gl);
  const GLuint program = glCreateProgram();
  ASSERT_TRUE(test::linkCompute(program, "#version 430 core\nlayout(local_size_x = 1) in; void main() {}\n"));
  glUseProgram(program);
  glDeleteProgram(program);
  EXPECT_TRUE(gl.relight({}));
  GLint used = -1;
  glGetIntegerv(GL_CURRENT_PROGRAM, &used);
  EXPECT_EQ(used, 0);
}

// What another context of the same share group has deleted stays bound in this one, and cannot be bound again.
TEST_F(GlHost, objectsDeletedElsewhereLeaveNothingBound) {
  Relighter gl = makeRelighter(test::makeFurnaceBake(0.5f, 0.0f, 3), BackendKind::gl);
  GLuint texture = 0, sampler = 0, buffer = 0;
  glGenTextures(1, &texture);
  glActiveTexture(GL_TEXTURE12);
  glBindTexture(GL_TEXTURE_2D, texture);
  glTexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA16F, 4, 4);
  glBindImageTexture(0, texture, 0, GL_FALSE, 0, GL_READ_ONLY, GL_RGBA16F);
  glGenSamplers(1, &sampler);
  glBindSampler(12, sampler);
  glGenBuffers(1, &buffer);
  glBindBuffer(GL_COPY_READ_BUFFER, buffer);
  glBufferData(GL_COPY_READ_BUFFER, 64, nullptr, GL_STATIC_DRAW);
  glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 3, buffer);
  glBindBufferRange(GL_UNIFORM_BUFFER, 7, buffer, 0, 16);

  const EGLDisplay display = eglGetCurrentDisplay();
  const EGLint version[] = {EGL_CONTEXT_MAJOR_VERSION, 4, EGL_CONTEXT_MINOR_VERSION, 3, EGL_NONE};
  const EGLContext other = eglCreateContext(display, EGL_NO_CONFIG_KHR, eglGetCurrentContext(), version);
  ASSERT_NE(other, EGL_NO_CONTEXT);
  ASSERT_TRUE(eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, other));
  glDeleteTextures(1, &texture);
  glDeleteSamplers(1, &sampler);
  glDeleteBuffers(1, &buffer);
  ASSERT_TRUE(context_->makeCurrent());
  eglDestroyContext(display, other);

  const auto bound = [](GLenum what) {
    GLint value = 0;
    glGetIntegerv(what, &value);
    return static_cast<GLuint>(value);
  };
  const auto boundAt = [](GLenum what, GLuint slot) {
    GLint value = 0;
    glGetIntegeri_v(what, slot, &value);
    return static_cast<GLuint>(value);
  };
  if (bound(GL_TEXTURE_BINDING_2D) != texture) GTEST_SKIP() << "this driver unbinds what another context deletes";
  EXPECT_TRUE(gl.relight({}));
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
  for (const GLenum what : {GL_TEXTURE_BINDING_2D, GL_SAMPLER_BINDING, GL_COPY_READ_BUFFER_BINDING,
                            GL_SHADER_STORAGE_BUFFER_BINDING, GL_UNIFORM_BUFFER_BINDING})
    EXPECT_EQ(bound(what), 0u) << what;
  EXPECT_EQ(boundAt(GL_IMAGE_BINDING_NAME, 0), 0u);
  EXPECT_EQ(boundAt(GL_SHADER_STORAGE_BUFFER_BINDING, 3), 0u);
  EXPECT_EQ(boundAt(GL_UNIFORM_BUFFER_BINDING, 7), 0u);
}

// Hosts that keep track of their own state are not told of other changes than those they asked for.
TEST_F(GlHost, bindsNothingButWhatItSays) {
  Relighter gl = makeRelighter(test::makeSyntheticBake(manySurfels(LinkKind::oct6, 4)), BackendKind::gl);
  GLuint buffer = 0;
  glGenBuffers(1, &buffer);
  glBindBuffer(GL_COPY_WRITE_BUFFER, buffer);
  glActiveTexture(GL_TEXTURE0 + 3);
  const auto expectUnchanged = [&](const char* after) {
    GLint active = 0, bound = 0;
    glGetIntegerv(GL_ACTIVE_TEXTURE, &active);
    glGetIntegerv(GL_COPY_WRITE_BUFFER_BINDING, &bound);
    EXPECT_EQ(active, GL_TEXTURE0 + 3) << after;
    EXPECT_EQ(static_cast<GLuint>(bound), buffer) << after;
  };
  for (int i = 0; i < 2; ++i) {
    gl.gl()->bindSurfels();
    expectUnchanged("bindSurfels()");
    gl.gl()->bind();
    expectUnchanged("bind()");
  }
  GLint slot = 0;
  glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, 1, &slot);
  EXPECT_NE(slot, 0);
  glDeleteBuffers(1, &buffer);
}

// What SavedState promises, set to something odd and read back.
TEST_F(GlHost, bindingsOfTheHostAreAsTheyWere) {
  GLuint buffers[9], textures[2], sampler = 0;
  glGenBuffers(9, buffers);
  glGenTextures(2, textures);
  glGenSamplers(1, &sampler);
  const auto bind = [&] {
    for (GLuint i = 0; i < 7; ++i) {
      glBindBuffer(GL_SHADER_STORAGE_BUFFER, buffers[i]);
      glBufferData(GL_SHADER_STORAGE_BUFFER, 4096, nullptr, GL_STATIC_DRAW);
      glBindBufferRange(GL_SHADER_STORAGE_BUFFER, i, buffers[i], 256, 512);
    }
    glBindBuffer(GL_UNIFORM_BUFFER, buffers[7]);
    glBufferData(GL_UNIFORM_BUFFER, 4096, nullptr, GL_STATIC_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, 7, buffers[7]);
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, buffers[8]);
    glBindBuffer(GL_COPY_READ_BUFFER, buffers[1]);
    glBindBuffer(GL_COPY_WRITE_BUFFER, buffers[2]);
    glActiveTexture(GL_TEXTURE0 + 13);
    glBindTexture(GL_TEXTURE_2D_ARRAY, textures[0]);
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA16F, 4, 4, 2);
    glBindSampler(13, sampler);
    glActiveTexture(GL_TEXTURE0 + 15);
    glBindTexture(GL_TEXTURE_2D, textures[1]);
    glBindImageTexture(1, textures[0], 0, GL_FALSE, 1, GL_READ_ONLY, GL_RGBA16F);
    glActiveTexture(GL_TEXTURE0 + 3);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 77);
    glPixelStorei(GL_PACK_ALIGNMENT, 2);
    glPixelStorei(GL_PACK_ROW_LENGTH, 33);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, buffers[3]);
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, buffers[4]);
  };
  bind();
  const auto snapshot = [] {
    std::vector<GLint64> state;
    GLint value = 0;
    GLint64 wide = 0;
    for (const GLenum what :
         {GL_CURRENT_PROGRAM, GL_SHADER_STORAGE_BUFFER_BINDING, GL_UNIFORM_BUFFER_BINDING, GL_COPY_READ_BUFFER_BINDING,
          GL_COPY_WRITE_BUFFER_BINDING, GL_ACTIVE_TEXTURE, GL_UNPACK_ALIGNMENT, GL_UNPACK_ROW_LENGTH,
          GL_PIXEL_UNPACK_BUFFER_BINDING, GL_PACK_ALIGNMENT, GL_PACK_ROW_LENGTH, GL_PIXEL_PACK_BUFFER_BINDING}) {
      glGetIntegerv(what, &value);
      state.push_back(value);
    }
    for (GLuint i = 0; i < 8; ++i) {
      glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, i, &value);
      state.push_back(value);
      for (const GLenum what : {GL_SHADER_STORAGE_BUFFER_START, GL_SHADER_STORAGE_BUFFER_SIZE}) {
        glGetInteger64i_v(what, i, &wide);
        state.push_back(wide);
      }
      glGetIntegeri_v(GL_UNIFORM_BUFFER_BINDING, i, &value);
      state.push_back(value);
      for (const GLenum what :
           {GL_IMAGE_BINDING_NAME, GL_IMAGE_BINDING_LAYERED, GL_IMAGE_BINDING_LAYER, GL_IMAGE_BINDING_ACCESS}) {
        glGetIntegeri_v(what, i, &value);
        state.push_back(value);
      }
    }
    for (GLenum unit = 0; unit < 16; ++unit) {
      glActiveTexture(GL_TEXTURE0 + unit);
      for (const GLenum what : {GL_TEXTURE_BINDING_2D, GL_TEXTURE_BINDING_2D_ARRAY, GL_SAMPLER_BINDING}) {
        glGetIntegerv(what, &value);
        state.push_back(value);
      }
    }
    glActiveTexture(static_cast<GLenum>(state[5]));
    return state;
  };
  const std::vector<GLint64> before = snapshot();
  Relighter gl = makeRelighter(test::makeSyntheticBake(manySurfels(LinkKind::sh, 4)), BackendKind::gl);
  EXPECT_EQ(snapshot(), before) << "create()";
  const std::vector<Light> lights = test::someLights();
  LightSetup setup;
  setup.lights = lights;
  EXPECT_TRUE(gl.relight(setup));
  EXPECT_TRUE(gl.relight(setup));
  EXPECT_EQ(snapshot(), before) << "relight()";
  gl.reset();
  EXPECT_FALSE(gl.cacheCoefficients().empty());
  EXPECT_FALSE(gl.nodeRadiosity().empty());
  EXPECT_FALSE(gl.passTimes().empty());
  EXPECT_EQ(snapshot(), before) << "readers";
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
  for (const GLenum what : {GL_UNPACK_ROW_LENGTH, GL_PACK_ROW_LENGTH}) glPixelStorei(what, 0);
  for (const GLenum what : {GL_UNPACK_ALIGNMENT, GL_PACK_ALIGNMENT}) glPixelStorei(what, 4);
  glDeleteBuffers(9, buffers);
  glDeleteTextures(2, textures);
  glDeleteSamplers(1, &sampler);
}

}  // namespace
}  // namespace relume
