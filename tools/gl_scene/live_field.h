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

// The names and texture units of a light in GLSL, where a shader reads several.
struct LiveNames {
  const char* prefix = "relumeLive";        // of all names
  std::array<GLuint, 3> units{12, 13, 14};  // those of the runtime's resolve, which it replaces
  // LiveCachesGl::glsl() by these.
  Result<std::string> glsl() const;
};

class LiveField {
 public:
  // failed: the driver's textures are too small.
  static Result<LiveField> create(const LiveNames& names = {});
  // Until the first call there is no light. failed: OpenGL has no memory for it; what there was is gone.
  Status upload(const LiveTexels& texels);
  // Tell a program that contains the names' GLSL where the grid is.
  void setUniforms(GLuint program) const;
  // Bind the textures to the names' units.
  void bind() const;
  bool isLit() const { return isLit_; }

 private:
  explicit LiveField(const LiveNames& names) : names_(names) {}

  LiveNames names_;
  GlTexture cells_, planes_, light_;
  VolumeGrid grid_;
  bool isLit_ = false;
};

}  // namespace relume
