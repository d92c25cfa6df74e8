// SPDX-License-Identifier: MIT
// The light of NestedCaches's caches in OpenGL: textures of what LiveCachesGl::glsl() reads, as
// NestedCaches::irradiance() does (runtime/live/nested_caches.h); a test compares the two.
#pragma once

#include "runtime/live/nested_caches.h"
#include "tools/gl_scene/gl_handle.h"

#include <glm/vec4.hpp>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace relume {

// What the textures hold, copied so that another thread may go on with the light.
struct LiveTexels {
  struct Volume {
    VolumeGrid grid;
    int layer = 0;           // of the cells' texture, at which its own begin
    std::uint32_t open = 0;  // openFaces()
  };
  std::vector<Volume> volumes;                    // from the outermost on
  glm::ivec3 size{1};                             // of the cells' texture
  std::vector<glm::uvec4> cell;                   // cellTexels() of all, numbers and slots counted through
  std::vector<std::array<std::int8_t, 4>> plane;  // as CellSet::plane, of all
  std::vector<std::array<glm::vec4, 7>> light;    // [Size caches] red, green and blue of nine coefficients, one after
                                                  // the other, then the brightest ray's largest channel [W/m²/sr]
};
LiveTexels texelsOf(const NestedCaches& light);

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
  // Tell a program that contains the names' GLSL where the volumes are.
  void setUniforms(GLuint program) const;
  // Bind the textures to the names' units.
  void bind() const;
  bool isLit() const { return !volumes_.empty(); }

 private:
  explicit LiveField(const LiveNames& names) : names_(names) {}

  LiveNames names_;
  GlTexture cells_, planes_, light_;
  std::vector<LiveTexels::Volume> volumes_;  // none where there is no light
};

}  // namespace relume
