// SPDX-License-Identifier: MIT
// See gl_program.h.
#include "tools/gl_scene/gl_program.h"

namespace relume {
namespace {

Result<GlShader> compile(const std::string& name, GLenum stage, const std::string& glsl) {
  GlShader shader(glCreateShader(stage));
  const char* text = glsl.c_str();
  glShaderSource(shader.name(), 1, &text, nullptr);
  glCompileShader(shader.name());
  GLint ok = 0, length = 0;
  glGetShaderiv(shader.name(), GL_COMPILE_STATUS, &ok);
  if (ok) return shader;
  glGetShaderiv(shader.name(), GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<std::size_t>(length) + 1, '\0');
  glGetShaderInfoLog(shader.name(), length + 1, nullptr, log.data());
  return Error{ErrorCode::failed,
               name + (stage == GL_VERTEX_SHADER ? " vertex" : " fragment") + " shader: " + log.c_str()};
}

}  // namespace

Result<GlProgram> linkProgram(const std::string& name, const std::string& vertexGlsl, const std::string& fragmentGlsl) {
  auto vertex = compile(name, GL_VERTEX_SHADER, vertexGlsl);
  if (!vertex) return vertex.error();
  auto fragment = compile(name, GL_FRAGMENT_SHADER, fragmentGlsl);
  if (!fragment) return fragment.error();
  GlProgram program = GlProgram::make();
  glAttachShader(program.name(), vertex->name());
  glAttachShader(program.name(), fragment->name());
  glLinkProgram(program.name());
  GLint ok = 0, length = 0;
  glGetProgramiv(program.name(), GL_LINK_STATUS, &ok);
  if (ok) return program;
  glGetProgramiv(program.name(), GL_INFO_LOG_LENGTH, &length);
  std::string log(static_cast<std::size_t>(length) + 1, '\0');
  glGetProgramInfoLog(program.name(), length + 1, nullptr, log.data());
  return Error{ErrorCode::failed, name + " program: " + log.c_str()};
}

}  // namespace relume
