// SPDX-License-Identifier: MIT
// See receiver_pass.h.
#include "tests/bench/receiver_pass.h"

#include <utility>

namespace relume::bench {
namespace {

constexpr const char* kHead = R"(
layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer In { vec4 receiver[]; };
layout(std430, binding = 1) writeonly buffer Out { vec4 found[]; };
uniform uint count;
void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i >= count) return;
  vec4 a = receiver[2u * i], b = receiver[2u * i + 1u];
)";

}  // namespace

Result<ReceiverPass> ReceiverPass::create(const Relighter& relighter, const std::string& lookup,
                                          const std::vector<Receiver>& receivers) {
  ReceiverPass pass(relighter);
  const std::string text =
      "#version 430\n" + relighter.gl()->glsl() + kHead + "  found[i] = vec4(" + lookup + ", 1.0);\n}\n";
  const char* source = text.c_str();
  pass.program_ = glCreateShaderProgramv(GL_COMPUTE_SHADER, 1, &source);
  GLint linked = 0;
  glGetProgramiv(pass.program_, GL_LINK_STATUS, &linked);
  if (!linked) return Error{ErrorCode::failed, "the resolve shader does not link"};
  pass.count_ = static_cast<GLuint>(receivers.size());
  glGenBuffers(2, pass.buffers_);
  glGenQueries(2, pass.queries_);
  for (const bool isInput : {true, false}) {
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, pass.buffers_[isInput ? 0 : 1]);
    glBufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(receivers.size() * sizeof(Receiver)),
                 isInput ? receivers.data() : nullptr, GL_STATIC_DRAW);
  }
  return pass;
}

ReceiverPass::ReceiverPass(ReceiverPass&& other) noexcept
    : relighter_(other.relighter_), program_(std::exchange(other.program_, 0)), count_(other.count_) {
  for (int k = 0; k < 2; ++k) {
    buffers_[k] = std::exchange(other.buffers_[k], 0);
    queries_[k] = std::exchange(other.queries_[k], 0);
  }
}

ReceiverPass::~ReceiverPass() {
  glDeleteBuffers(2, buffers_);
  if (queries_[0]) glDeleteQueries(2, queries_);
  glDeleteProgram(program_);
}

double ReceiverPass::run() {
  relighter_->gl()->bind();
  for (GLuint k = 0; k < 2; ++k) glBindBufferBase(GL_SHADER_STORAGE_BUFFER, k, buffers_[k]);
  glUseProgram(program_);
  glProgramUniform1ui(program_, glGetUniformLocation(program_, "count"), count_);
  glQueryCounter(queries_[0], GL_TIMESTAMP);
  glDispatchCompute((count_ + 63) / 64, 1, 1);
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  glQueryCounter(queries_[1], GL_TIMESTAMP);
  GLuint64 at[2] = {};
  for (int k = 0; k < 2; ++k) glGetQueryObjectui64v(queries_[k], GL_QUERY_RESULT, &at[k]);
  return static_cast<double>(at[1] - at[0]) * 1e-6;
}

}  // namespace relume::bench
