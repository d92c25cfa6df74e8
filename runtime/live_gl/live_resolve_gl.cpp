// SPDX-License-Identifier: MIT
// See live_resolve_gl.h.
#include "runtime/live_gl/live_resolve_gl.h"

#include "runtime/gl/functions.h"
#include "runtime/shared/shader_text.h"

#include <glm/vec3.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kLongestPrefix = 64;
// Behind the prefix, in order of the units.
constexpr std::array<const char*, 3> kSamplers{"Cells", "SubVoxels", "Light"};

bool isLetter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
bool isOfIdentifier(char c) { return isLetter(c) || (c >= '0' && c <= '9') || c == '_'; }

// GLSL keeps names that begin with gl_, and those with two underscores in a row, for itself.
bool isPrefix(const std::string& prefix) {
  return !prefix.empty() && prefix.size() <= kLongestPrefix && isLetter(prefix[0]) &&
         std::all_of(prefix.begin(), prefix.end(), isOfIdentifier) && prefix.find("__") == std::string::npos &&
         !prefix.starts_with("gl_");
}

void replaceAll(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
}

// All types of samplers that OpenGL 4.3 has.
bool isSampler(GLenum type) {
  return (type >= GL_SAMPLER_1D && type <= GL_SAMPLER_2D_RECT_SHADOW) ||
         (type >= GL_SAMPLER_1D_ARRAY && type <= GL_SAMPLER_CUBE_SHADOW) ||
         (type >= GL_INT_SAMPLER_1D && type <= GL_UNSIGNED_INT_SAMPLER_BUFFER) ||
         (type >= GL_SAMPLER_CUBE_MAP_ARRAY && type <= GL_UNSIGNED_INT_SAMPLER_CUBE_MAP_ARRAY) ||
         (type >= GL_SAMPLER_2D_MULTISAMPLE && type <= GL_UNSIGNED_INT_SAMPLER_2D_MULTISAMPLE_ARRAY);
}

// OpenGL has an error for questions to what is none.
bool isLinked(const gl::Functions& gl, std::uint32_t program) {
  GLint status = GL_FALSE;
  if (gl.IsProgram(program) == GL_TRUE) gl.GetProgramiv(program, GL_LINK_STATUS, &status);
  return status == GL_TRUE;
}

// Constants are called k and the name.
std::string constantsOf(std::string prefix) {
  if (prefix[0] >= 'a') prefix[0] = static_cast<char>(prefix[0] - 'a' + 'A');
  return "k" + prefix;
}

}  // namespace

Status checkLiveGlNames(const gl::Functions& gl, const LiveGlNames& names) {
  const auto refused = [](std::string message) { return Error{ErrorCode::usage, "live light: " + std::move(message)}; };
  if (!isPrefix(names.prefix))
    return refused("glNames.prefix is \"" + names.prefix.substr(0, kLongestPrefix) +
                   "\", a letter expected, then letters, digits and single underscores, 64 at most, and not gl_");
  GLint most = 0;  // of all stages together
  gl.GetIntegerv(GL_MAX_COMBINED_TEXTURE_IMAGE_UNITS, &most);
  const auto& units = names.textureUnits;
  for (const std::uint32_t unit : units) {
    if (unit >= static_cast<std::uint32_t>(std::max(most, 0)))
      return refused("glNames.textureUnits has unit " + std::to_string(unit) + ", this OpenGL has " +
                     std::to_string(most) + ", from 0 on");
    if (std::count(units.begin(), units.end(), unit) > 1)
      return refused("glNames.textureUnits has unit " + std::to_string(unit) + " twice, three different ones expected");
  }
  return done();
}

Result<std::string> liveResolveGlsl(const LiveGlNames& names) {
  Result<std::string> text = expandShader("live_resolve.glsl", {});
  if (!text) return text;
  constexpr std::array<const char*, 3> textures{"CELLS", "SUB_VOXELS", "LIGHT"};
  for (std::size_t k = 0; k < textures.size(); ++k)
    replaceAll(*text, std::string("binding = RELUME_LIVE_UNIT_") + textures[k],
               "binding = " + std::to_string(names.textureUnits[k]));
  replaceAll(*text, "kRelumeLive", constantsOf(names.prefix));
  replaceAll(*text, "relumeLive", names.prefix);
  return text;
}

