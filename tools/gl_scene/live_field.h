// SPDX-License-Identifier: MIT
// The light of LiveCaches's caches in OpenGL: textures of what LiveCachesGl::glsl() reads, as LiveCaches::irradiance()
// does (runtime/live/live_caches.h); a test compares the two.
#pragma once

#include "runtime/live/live_caches.h"
#include "tools/gl_scene/gl_handle.h"

#include <glm/vec4.hpp>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace relume {

// What the textures hold, copied so that another thread may go on with the light.
struct LiveTexels {
  VolumeGrid grid;
  std::vector<glm::uvec4> cell;                   // cellTexels()
  std::vector<std::array<std::int8_t, 4>> plane;  // as CellSet::plane
  std::vector<std::array<glm::vec4, 7>> light;    // [Size caches] red, green and blue of nine coefficients, one after
                                                  // the other, then the brightest ray's largest channel [W/m²/sr]
};
LiveTexels texelsOf(const LiveCaches& light);

class LiveField {
 public:
  // failed: the driver's textures are too small.
  static Result<LiveField> create();
  // Until the first call there is no light. failed: OpenGL has no memory for it; what there was is gone.
  Status upload(const LiveTexels& texels);
  // Tell a program that contains LiveCachesGl::glsl() where the grid is.
  void setUniforms(GLuint program) const;
  // Bind the textures to kUnits.
  void bind() const;

  static constexpr std::array<GLuint, 3> kUnits{12, 13, 14};  // those of the runtime's resolve, which it replaces

 private:
  LiveField() = default;

  GlTexture cells_, planes_, light_;
  VolumeGrid grid_;
  bool isLit_ = false;
};

}  // namespace relume
