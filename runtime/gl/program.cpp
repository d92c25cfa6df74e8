// SPDX-License-Identifier: MIT
// See program.h.
#include "runtime/gl/program.h"

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

}  // namespace

Result<Program> makeComputeProgram(const Functions& gl, std::string_view path, Defines defines,
                                   std::string_view visibilityGlsl) {
  Result<std::string> source = expandShader(path, defines, visibilityGlsl);
  if (!source) return source.error();
  const std::string text = "#version 430 core\n" + *source;
  const char* pointer = text.c_str();
  const Shader shader(gl, gl.CreateShader(GL_COMPUTE_SHADER));
  gl.ShaderSource(shader.get(), 1, &pointer, nullptr);
  gl.CompileShader(shader.get());
  GLint ok = GL_FALSE;
  gl.GetShaderiv(shader.get(), GL_COMPILE_STATUS, &ok);
  if (!ok) {
    return Error{ErrorCode::failed,
                 "shader " + std::string(path) + " does not compile: " + logOf(gl.GetShaderInfoLog, shader.get())};
  }
  Program program(gl, gl.CreateProgram());
  gl.AttachShader(program.get(), shader.get());
  gl.LinkProgram(program.get());
  gl.DetachShader(program.get(), shader.get());
  gl.GetProgramiv(program.get(), GL_LINK_STATUS, &ok);
  if (!ok) {
    return Error{ErrorCode::failed,
                 "shader " + std::string(path) + " does not link: " + logOf(gl.GetProgramInfoLog, program.get())};
  }
  return program;
}

}  // namespace relume::gl
