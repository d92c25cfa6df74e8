// SPDX-License-Identifier: MIT
// Splats by OpenGL as a guest of a host's: what they leave alone, what they make, and errors that say what is wrong.
#include "tools/gl_splat/mirror_splats_gl.h"
#include "tools/gl_splat/splats_gl.h"

#include "bake/preview/hemisphere_cells.h"
#include "bake/preview/radiance_records.h"
#include "relume/bake/context.h"
#include "tests/gl_splat/splat_view.h"
#include "tests/runtime/gl_test_support.h"

#include <epoxy/gl.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relume {
namespace {

using test::compareSplats, test::splatByCpu, test::SplatView, test::strewn;

class SplatsGlHost : public test::GlTest {};

std::unique_ptr<SplatsGl> make(const SplatsGlOptions& options) {
  auto made = SplatsGl::create(options);
  EXPECT_TRUE(made) << made.error().message;
  return std::move(*made);
}

// Whatever a host may have set that drawing heeds.
struct OddState {
  GLuint framebuffer = 0, texture = 0, vertexArray = 0, buffer = 0, sampler = 0;
  OddState() {
    glGenFramebuffers(1, &framebuffer);
    glGenTextures(1, &texture);
    glGenVertexArrays(1, &vertexArray);
    glGenBuffers(1, &buffer);
    glGenSamplers(1, &sampler);
    glActiveTexture(GL_TEXTURE0 + 13);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA8, 4, 4);
    glBindSampler(12, sampler);
    glActiveTexture(GL_TEXTURE0 + 5);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
    glBindVertexArray(vertexArray);
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    glBindBuffer(GL_COPY_WRITE_BUFFER, buffer);
    glBufferData(GL_COPY_WRITE_BUFFER, 64, nullptr, GL_STATIC_DRAW);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, buffer);
    glViewportIndexedf(0, 1.5f, 2.0f, 3.0f, 4.0f);
    glScissor(0, 0, 1, 1);
    for (const GLenum what : kSwitches) glEnable(what);
    glDisablei(GL_SCISSOR_TEST, 2);
    glEnablei(GL_BLEND, 0);
    glDisablei(GL_BLEND, 1);
    glBlendEquationi(0, GL_FUNC_SUBTRACT);
    glBlendEquationSeparatei(1, GL_MAX, GL_FUNC_REVERSE_SUBTRACT);
    glBlendFunci(0, GL_ZERO, GL_DST_COLOR);
    glBlendFuncSeparatei(1, GL_ONE, GL_ZERO, GL_SRC_ALPHA, GL_DST_ALPHA);
    glColorMaski(0, GL_FALSE, GL_TRUE, GL_FALSE, GL_TRUE);
    glColorMaski(1, GL_TRUE, GL_FALSE, GL_TRUE, GL_FALSE);
    glPolygonMode(GL_FRONT_AND_BACK, GL_LINE);
    glFrontFace(GL_CW);
    glCullFace(GL_FRONT_AND_BACK);
    glDepthFunc(GL_NEVER);
    glStencilFunc(GL_NEVER, 1, 1);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 7);
    glPixelStorei(GL_PACK_ROW_LENGTH, 7);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 8);
    if (hasClipControl()) glClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
  }
  static bool hasClipControl() { return epoxy_gl_version() >= 45; }
  static constexpr std::array<GLenum, 9> kSwitches{GL_SCISSOR_TEST,       GL_DEPTH_TEST,     GL_STENCIL_TEST,
                                                   GL_COLOR_LOGIC_OP,     GL_CULL_FACE,      GL_POLYGON_SMOOTH,
                                                   GL_RASTERIZER_DISCARD, GL_CLIP_DISTANCE0, GL_CLIP_DISTANCE7};

  static std::vector<GLint64> snapshot() {
    std::vector<GLint64> state;
    std::array<GLint, 4> value{};
    std::vector<GLenum> names{GL_CURRENT_PROGRAM,
                              GL_DRAW_FRAMEBUFFER_BINDING,
                              GL_READ_FRAMEBUFFER_BINDING,
                              GL_VERTEX_ARRAY_BINDING,
                              GL_ARRAY_BUFFER_BINDING,
                              GL_COPY_WRITE_BUFFER_BINDING,
                              GL_VIEWPORT,
                              GL_POLYGON_MODE,
                              GL_UNPACK_ROW_LENGTH,
                              GL_PACK_ROW_LENGTH,
                              GL_UNPACK_ALIGNMENT,
                              GL_ACTIVE_TEXTURE,
                              GL_FRONT_FACE,
                              GL_CULL_FACE_MODE,
                              GL_DEPTH_FUNC,
                              GL_SCISSOR_BOX,
                              GL_STENCIL_FUNC,
                              GL_DRAW_BUFFER0};
    if (hasClipControl()) names.insert(names.end(), {GL_CLIP_ORIGIN, GL_CLIP_DEPTH_MODE});
    for (const GLenum what : names) {
      value.fill(0);
      glGetIntegerv(what, value.data());
      state.insert(state.end(), value.begin(), value.end());
    }
    std::array<GLfloat, 4> viewport{};
    glGetFloati_v(GL_VIEWPORT, 0, viewport.data());
    state.push_back(static_cast<GLint64>(10.0f * viewport[0]));
    for (const GLenum what : kSwitches) state.push_back(glIsEnabled(what));
    for (GLuint i = 0; i < 4; ++i) {
      state.push_back(glIsEnabledi(GL_SCISSOR_TEST, i));
      glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, i, value.data());
      state.push_back(value[0]);
    }
    for (GLuint i = 0; i < 2; ++i) {
      state.push_back(glIsEnabledi(GL_BLEND, i));
      for (const GLenum what : {GL_BLEND_EQUATION_RGB, GL_BLEND_EQUATION_ALPHA, GL_BLEND_SRC_RGB, GL_BLEND_DST_RGB,
                                GL_BLEND_SRC_ALPHA, GL_BLEND_DST_ALPHA}) {
        glGetIntegeri_v(what, i, value.data());
        state.push_back(value[0]);
      }
      std::array<GLboolean, 4> mask{};
      glGetBooleani_v(GL_COLOR_WRITEMASK, i, mask.data());
      state.insert(state.end(), mask.begin(), mask.end());
    }
    GLint active = 0;
    glGetIntegerv(GL_ACTIVE_TEXTURE, &active);
    for (GLenum unit = 0; unit < 16; ++unit) {
      glActiveTexture(GL_TEXTURE0 + unit);
      for (const GLenum what : {GL_TEXTURE_BINDING_2D, GL_SAMPLER_BINDING}) {
        glGetIntegerv(what, value.data());
        state.push_back(value[0]);
      }
    }
    glActiveTexture(static_cast<GLenum>(active));
    return state;
  }
};

