// SPDX-License-Identifier: MIT
// Textures that cones take: a host's, looked at before they are read, and reflective shadow maps of the CPU's,
// uploaded. State must be saved around all of it.
#pragma once

#include "relume/result.h"
#include "runtime/live_gl/cone_levels_gl.h"
#include "runtime/live_gl/cones_gl.h"

#include <glm/vec2.hpp>

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace relume::gl {

// "cones: what"
Error conesError(ErrorCode code, const std::string& what);

// Whether a texture of the host's is what `what` has to be. isSigned: signed numbers will do in place of floats. usage:
// it is not.
Status checkConeTexture(const Functions& gl, GLuint name, const char* what, const glm::ivec2& size, bool isSigned);
// A host's maps as passes read them. usage: as ConesGl::fill().
Result<std::vector<RsmMaps::Map>> checkConeMaps(const Functions& gl, std::span<const RsmTextures> maps,
                                                float largestFlux);

// The CPU's maps as textures, which are kept from frame to frame.
class ConeMaps {
 public:
  explicit ConeMaps(const Functions& gl) : gl_(gl) {}
  // unsupported: more texels than this OpenGL holds. Throws std::bad_alloc. [checkRsm()]
  Result<std::vector<RsmMaps::Map>> upload(std::span<const RsmImage> from);
  std::size_t bytes() const;

 private:
  // Places and areas, normals, flux.
  struct Images {
    glm::ivec2 size{0};
    std::array<Texture, 3> texture;
  };

  const Functions& gl_;
  std::vector<Images> maps_;
};

}  // namespace relume::gl
