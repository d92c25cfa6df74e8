// SPDX-License-Identifier: MIT
// The resolve by textures and plain uniforms, as a host without storage buffers draws with it: fragment shaders of
// GLSL 3.30 and of OpenGL ES 3.0 against the resolve by buffers.
#include "relume/relighter.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

class GlTextures : public test::GlTest {};

constexpr std::size_t kReceivers = 500;

// Position, light-map coordinates and normal, twelve floats each.
std::vector<float> textureReceivers(const CacheGrid& grid) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  std::normal_distribution<float> gauss;
  std::vector<float> in;
  for (std::size_t i = 0; i < kReceivers; ++i) {
    const glm::vec3 u = 1.6f * glm::vec3(uniform(random), uniform(random), uniform(random)) - 0.3f;
    const glm::vec3 p = grid.originWorld + u * grid.spacing * glm::vec3(grid.resolution - 1u);
    const glm::vec3 n = glm::normalize(glm::vec3(gauss(random), gauss(random), gauss(random)));
    in.insert(in.end(), {p.x, p.y, p.z, uniform(random), uniform(random), 0, 0, 0, n.x, n.y, n.z, 0});
  }
  return in;
}

// Look-ups of a receiver with position p, coordinates uv and normal n.
constexpr std::array<const char*, 6> kLookups{"relumeIrradianceLightmap(uv, n)",   "relumeIrradianceGrid(p, n)",
                                              "relumeIrradianceGridTexture(p, n)", "relumeIrradianceGridSmooth(p, n)",
                                              "relumeGlossyLightmap(uv, n, 12.0)", "relumeGlossyGrid(p, n, n, 12.0)"};

void light(Relighter& relighter) {
  const std::array<Light, 2> lights = test::lampAndSun();
  LightSetup setup;
  setup.lights = lights;
  setup.bounceScale = 0.0f;
  EXPECT_TRUE(relighter.relight(setup));
}

std::vector<float> byBuffers(const Relighter& relighter, const char* lookup, const std::vector<float>& in) {
  relighter.gl()->bind();
  return test::runCompute(relighter.gl()->glsl(),
                          "uint k = 12u * i; vec3 p = vec3(inData[k], inData[k+1u], inData[k+2u]);\n"
                          "vec2 uv = vec2(inData[k+3u], inData[k+4u]);\n"
                          "vec3 n = vec3(inData[k+8u], inData[k+9u], inData[k+10u]);\n"
                          "vec3 e = " +
                              std::string(lookup) + ";\nfor (int j = 0; j < 3; ++j) outData[3u*i+uint(j)] = e[j];\n",
                          in, kReceivers, 3 * kReceivers);
}

