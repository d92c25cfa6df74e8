// SPDX-License-Identifier: MIT
// See check_textures.h.
#include "runtime/gl/check_textures.h"

#include "runtime/gl/saved_state.h"

#include <algorithm>
#include <string>

namespace relume::gl {
namespace {

// What is wrong with the texture that is bound; empty when nothing is.
std::string wrongWith(const Functions& gl, const glm::uvec2& size) {
  const auto sizeOf = [&gl](GLint level) {
    GLint width = 0, height = 0;
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D, level, GL_TEXTURE_WIDTH, &width);
    gl.GetTexLevelParameteriv(GL_TEXTURE_2D, level, GL_TEXTURE_HEIGHT, &height);
    return glm::uvec2(static_cast<GLuint>(width), static_cast<GLuint>(height));
  };
  const auto text = [](const glm::uvec2& s) { return std::to_string(s.x) + " x " + std::to_string(s.y); };
  if (sizeOf(0) != size)
    return "has " + text(sizeOf(0)) + " texels, expected the " + text(size) + " that were declared";
  GLint type = GL_NONE;
  gl.GetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_RED_TYPE, &type);
  if (type != GL_FLOAT && type != GL_UNSIGNED_NORMALIZED && type != GL_SIGNED_NORMALIZED)
    return "has no colours that filter, expected floats or normalised numbers";
  // The last level: a chain that ends before is read as black.
  GLint last = 0;
  while (std::max(size.x, size.y) >> (last + 1) != 0) ++last;
  if (sizeOf(last) != glm::uvec2(1u, 1u)) return "has no mip levels down to one texel: call glGenerateMipmap()";
  return {};
}

}  // namespace

Status checkTextures(const Functions& gl, const LightSetup& setup, const ImageSizes& sizes) {
  GLint bound = -1;
  std::string wrong;
  for (const MaterialEmission& emission : setup.materialEmissions) {
    if (emission.texture == 0) continue;
    if (bound < 0) gl.GetIntegerv(GL_TEXTURE_BINDING_2D, &bound);
    GLint now = 0;
    if (gl.IsTexture(emission.texture) == GL_TRUE) {
      gl.BindTexture(GL_TEXTURE_2D, emission.texture);
      gl.GetIntegerv(GL_TEXTURE_BINDING_2D, &now);
    }
    if (static_cast<GLuint>(now) != emission.texture) {
      gl.GetError();  // of binding a texture that is of another kind
      wrong = "is no GL_TEXTURE_2D";
    } else {
      wrong = wrongWith(gl, sizes[emission.material]);
    }
    if (wrong.empty()) continue;
    gl.BindTexture(GL_TEXTURE_2D, textureAgain(gl, bound));
    return Error{ErrorCode::usage, "light setup: materialEmissions[" +
                                       std::to_string(&emission - setup.materialEmissions.data()) + "].texture " +
                                       std::to_string(emission.texture) + " " + wrong};
  }
  if (bound >= 0) gl.BindTexture(GL_TEXTURE_2D, textureAgain(gl, bound));
  return done();
}

}  // namespace relume::gl
