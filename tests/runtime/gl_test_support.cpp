// SPDX-License-Identifier: MIT
// See gl_test_support.h.
#include "tests/runtime/gl_test_support.h"

#include <epoxy/gl.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace relume::test {

void GlTest::SetUp() {
  Result<EglContext> made = EglContext::create({.debug = true});
  if (!made) GTEST_SKIP() << made.error().message;
  context_.emplace(std::move(*made));
}

void GlTest::TearDown() {
  if (!context_) return;
  EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
  EXPECT_EQ(context_->errorCount(), 0) << context_->lastError();
  context_.reset();
}

bool isSoftware() { return std::strstr(reinterpret_cast<const char*>(glGetString(GL_RENDERER)), "pipe") != nullptr; }

Relighter makeRelighter(const Bake& bake, BackendKind backend, int luma, int chroma, const std::string& visibility,
                        bool glossy) {
  RelightOptions options;
  options.backend = backend;
  options.getProcAddress = EglContext::getProcAddress;
  options.lumaBands = luma;
  options.chromaBands = chroma;
  options.glossy = glossy;
  options.visibilityGlsl = visibility;
  Result<Relighter> made = Relighter::create(bake, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

SyntheticOptions manySurfels(LinkKind kind, std::uint32_t bands) {
  return {.surfels = 9000, .skyPatches = 48, .linksPerCache = 61, .kind = kind, .bands = bands};
}

bool linkCompute(std::uint32_t program, const std::string& source) {
  const char* pointer = source.c_str();
  const GLuint shader = glCreateShader(GL_COMPUTE_SHADER);
  glShaderSource(shader, 1, &pointer, nullptr);
  glCompileShader(shader);
  glAttachShader(program, shader);
  glLinkProgram(program);
  GLint linked = GL_FALSE;
  glGetProgramiv(program, GL_LINK_STATUS, &linked);
  std::string log(4096, '\0');
  glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), nullptr, log.data());
  EXPECT_TRUE(linked) << log.c_str();
  glDetachShader(program, shader);
  glDeleteShader(shader);
  return linked == GL_TRUE;
}

std::vector<float> runCompute(const std::string& text, const std::string& body, const std::vector<float>& in,
                              std::size_t count, std::size_t outFloats,
                              const std::function<void(std::uint32_t)>& prepare) {
  const std::string source = "#version 430 core\n" + text +
                             "layout(local_size_x = 64) in;\n"
                             "layout(std430, binding = 0) readonly buffer In { float inData[]; };\n"
                             "layout(std430, binding = 1) writeonly buffer Out { float outData[]; };\n"
                             "uniform uint threadCount;\n"
                             "void main() {\n  uint i = gl_GlobalInvocationID.x;\n  if (i >= threadCount) return;\n" +
                             body + "}\n";
  const GLuint program = glCreateProgram();
  const bool linked = linkCompute(program, source);
  std::vector<float> out(outFloats, 0.0f);
  if (linked) {
    GLuint buffers[2];
    glGenBuffers(2, buffers);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 0, buffers[0]);
    glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(in.size() * 4), in.data(), GL_STATIC_DRAW);
    glBindBufferBase(GL_SHADER_STORAGE_BUFFER, 1, buffers[1]);
    glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(outFloats * 4), nullptr, GL_STATIC_DRAW);
    if (prepare) prepare(program);
    glUseProgram(program);
    glUniform1ui(glGetUniformLocation(program, "threadCount"), static_cast<GLuint>(count));
    glDispatchCompute(static_cast<GLuint>((count + 63) / 64), 1, 1);
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glGetBufferSubData(GL_SHADER_STORAGE_BUFFER, 0, static_cast<GLsizeiptr>(outFloats * 4), out.data());
    glUseProgram(0);
    glDeleteBuffers(2, buffers);
  }
  glDeleteProgram(program);
  return out;
}

double difference(const std::vector<float>& a, const std::vector<float>& b) {
  EXPECT_EQ(a.size(), b.size());
  double square = 0.0, largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    square += static_cast<double>(a[i]) * a[i];
    largest = std::max(largest, static_cast<double>(std::abs(a[i] - b[i])));
  }
  return largest / std::sqrt(std::max(square / static_cast<double>(a.size()), 1e-30));
}

double coefficientDifference(const std::vector<float>& a, const std::vector<float>& b, int perCache) {
  EXPECT_EQ(a.size(), b.size());
  const auto stride = static_cast<std::size_t>(perCache);
  double largest = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    largest = std::max(largest, static_cast<double>(std::abs(a[i] - b[i])) / std::max(a[i - i % stride], 1e-6f));
  }
  return largest;
}

}  // namespace relume::test