// What a host does with a relighter's textures, in whatever version of OpenGL is current.
class Host {
 public:
  Host(const Relighter& relighter, const char* version) : relighter_(relighter), version_(version) {
    const Result<TextureResolve> resolve = relighter.textureResolve();
    EXPECT_TRUE(resolve) << (resolve ? "" : resolve.error().message);
    if (!resolve) return;
    resolve_ = *resolve;
    names_.resize(resolve_.textures.size());
    glGenTextures(static_cast<GLsizei>(names_.size()), names_.data());
    for (std::size_t i = 0; i < names_.size(); ++i) create(i);
  }
  ~Host() { glDeleteTextures(static_cast<GLsizei>(names_.size()), names_.data()); }
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  // Draws a pixel for each receiver.
  std::vector<float> draw(const char* lookup, const std::vector<float>& in) const {
    const Result<std::string> glsl = relighter_.textureResolveGlsl();
    EXPECT_TRUE(glsl) << (glsl ? "" : glsl.error().message);
    if (!glsl) return {};
    const GLuint program = link(*glsl, lookup);
    glUseProgram(program);
    for (std::size_t i = 0; i < names_.size(); ++i) {
      glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + i));
      glBindTexture(target(i), names_[i]);
      glUniform1i(glGetUniformLocation(program, resolve_.textures[i].sampler), static_cast<GLint>(i));
    }
    glUniform4fv(glGetUniformLocation(program, "relumeGrid"), 6, &resolve_.grid[0].x);
    const auto unit = static_cast<GLint>(names_.size());
    GLuint textures[2], frame = 0, vertices = 0;
    glGenTextures(2, textures);
    glActiveTexture(static_cast<GLenum>(GL_TEXTURE0 + unit));
    for (int k = 0; k < 2; ++k) {
      glBindTexture(GL_TEXTURE_2D, textures[1 - k]);
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
      glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
      glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, static_cast<GLsizei>(k == 0 ? kReceivers : 3 * kReceivers), 1, 0,
                   GL_RGBA, GL_FLOAT, k == 0 ? nullptr : in.data());
    }
    glUniform1i(glGetUniformLocation(program, "receivers"), unit);
    glGenFramebuffers(1, &frame);
    glBindFramebuffer(GL_FRAMEBUFFER, frame);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, textures[1], 0);
    EXPECT_EQ(glCheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
    glGenVertexArrays(1, &vertices);
    glBindVertexArray(vertices);
    glViewport(0, 0, static_cast<GLsizei>(kReceivers), 1);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    std::vector<float> rgba(4 * kReceivers);
    glReadPixels(0, 0, static_cast<GLsizei>(kReceivers), 1, GL_RGBA, GL_FLOAT, rgba.data());
    glDeleteVertexArrays(1, &vertices);
    glDeleteFramebuffers(1, &frame);
    glDeleteTextures(2, textures);
    glUseProgram(0);
    glDeleteProgram(program);
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
    std::vector<float> found;
    for (std::size_t i = 0; i < kReceivers; ++i) found.insert(found.end(), &rgba[4 * i], &rgba[4 * i + 3]);
    return found;
  }

 private:
  GLenum target(std::size_t i) const {
    const TextureShape shape = resolve_.textures[i].shape;
    return shape == TextureShape::flat ? GL_TEXTURE_2D
                                       : (shape == TextureShape::array ? GL_TEXTURE_2D_ARRAY : GL_TEXTURE_3D);
  }

  void create(std::size_t i) const {
    const ResolveTexture& texture = resolve_.textures[i];
    std::vector<std::byte> texels(texture.bytes);
    const Status written = relighter_.writeResolveTexture(i, texels);
    EXPECT_TRUE(written) << (written ? "" : written.error().message);
    struct Format {
      GLint stored;
      GLenum format, type;
    };
    const Format format = texture.format == TexelFormat::rgba16f ? Format{GL_RGBA16F, GL_RGBA, GL_HALF_FLOAT}
                          : texture.format == TexelFormat::rg16f ? Format{GL_RG16F, GL_RG, GL_HALF_FLOAT}
                          : texture.format == TexelFormat::rgba8 ? Format{GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE}
                                                                 : Format{GL_R8, GL_RED, GL_UNSIGNED_BYTE};
    glBindTexture(target(i), names_[i]);
    const GLint filter = texture.isFiltered ? GL_LINEAR : GL_NEAREST;
    glTexParameteri(target(i), GL_TEXTURE_MIN_FILTER, filter);
    glTexParameteri(target(i), GL_TEXTURE_MAG_FILTER, filter);
    for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
      glTexParameteri(target(i), wrap, GL_CLAMP_TO_EDGE);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    const auto width = static_cast<GLsizei>(texture.size.x), height = static_cast<GLsizei>(texture.size.y),
               depth = static_cast<GLsizei>(texture.size.z);
    if (texture.shape == TextureShape::flat) {
      glTexImage2D(GL_TEXTURE_2D, 0, format.stored, width, height, 0, format.format, format.type, texels.data());
    } else {
      glTexImage3D(target(i), 0, format.stored, width, height, depth, 0, format.format, format.type, texels.data());
    }
  }

  GLuint link(const std::string& glsl, const char* lookup) const {
    const std::string version = "#version " + std::string(version_) + "\n";
    const std::string vertex = version +
                               "void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 "
                               ": -1.0, 0.0, 1.0); }\n";
    const std::string fragment = version + glsl +
                                 "uniform highp sampler2D receivers;\nout vec4 color;\nvoid main() {\n"
                                 "  int k = 3 * int(gl_FragCoord.x);\n"
                                 "  vec4 a = texelFetch(receivers, ivec2(k, 0), 0);\n"
                                 "  vec3 p = a.xyz, n = texelFetch(receivers, ivec2(k + 2, 0), 0).xyz;\n"
                                 "  vec2 uv = vec2(a.w, texelFetch(receivers, ivec2(k + 1, 0), 0).x);\n"
                                 "  color = vec4(" +
                                 lookup + ", 1.0);\n}\n";
    const GLuint program = glCreateProgram();
    for (const auto& [stage, text] : {std::pair(GL_VERTEX_SHADER, &vertex), std::pair(GL_FRAGMENT_SHADER, &fragment)}) {
      const GLuint shader = glCreateShader(static_cast<GLenum>(stage));
      const char* source = text->c_str();
      glShaderSource(shader, 1, &source, nullptr);
      glCompileShader(shader);
      std::string log(4096, '\0');
      glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
      GLint compiled = GL_FALSE;
      glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
      EXPECT_TRUE(compiled) << version_ << ": " << log.c_str();
      glAttachShader(program, shader);
      glDeleteShader(shader);
    }
    glLinkProgram(program);
    GLint linked = GL_FALSE;
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    EXPECT_TRUE(linked);
    return program;
  }

  const Relighter& relighter_;
  const char* version_;
  TextureResolve resolve_;
  std::vector<GLuint> names_;
};

