// SPDX-License-Identifier: MIT
// See program.h.
#include "runtime/gl/program.h"

#include <array>
#include <span>
#include <string>

namespace relume::gl {
namespace {

// By glGetShaderInfoLog or glGetProgramInfoLog.
std::string logOf(PFNGLGETSHADERINFOLOGPROC getLog, GLuint name) {
  std::string log(4096, '\0');
  GLsizei length = 0;
  getLog(name, static_cast<GLsizei>(log.size()), &length, log.data());
  log.resize(static_cast<std::size_t>(length));
  return log;
}

Result<Shader> compile(const Functions& gl, GLenum stage, std::string_view path, Defines defines,
                       std::string_view visibilityGlsl) {
  Result<std::string> source = expandShader(path, defines, visibilityGlsl);
  if (!source) return source.error();
  const std::string text = "#version 430 core\n" + *source;
  const char* pointer = text.c_str();
  Shader shader(gl, gl.CreateShader(stage));
  gl.ShaderSource(shader.get(), 1, &pointer, nullptr);
  gl.CompileShader(shader.get());
  GLint ok = GL_FALSE;
  gl.GetShaderiv(shader.get(), GL_COMPILE_STATUS, &ok);
  if (!ok) {
    return Error{ErrorCode::failed,
                 "shader " + std::string(path) + " does not compile: " + logOf(gl.GetShaderInfoLog, shader.get())};
  }
  return shader;
}

Result<Program> link(const Functions& gl, std::string_view path, std::span<const Shader* const> shaders) {
  Program program(gl, gl.CreateProgram());
  for (const Shader* shader : shaders) gl.AttachShader(program.get(), shader->get());
  gl.LinkProgram(program.get());
  for (const Shader* shader : shaders) gl.DetachShader(program.get(), shader->get());
  GLint ok = GL_FALSE;
  gl.GetProgramiv(program.get(), GL_LINK_STATUS, &ok);
  if (!ok) {
    return Error{ErrorCode::failed,
                 "shader " + std::string(path) + " does not link: " + logOf(gl.GetProgramInfoLog, program.get())};
  }
  return program;
}

}  // namespace

Result<Program> makeComputeProgram(const Functions& gl, std::string_view path, Defines defines,
                                   std::string_view visibilityGlsl) {
  const auto shader = compile(gl, GL_COMPUTE_SHADER, path, defines, visibilityGlsl);
  if (!shader) return shader.error();
  const std::array<const Shader*, 1> shaders{&*shader};
  return link(gl, path, shaders);
}

Result<Program> makeDrawProgram(const Functions& gl, std::string_view vertexPath, std::string_view fragmentPath,
                                Defines defines) {
  const auto vertex = compile(gl, GL_VERTEX_SHADER, vertexPath, defines, {});
  if (!vertex) return vertex.error();
  const auto fragment = compile(gl, GL_FRAGMENT_SHADER, fragmentPath, defines, {});
  if (!fragment) return fragment.error();
  const std::array<const Shader*, 2> shaders{&*vertex, &*fragment};
  return link(gl, fragmentPath, shaders);
}

}  // namespace relume::gl
