// SPDX-License-Identifier: MIT
// See backdrop.h.
#include "tools/view/backdrop.h"

#include "tools/gl_scene/gl_program.h"
#include "tools/view/display.h"

#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>

#include <string>

namespace relume {
namespace {

constexpr std::uint32_t kMaxWidth = 2048;

// Directions from the near plane to the far one, which a corner's vertex has and the rest of the screen between.
const char* kBackdropVertex = R"(#version 430
layout(location = 24) uniform mat4 worldFromClip;
out vec3 direction;
void main() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;
  vec4 near = worldFromClip * vec4(corner, -1.0, 1.0), far = worldFromClip * vec4(corner, 1.0, 1.0);
  direction = far.xyz / far.w - near.xyz / near.w;
  gl_Position = vec4(corner, 0.0, 1.0);
}
)";

// toEquirectangular() of formats/equirectangular.h.
const char* kBackdropFragment = R"(
in vec3 direction;
layout(location = 0) out vec4 outColor;
layout(location = 25) uniform float turn;  // share of a row
layout(binding = 0) uniform sampler2D map;
void main() {
  vec3 d = normalize(direction);
  vec2 place = vec2(0.5 + atan(d.x, -d.z) * 0.159154943 + turn, acos(clamp(d.y, -1.0, 1.0)) * 0.318309886);
  outColor = vec4(display(textureLod(map, place, 0.0).rgb), 1.0);
}
)";

}  // namespace

Result<Backdrop> Backdrop::create(const SkyMap& map) {
  auto program = linkProgram("sky", kBackdropVertex, "#version 430\n" + displayGlsl() + kBackdropFragment);
  if (!program) return program.error();
  Backdrop backdrop;
  backdrop.program_ = std::move(*program);
  backdrop.nothing_ = GlVertexArray::make();
  backdrop.texture_ = GlTexture::make();
  const SkyMap shown = reducedSky(map, kMaxWidth);
  glBindTexture(GL_TEXTURE_2D, backdrop.texture_.name());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB32F, static_cast<GLsizei>(shown.width), static_cast<GLsizei>(shown.height), 0,
               GL_RGB, GL_FLOAT, shown.texels.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  glBindTexture(GL_TEXTURE_2D, 0);
  return backdrop;
}

void Backdrop::draw(const glm::mat4& clip, float rotationDeg, float exposure, bool encode) const {
  glUseProgram(program_.name());
  setDisplay(exposure, encode);
  const glm::mat4 inverse = glm::inverse(clip);
  glUniformMatrix4fv(24, 1, GL_FALSE, glm::value_ptr(inverse));
  glUniform1f(25, rotationDeg / 360.0f);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, texture_.name());
  glBindVertexArray(nothing_.name());
  glDrawArrays(GL_TRIANGLE_STRIP, 0, 4);
  glBindVertexArray(0);
  glBindTexture(GL_TEXTURE_2D, 0);
}

}  // namespace relume
