// SPDX-License-Identifier: MIT
// See discs.h.
#include "tools/view/discs.h"

#include "tools/gl_scene/gl_program.h"
#include "tools/view/display.h"

#include <glm/gtc/type_ptr.hpp>

namespace relume {
namespace {

const char* kDiscVertex = R"(#version 430
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 color;
layout(location = 0) uniform mat4 clipFromWorld;
layout(location = 1) uniform vec3 eye;
layout(location = 2) uniform float radius;
out vec2 corner;
flat out vec3 light;
void main() {
  corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  vec3 n = dot(normal, normal) > 0.0 ? normal : normalize(eye - position);
  vec3 side = normalize(cross(abs(n.y) < 0.9 ? vec3(0, 1, 0) : vec3(1, 0, 0), n));
  vec3 p = position + (color.x < 0.0 ? 0.0 : radius) * (corner.x * side + corner.y * cross(n, side)) + 0.002 * n;
  light = color;
  gl_Position = clipFromWorld * vec4(p, 1.0);
}
)";

const char* kDiscFragment = R"(
in vec2 corner;
flat in vec3 light;
out vec4 outColor;
void main() {
  if (dot(corner, corner) > 1.0) discard;
  outColor = vec4(display(light), 1.0);
}
)";

GlBuffer upload(GLuint slot, std::span<const glm::vec3> values, GLenum usage) {
  GlBuffer buffer = GlBuffer::make();
  glBindBuffer(GL_ARRAY_BUFFER, buffer.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(values.size_bytes()), values.data(), usage);
  glEnableVertexAttribArray(slot);
  glVertexAttribPointer(slot, 3, GL_FLOAT, GL_FALSE, sizeof(glm::vec3), nullptr);
  glVertexAttribDivisor(slot, 1);
  return buffer;
}

}  // namespace

Result<Discs> Discs::create(std::span<const glm::vec3> position, std::span<const glm::vec3> normal) {
  Discs discs;
  auto program = linkProgram("discs", kDiscVertex, "#version 430\n" + displayGlsl() + kDiscFragment);
  if (!program) return program.error();
  discs.program_ = std::move(*program);
  discs.layout_ = GlVertexArray::make();
  glBindVertexArray(discs.layout_.name());
  discs.position_ = upload(0, position, GL_STATIC_DRAW);
  discs.normal_ = upload(1, normal, GL_STATIC_DRAW);
  discs.color_ = upload(2, position, GL_STREAM_DRAW);
  glBindVertexArray(0);
  discs.count_ = static_cast<GLsizei>(position.size());
  return discs;
}

void Discs::draw(std::span<const glm::vec3> color, float radius, const glm::mat4& clipFromWorld, const glm::vec3& eye,
                 float exposure, bool encode) const {
  glBindBuffer(GL_ARRAY_BUFFER, color_.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(color.size_bytes()), color.data(), GL_STREAM_DRAW);
  glUseProgram(program_.name());
  glUniformMatrix4fv(0, 1, GL_FALSE, glm::value_ptr(clipFromWorld));
  glUniform3fv(1, 1, glm::value_ptr(eye));
  glUniform1f(2, radius);
  setDisplay(exposure, encode);
  glBindVertexArray(layout_.name());
  glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, count_);
  glBindVertexArray(0);
}

}  // namespace relume