Status checkTextureUnits(const gl::Functions& gl, std::uint32_t program, const LiveGlNames& names) {
  if (!isLinked(gl, program))
    return Error{ErrorCode::usage, "live light: program " + std::to_string(program) + " is not a linked program"};
  GLint uniforms = 0, longest = 0;
  gl.GetProgramiv(program, GL_ACTIVE_UNIFORMS, &uniforms);
  gl.GetProgramiv(program, GL_ACTIVE_UNIFORM_MAX_LENGTH, &longest);
  std::string buffer(static_cast<std::size_t>(std::max(longest, 1)), '\0');
  for (GLint i = 0; i < uniforms; ++i) {
    GLsizei length = 0;
    GLint size = 0;
    GLenum type = 0;
    gl.GetActiveUniform(program, static_cast<GLuint>(i), longest, &length, &size, &type, buffer.data());
    if (!isSampler(type)) continue;
    std::string name = buffer.substr(0, static_cast<std::size_t>(length));
    const bool isOurs = std::any_of(kSamplers.begin(), kSamplers.end(),
                                    [&](const char* sampler) { return name == names.prefix + sampler; });
    if (isOurs) continue;
    if (name.ends_with("[0]")) name.resize(name.size() - 3);
    for (GLint k = 0; k < size; ++k) {
      const std::string element = size > 1 ? name + "[" + std::to_string(k) + "]" : name;
      GLint unit = 0;
      gl.GetUniformiv(program, gl.GetUniformLocation(program, element.c_str()), &unit);
      for (std::size_t own = 0; own < kSamplers.size(); ++own) {
        if (names.textureUnits[own] == static_cast<std::uint32_t>(unit))
          return Error{ErrorCode::usage, "live light: the shader's sampler " + element + " has texture unit " +
                                             std::to_string(unit) + ", which is that of " + names.prefix +
                                             kSamplers[own] + ": choose others (glNames.textureUnits)"};
      }
    }
  }
  return done();
}

bool hasResolvedVolumes(const gl::Functions& gl, std::uint32_t program, const std::string& prefix) {
  if (!isLinked(gl, program)) return false;
  const GLint location = gl.GetUniformLocation(program, (prefix + "Volumes").c_str());
  GLint volumes = 0;
  if (location >= 0) gl.GetUniformiv(program, location, &volumes);
  return volumes > 0;
}

void setResolvedVolumes(const gl::Functions& gl, std::uint32_t program, const std::string& prefix,
                        std::span<const ResolvedVolume> volumes) {
  const auto location = [&](const std::string& name) {
    return gl.GetUniformLocation(program, (prefix + name).c_str());
  };
  gl.ProgramUniform1i(program, location("Volumes"), static_cast<GLint>(volumes.size()));
  for (std::size_t i = 0; i < volumes.size(); ++i) {
    const ResolvedVolume& volume = volumes[i];
    const std::string element = "[" + std::to_string(i) + "]";
    const glm::vec3& origin = volume.grid.originWorld;
    const glm::uvec3 size(volume.grid.cells);
    gl.ProgramUniform3f(program, location("Origins" + element), origin.x, origin.y, origin.z);
    gl.ProgramUniform1f(program, location("Voxels" + element), volume.grid.voxel);
    gl.ProgramUniform3ui(program, location("Sizes" + element), size.x, size.y, size.z);
    gl.ProgramUniform1i(program, location("Layers" + element), volume.layer);
    const VolumeReach& reach = volume.reach;
    gl.ProgramUniform3f(program, location("Lows" + element), reach.low.x, reach.low.y, reach.low.z);
    gl.ProgramUniform3f(program, location("Highs" + element), reach.high.x, reach.high.y, reach.high.z);
  }
}

}  // namespace relume