struct Case {
  const char* name;
  Bake bake;
  RelightOptions options;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  const auto add = [&](const char* name, Bake bake, int luma, int chroma, bool gridTexture, bool glossy) {
    if (all.size() % 2 == 0) test::addSight(bake);
    RelightOptions options;
    options.getProcAddress = EglContext::getProcAddress;
    options.lumaBands = luma;
    options.chromaBands = chroma;
    options.gridTexture = gridTexture;
    options.gridTrust = 0.6f;
    options.glossy = glossy;
    all.push_back({name, std::move(bake), options});
  };
  add("bricks and depths", test::makeBakeWithBricks({4, 3, 4}, true, true), 3, 2, false, false);
  add("the grid's texture", test::makeBakeWithBricks({4, 3, 4}, false, true), 3, 1, true, false);
  add("glossy bands", test::makeBakeWithBricks({3, 4, 2}, true, false), 6, 4, false, true);
  add("two bands", test::makeBakeWithBricks({3, 1, 2}, false, false), 2, 2, true, false);
  add("one band", test::makeBakeWithBricks({3, 4, 2}, true, true), 1, 1, false, false);
  return all;
}

// Of the differences, relative to that of the first.
double rootMeanSquare(const std::vector<float>& a, const std::vector<float>& b) {
  double all = 0.0, apart = 0.0;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    all += static_cast<double>(a[i]) * a[i];
    apart += (static_cast<double>(a[i]) - b[i]) * (static_cast<double>(a[i]) - b[i]);
  }
  return a.size() == b.size() ? std::sqrt(apart / all) : 1.0;
}

// The light of each look-up by textures from either backend, against that by buffers.
TEST_F(GlTextures, areReadLikeBuffers) {
  for (const Case& each : cases()) {
    SCOPED_TRACE(each.name);
    const std::vector<float> in = textureReceivers(each.bake.caches.grid);
    RelightOptions options = each.options;
    Result<Relighter> cpu = Relighter::create(each.bake, options);
    options.backend = BackendKind::gl;
    Result<Relighter> gl = Relighter::create(each.bake, options);
    ASSERT_TRUE(cpu && gl);
    light(*cpu);
    light(*gl);
    const Host fromCpu(*cpu, "330 core"), fromGl(*gl, "330 core");
    for (const char* lookup : kLookups) {
      SCOPED_TRACE(lookup);
      const std::vector<float> expected = byBuffers(*gl, lookup, in);
      ASSERT_GT(*std::max_element(expected.begin(), expected.end()), 0.0f);
      EXPECT_LT(test::difference(expected, fromGl.draw(lookup, in)), test::isSoftware() ? 1e-5 : 2e-3);
      // Both backends' light is rounded to halves here, of sums that were rounded otherwise before: the last bit of
      // some coefficients is another one. It shows in narrow lobes and where coefficients cancel.
      const std::vector<float> ofCpu = fromCpu.draw(lookup, in);
      EXPECT_LT(rootMeanSquare(expected, ofCpu), 1e-3);
      EXPECT_LT(test::difference(expected, ofCpu), 1e-2);
    }
  }
}

TEST_F(GlTextures, areReadInOpenGlEsAsInOpenGl) {
  for (const Case& each : cases()) {
    SCOPED_TRACE(each.name);
    const std::vector<float> in = textureReceivers(each.bake.caches.grid);
    Result<Relighter> cpu = Relighter::create(each.bake, each.options);
    ASSERT_TRUE(cpu);
    light(*cpu);
    std::vector<std::vector<float>> expected;
    {
      const Host host(*cpu, "330 core");
      for (const char* lookup : kLookups) expected.push_back(host.draw(lookup, in));
    }
    Result<EglContext> es = EglContext::create({.es = true});
    if (!es) GTEST_SKIP() << es.error().message;
    if (!epoxy_has_gl_extension("GL_EXT_color_buffer_float")) GTEST_SKIP() << "no float targets in OpenGL ES here";
    {
      const Host host(*cpu, "300 es");
      for (std::size_t k = 0; k < kLookups.size(); ++k) {
        SCOPED_TRACE(kLookups[k]);
        EXPECT_LT(test::difference(expected[k], host.draw(kLookups[k], in)), 1e-3);
      }
    }
    ASSERT_TRUE(context_->makeCurrent());
  }
}

}  // namespace
}  // namespace relume