TEST_F(SplatsGlHost, findTheirWayThroughAnyStateAndPutItBack) {
  const SplatView view(64, 36);
  std::vector<Record> records = strewn(view, 300);
  const std::vector<Splat> cpu = splatByCpu(view, records, {});
  const OddState odd;
  const std::vector<GLint64> before = OddState::snapshot();
  const auto gl = make({EglContext::getProcAddress});
  EXPECT_EQ(OddState::snapshot(), before) << "create()";
  ASSERT_TRUE(gl->look(view.rays, view.receivers));
  EXPECT_EQ(OddState::snapshot(), before) << "look()";
  ASSERT_TRUE(gl->draw(std::span(records).first(100), {}));
  EXPECT_EQ(OddState::snapshot(), before) << "draw()";
  ASSERT_TRUE(gl->add(std::span(records).subspan(100)));
  EXPECT_EQ(OddState::snapshot(), before) << "add()";
  ASSERT_TRUE(gl->relight(records));
  EXPECT_EQ(OddState::snapshot(), before) << "relight()";
  std::vector<Splat> picture(cpu.size());
  ASSERT_TRUE(gl->read(picture));
  EXPECT_EQ(OddState::snapshot(), before) << "read()";
  const test::SplatDifference d = compareSplats(cpu, picture, {});
  EXPECT_LE(d.rms, 1e-5);
  EXPECT_EQ(d.apart, 0u);
  EXPECT_GT(d.lit, 1000u);
}

