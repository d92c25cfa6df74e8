// SPDX-License-Identifier: MIT
// See program.h.
#include "runtime/gl/program.h"

#include "runtime/gl/saved_state.h"

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

// Logs count lines within what is called a string of the source. The host's is number 1, so that its lines are counted
// by themselves, what follows it number 2.
std::string numbered(std::string_view visibilityGlsl) {
  if (visibilityGlsl.empty()) return {};
  return "#line 1 1\n" + std::string(visibilityGlsl) + "\n#line 1 2";
}

// logNote: what is to be known to read a driver's log.
Result<Shader> compile(const Functions& gl, GLenum stage, std::string_view path, std::string_view source,
                       const char* logNote) {
  const std::string text = "#version 430 core\n" + std::string(source);
  const char* pointer = text.c_str();
  Shader shader(gl, gl.CreateShader(stage));
  gl.ShaderSource(shader.get(), 1, &pointer, nullptr);
  gl.CompileShader(shader.get());
  GLint ok = GL_FALSE;
  gl.GetShaderiv(shader.get(), GL_COMPILE_STATUS, &ok);
  if (!ok) {
    return Error{ErrorCode::failed, "shader " + std::string(path) + " does not compile" + logNote + ": " +
                                        logOf(gl.GetShaderInfoLog, shader.get())};
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

// usage: a block of the host's has one of the bindings at which it would read Relume's buffers.
Status checkBindings(const Functions& gl, std::string_view path, const Program& program) {
  for (const GLenum kind : std::to_array<GLenum>({GL_SHADER_STORAGE_BLOCK, GL_UNIFORM_BLOCK})) {
    GLint count = 0;
    gl.GetProgramInterfaceiv(program.get(), kind, GL_ACTIVE_RESOURCES, &count);
    for (GLuint i = 0; i < static_cast<GLuint>(count); ++i) {
      std::array<GLchar, 256> text{};
      gl.GetProgramResourceName(program.get(), kind, i, static_cast<GLsizei>(text.size()), nullptr, text.data());
      const std::string name = text.data();
      if (name.starts_with("Relume")) continue;
      constexpr GLenum kBinding = GL_BUFFER_BINDING;
      GLint binding = 0;
      gl.GetProgramResourceiv(program.get(), kind, i, 1, &kBinding, 1, nullptr, &binding);
      const bool isStorage = kind == GL_SHADER_STORAGE_BLOCK;
      const auto slot = static_cast<GLuint>(binding);
      if (isStorage ? slot >= SavedState::kStorageSlots : slot != SavedState::kUniformSlot) continue;
      const std::string at = "visibilityGlsl: " + std::string(isStorage ? "storage" : "uniform") + " block " + name +
                             " has binding " + std::to_string(slot) + " in " + std::string(path);
      return Error{ErrorCode::usage,
                   at + (isStorage ? ", one of Relume's (0 to " + std::to_string(SavedState::kStorageSlots - 1) +
                                         "): give it a later one, or make it a uniform block or a texture"
                                   : ", which is Relume's: give it another")};
    }
  }
  return done();
}

// Of a stage without the host's text.
Result<Shader> compile(const Functions& gl, GLenum stage, std::string_view path, Defines defines) {
  const Result<std::string> source = expandShader(path, defines);
  if (!source) return source.error();
  return compile(gl, stage, path, *source, "");
}

}  // namespace

Result<Program> makeComputeProgram(const Functions& gl, std::string_view path, Defines defines,
                                   std::string_view visibilityGlsl) {
  const std::string host = numbered(visibilityGlsl);
  const Result<std::string> source = expandShader(path, defines, host);
  if (!source) return source.error();
  const bool hasHost = !host.empty() && source->find(host) != std::string::npos;
  const auto shader =
      compile(gl, GL_COMPUTE_SHADER, path, *source, hasHost ? " (string 1 of its source is visibilityGlsl)" : "");
  if (!shader) return shader.error();
  const std::array<const Shader*, 1> shaders{&*shader};
  Result<Program> program = link(gl, path, shaders);
  if (!program || !hasHost) return program;
  if (Status ok = checkBindings(gl, path, *program); !ok) return ok.error();
  return program;
}

Result<Program> makeDrawProgram(const Functions& gl, std::string_view vertexPath, std::string_view fragmentPath,
                                Defines defines) {
  const auto vertex = compile(gl, GL_VERTEX_SHADER, vertexPath, defines);
  if (!vertex) return vertex.error();
  const auto fragment = compile(gl, GL_FRAGMENT_SHADER, fragmentPath, defines);
  if (!fragment) return fragment.error();
  const std::array<const Shader*, 2> shaders{&*vertex, &*fragment};
  return link(gl, fragmentPath, shaders);
}

}  // namespace relume::gl
