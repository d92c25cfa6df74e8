// SPDX-License-Identifier: MIT
// See cone_textures.h.
#include "runtime/live_gl/cone_textures.h"

#include "runtime/gl/errors.h"
#include "runtime/gl/plan_objects.h"
#include "shaders/shared/layout.h"

#include <glm/vec4.hpp>

namespace relume::gl {

Error conesError(ErrorCode code, const std::string& what) { return {code, "cones: " + what}; }

Status checkConeTexture(const Functions& gl, GLuint name, const char* what, const glm::ivec2& size, bool isSigned) {
  const auto wrong = [&](const std::string& why) {
    return conesError(ErrorCode::usage, std::string(what) + ": texture " + std::to_string(name) + " " + why);
  };
  gl.ActiveTexture(GL_TEXTURE0 + RELUME_CONE_UNIT_NORMALS);
  GLint now = 0;
  if (name != 0 && gl.IsTexture(name) == GL_TRUE) {
    gl.BindTexture(GL_TEXTURE_2D, name);
    gl.GetIntegerv(GL_TEXTURE_BINDING_2D, &now);
  }
  if (name == 0 || static_cast<GLuint>(now) != name) {
    gl.GetError();  // of binding a texture that is of another kind
    return wrong("is no GL_TEXTURE_2D");
  }
  glm::ivec2 found(0);
  GLint type = 0;
  gl.GetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_WIDTH, &found.x);
  gl.GetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_HEIGHT, &found.y);
  gl.GetTexLevelParameteriv(GL_TEXTURE_2D, 0, GL_TEXTURE_RED_TYPE, &type);
  if (found != size)
    return wrong("has " + std::to_string(found.x) + " x " + std::to_string(found.y) + " texels, expected " +
                 std::to_string(size.x) + " x " + std::to_string(size.y));
  if (type != GL_FLOAT && !(isSigned && type == GL_SIGNED_NORMALIZED)) return wrong("is not of floats");
  return done();
}

Result<std::vector<RsmMaps::Map>> checkConeMaps(const Functions& gl, std::span<const RsmTextures> maps,
                                                float largestFlux) {
  if (!(largestFlux >= 0.0f && largestFlux <= kMaxRsmFlux))
    return conesError(ErrorCode::usage, "largestFlux is outside of 0 to 1e30");
  std::vector<RsmMaps::Map> checked;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    const RsmTextures& map = maps[i];
    const std::string name = "reflective shadow map " + std::to_string(i);
    if (Status ok = checkRsmSize(i, map.side, map.faces); !ok) return ok.error();
    const glm::ivec2 size(static_cast<int>(map.side), static_cast<int>(map.faces * map.side));
    if (Status ok = checkConeTexture(gl, map.places, (name + ", places").c_str(), size, false); !ok) return ok.error();
    if (Status ok = checkConeTexture(gl, map.normals, (name + ", normals").c_str(), size, true); !ok) return ok.error();
    if (Status ok = checkConeTexture(gl, map.flux, (name + ", flux").c_str(), size, false); !ok) return ok.error();
    checked.push_back({map.places, map.normals, map.flux, map.side, map.faces * map.side});
  }
  return checked;
}

Result<std::vector<RsmMaps::Map>> ConeMaps::upload(std::span<const RsmImage> from) {
  const auto most = deviceOf(gl_, gpu::GroupThreads::parallel).imageSide;
  std::vector<glm::vec4> texels;
  std::vector<RsmMaps::Map> uploaded;
  if (maps_.size() < from.size()) maps_.resize(from.size());
  for (std::size_t i = 0; i < from.size(); ++i) {
    const RsmImage& image = from[i];
    if (image.faces * image.side > most)
      return conesError(ErrorCode::unsupported,
                        "reflective shadow map " + std::to_string(i) + " has " + std::to_string(image.faces) +
                            " faces of " + std::to_string(image.side) +
                            " texels along a side, this OpenGL's textures " + std::to_string(most) + " in all");
    const glm::ivec2 size(static_cast<int>(image.side), static_cast<int>(image.faces * image.side));
    Images& to = maps_[i];
    if (to.size != size) {
      dropErrors(gl_);
      Images made;
      for (Texture& texture : made.texture) {
        texture = makeTexture(gl_, GL_TEXTURE_2D);
        gl_.TexStorage2D(GL_TEXTURE_2D, 1, GL_RGBA32F, size.x, size.y);
      }
      if (takeOutOfMemory(gl_))
        return conesError(ErrorCode::unsupported, "this OpenGL has not enough memory for reflective shadow map " +
                                                      std::to_string(i) + " of " + std::to_string(image.side) +
                                                      " texels along a side");
      made.size = size;
      to = std::move(made);
    }
    const auto write = [&](const Texture& texture, const auto& texelAt) {
      texels.clear();
      texels.reserve(image.texel.size());
      for (const RsmTexel& texel : image.texel) texels.push_back(texel.area > 0.0f ? texelAt(texel) : glm::vec4(0.0f));
      gl_.ActiveTexture(GL_TEXTURE0 + RELUME_CONE_UNIT_RSM_PLACES);
      gl_.BindTexture(GL_TEXTURE_2D, texture.get());
      gl_.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, size.x, size.y, GL_RGBA, GL_FLOAT, texels.data());
    };
    write(to.texture[0], [](const RsmTexel& texel) { return glm::vec4(texel.positionWorld, texel.area); });
    write(to.texture[1], [](const RsmTexel& texel) { return glm::vec4(texel.normal, 0.0f); });
    write(to.texture[2], [](const RsmTexel& texel) { return glm::vec4(texel.flux, 0.0f); });
    uploaded.push_back(
        {to.texture[0].get(), to.texture[1].get(), to.texture[2].get(), image.side, image.faces * image.side});
  }
  return uploaded;
}

std::size_t ConeMaps::bytes() const {
  std::size_t texels = 0;
  for (const Images& map : maps_) texels += static_cast<std::size_t>(map.size.x) * static_cast<std::size_t>(map.size.y);
  return 3 * sizeof(glm::vec4) * texels;
}

}  // namespace relume::gl