TEST_F(SplatsGlHost, mirrorsPutItBackAsWell) {
  const SplatView view(48, 32);
  std::vector<Record> records = strewn(view, 40);
  Context context;
  const HemisphereCells cells = fanCells(256);
  const LobeTable lobes(2, LobeKind::mean, context);
  RadianceRecords radiance(cells, lobes, 0.15f, RecordReach::guarded);
  radiance.keeper({}).resize(records.size());
  std::vector<MirrorSurface> surfaces(view.receivers.size());
  std::vector<MirrorSplat> picture(surfaces.size());
  const OddState odd;
  const std::vector<GLint64> before = OddState::snapshot();
  const auto gl = MirrorSplatsGl::create(EglContext::getProcAddress, 2);
  ASSERT_TRUE(gl) << gl.error().message;
  EXPECT_EQ(OddState::snapshot(), before) << "create()";
  const Status ok = (*gl)->draw(view.rays, view.receivers, surfaces, records, radiance, {}, picture);
  EXPECT_TRUE(ok) << ok.error().message;
  EXPECT_EQ(OddState::snapshot(), before) << "draw()";
  EXPECT_GT(std::count_if(picture.begin(), picture.end(), [](const MirrorSplat& s) { return s.weight > 0.0f; }), 100);
}

int objects = 0;  // made by the functions below

GlProc countingMade(const char* name) {
  const std::string_view n = name;
  if (n == "glGenTextures")
    return reinterpret_cast<GlProc>(+[](GLsizei k, GLuint* names) { objects += k, glGenTextures(k, names); });
  if (n == "glGenBuffers")
    return reinterpret_cast<GlProc>(+[](GLsizei k, GLuint* names) { objects += k, glGenBuffers(k, names); });
  if (n == "glGenFramebuffers")
    return reinterpret_cast<GlProc>(+[](GLsizei k, GLuint* names) { objects += k, glGenFramebuffers(k, names); });
  if (n == "glGenVertexArrays")
    return reinterpret_cast<GlProc>(+[](GLsizei k, GLuint* names) { objects += k, glGenVertexArrays(k, names); });
  if (n == "glCreateProgram") return reinterpret_cast<GlProc>(+[]() { return ++objects, glCreateProgram(); });
  if (n == "glCreateShader")
    return reinterpret_cast<GlProc>(+[](GLenum stage) { return ++objects, glCreateShader(stage); });
  return EglContext::getProcAddress(name);
}

TEST_F(SplatsGlHost, onlyCreateMakesObjects) {
  objects = 0;
  const auto gl = make({countingMade});
  EXPECT_EQ(objects, 7 + 2 + 2 + 1 + 2 + 4);  // textures, buffers, framebuffers, vertex array, programs and shaders
  objects = 0;
  for (const std::uint32_t width : {64u, 200u, 32u}) {
    SplatView view(width, 36);
    view.receivers[5].bent = {0, 1, 0};
    std::vector<Record> records = strewn(view, 40 * width);
    ASSERT_TRUE(gl->look(view.rays, view.receivers));
    ASSERT_TRUE(gl->draw(std::span(records).first(width), {}));
    ASSERT_TRUE(gl->add(std::span(records).subspan(width)));
    ASSERT_TRUE(gl->relight(records));
  }
  EXPECT_EQ(objects, 0);
}

void expectError(const Status& status, ErrorCode code, const std::string& part) {
  ASSERT_FALSE(status);
  EXPECT_EQ(status.error().code, code);
  EXPECT_NE(status.error().message.find(part), std::string::npos) << status.error().message;
}

TEST_F(SplatsGlHost, callsOutOfTurnAndOfOtherSizesAreNamed) {
  const auto gl = make({EglContext::getProcAddress, false, 100});
  const SplatView view(64, 36);
  const std::vector<Record> records = strewn(view, 101);
  std::vector<Splat> picture(64 * 36);
  expectError(gl->draw({}, {}), ErrorCode::usage, "before look()");
  expectError(gl->read(picture), ErrorCode::usage, "before look()");
  expectError(gl->look(view.rays, std::span(view.receivers).first(10)), ErrorCode::usage, "10 receivers");
  ASSERT_TRUE(gl->look(view.rays, view.receivers));
  expectError(gl->add(records), ErrorCode::usage, "before draw()");
  expectError(gl->relight(records), ErrorCode::usage, "before draw()");
  expectError(gl->draw(records, {}), ErrorCode::unsupported, "101 records; there may be 100");
  ASSERT_TRUE(gl->draw(std::span(records).first(60), {}));
  expectError(gl->relight(records), ErrorCode::usage, "101 records, expected the 60");
  ASSERT_TRUE(gl->add(std::span(records).first(40)));
  expectError(gl->add(std::span(records).first(1)), ErrorCode::unsupported, "101 records");
  expectError(gl->read(std::span(picture).first(5)), ErrorCode::usage, "5 pixels, expected 64 x 36");
  // After an error a look begins anew.
  ASSERT_TRUE(gl->look(view.rays, view.receivers));
  ASSERT_TRUE(gl->draw(std::span(records).first(100), {}));
  ASSERT_TRUE(gl->read(picture));
  EXPECT_EQ(compareSplats(splatByCpu(view, std::span(records).first(100), {}), picture, {}).apart, 0u);
}

