// SPDX-License-Identifier: MIT
// The light of NestedCaches's caches in OpenGL: textures of what liveResolveGlsl() reads, as
// NestedCaches::irradiance() does (runtime/live/nested_caches.h); a test compares the two.
#pragma once

#include "runtime/live/nested_caches.h"
#include "runtime/live_gl/live_resolve_gl.h"
#include "tools/gl_scene/gl_handle.h"

#include <glm/vec4.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace relume {

// What the textures hold, copied so that another thread may go on with the light.
struct LiveTexels {
  std::vector<ResolvedVolume> volumes;  // from the outermost on
  glm::ivec3 size{1};                   // of the cells' texture
  std::vector<glm::uvec4> cell;         // cellTexels() of all, numbers and slots counted through
  std::vector<glm::uvec4> subVoxels;    // subVoxelTexels() of all
  std::vector<std::array<glm::vec4, 7>>
      light;  // [Size caches, before them the sky's as shaders read it] red, green and blue of nine coefficients, one
              // after the other, then the brightest ray's largest channel [W/m²/sr]
};
LiveTexels texelsOf(const NestedCaches& light);

class LiveField {
 public:
  // failed: the driver's textures are too small.
  static Result<LiveField> create(const LiveGlNames& names = {});
  // Until the first call there is no light. failed: OpenGL has no memory for it; what there was is gone.
  Status upload(const LiveTexels& texels);
  // Tell a program that contains liveResolveGlsl() by these names where the volumes are.
  void setUniforms(GLuint program) const;
  // Bind the textures to the names' units.
  void bind() const;
  bool isLit() const { return !volumes_.empty(); }

 private:
  explicit LiveField(const LiveGlNames& names) : names_(names) {}

  LiveGlNames names_;
  GlTexture cells_, subVoxels_, light_;
  std::vector<ResolvedVolume> volumes_;  // none where there is no light
};

}  // namespace relume
