// SPDX-License-Identifier: MIT
// See lines.h.
#include "tools/view/lines.h"

#include "tools/gl_scene/gl_program.h"
#include "tools/view/display.h"

#include <glm/gtc/type_ptr.hpp>

namespace relume {
namespace {

const char* kLineVertex = R"(#version 430
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 color;
layout(location = 0) uniform mat4 clipFromWorld;
out vec3 light;
void main() {
  light = color;
  gl_Position = clipFromWorld * vec4(position, 1.0);
}
)";

const char* kLineFragment = R"(
in vec3 light;
out vec4 outColor;
void main() { outColor = vec4(display(light), 1.0); }
)";

}  // namespace

Result<Lines> Lines::create() {
  auto program = linkProgram("lines", kLineVertex, "#version 430\n" + displayGlsl() + kLineFragment);
  if (!program) return program.error();
  Lines lines;
  lines.program_ = std::move(*program);
  lines.layout_ = GlVertexArray::make();
  lines.points_ = GlBuffer::make();
  glBindVertexArray(lines.layout_.name());
  glBindBuffer(GL_ARRAY_BUFFER, lines.points_.name());
  for (const GLuint slot : {0u, 1u}) {
    glEnableVertexAttribArray(slot);
    glVertexAttribPointer(slot, 3, GL_FLOAT, GL_FALSE, sizeof(LinePoint),
                          reinterpret_cast<const void*>(slot * sizeof(glm::vec3)));
  }
  glBindVertexArray(0);
  return lines;
}

void Lines::draw(std::span<const LinePoint> points, const glm::mat4& clipFromWorld, float exposure, bool encode) const {
  glBindBuffer(GL_ARRAY_BUFFER, points_.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(points.size_bytes()), points.data(), GL_STREAM_DRAW);
  glUseProgram(program_.name());
  glUniformMatrix4fv(0, 1, GL_FALSE, glm::value_ptr(clipFromWorld));
  setDisplay(exposure, encode);
  glBindVertexArray(layout_.name());
  glDrawArrays(GL_LINES, 0, static_cast<GLsizei>(points.size()));
  glBindVertexArray(0);
}

}  // namespace relume