TEST_F(SplatsGlHost, picturesBeyondTheLimitsAreNamed) {
  const auto smallTextures = [](const char* name) -> GlProc {
    if (std::strcmp(name, "glGetIntegerv") != 0) return EglContext::getProcAddress(name);
    return reinterpret_cast<GlProc>(+[](GLenum what, GLint* value) {
      glGetIntegerv(what, value);
      if (what == GL_MAX_TEXTURE_SIZE) *value = 100;
    });
  };
  const auto gl = make({smallTextures});
  const SplatView wide(101, 4), tall(4, 101), fits(100, 100);
  expectError(gl->look(wide.rays, wide.receivers), ErrorCode::unsupported, "101 x 4 pixels");
  expectError(gl->look(tall.rays, tall.receivers), ErrorCode::unsupported, "1 to 100 along a side");
  EXPECT_TRUE(gl->look(fits.rays, fits.receivers));
}

bool hasMemory = true;  // of the functions below
bool isShort = false;

GlProc runningOut(const char* name) {
  const std::string_view n = name;
  if (n == "glBufferData")
    return reinterpret_cast<GlProc>(+[](GLenum target, GLsizeiptr size, const void* data, GLenum usage) {
      isShort = isShort || !hasMemory;
      glBufferData(target, size, data, usage);
    });
  if (n == "glGetError")
    return reinterpret_cast<GlProc>(
        +[]() -> GLenum { return std::exchange(isShort, false) ? GL_OUT_OF_MEMORY : glGetError(); });
  return EglContext::getProcAddress(name);
}

TEST_F(SplatsGlHost, memoryThatRunsOutIsNamedAndDrawnAnew) {
  const auto gl = make({runningOut});
  const SplatView view(64, 36);
  const std::vector<Record> records = strewn(view, 300);
  ASSERT_TRUE(gl->look(view.rays, view.receivers));
  ASSERT_TRUE(gl->draw(records, {}));
  hasMemory = false;
  expectError(gl->relight(records), ErrorCode::memory, "not enough memory for 300 records");
  hasMemory = true;
  expectError(gl->relight(records), ErrorCode::usage, "before draw()");
  ASSERT_TRUE(gl->draw(records, {}));
  ASSERT_TRUE(gl->relight(records));
  std::vector<Splat> picture(64 * 36);
  ASSERT_TRUE(gl->read(picture));
  EXPECT_EQ(compareSplats(splatByCpu(view, records, {}), picture, {}).apart, 0u);
}

TEST_F(SplatsGlHost, anOpenGlThatDoesNotAddFloatsIsNamed) {
  const auto replacing = [](const char* name) -> GlProc {
    if (std::strcmp(name, "glBlendFuncSeparatei") != 0) return EglContext::getProcAddress(name);
    return reinterpret_cast<GlProc>(
        +[](GLuint i, GLenum, GLenum, GLenum, GLenum) { glBlendFuncSeparatei(i, GL_ONE, GL_ZERO, GL_ONE, GL_ZERO); });
  };
  const auto refused = SplatsGl::create({replacing});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::unsupported);
  EXPECT_NE(refused.error().message.find("does not add up 32-bit floats"), std::string::npos)
      << refused.error().message;
}

TEST_F(SplatsGlHost, whatTheLoaderLacksIsNamed) {
  for (const char* absent : {"glViewportIndexedfv", "glGenFramebuffers", "glUseProgram"}) {
    const auto refused = SplatsGl::create({[absent](const char* name) {
      return std::strcmp(name, absent) == 0 ? GlProc() : EglContext::getProcAddress(name);
    }});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::unsupported);
    EXPECT_NE(refused.error().message.find(absent), std::string::npos) << refused.error().message;
  }
  const auto none = SplatsGl::create({});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::usage);
  for (const std::uint32_t records : {0u, 10000001u}) {
    const auto refused = SplatsGl::create({EglContext::getProcAddress, false, records});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
  }
}

}  // namespace
}  // namespace relume
