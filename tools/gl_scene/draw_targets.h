// SPDX-License-Identifier: MIT
// Textures that are drawn into.
#pragma once

#include "tools/gl_scene/gl_handle.h"

#include <array>
#include <cstddef>
#include <cstdint>

namespace relume {

// A texture of one level that is read texel by texel [pixel]. Leaves nothing bound to GL_TEXTURE_2D of the active unit.
GlTexture makeTexture(GLenum format, std::uint32_t width, std::uint32_t height);

// Four targets of four floats and a depth buffer.
class DrawTargets {
 public:
  DrawTargets() = default;
  DrawTargets(std::uint32_t width, std::uint32_t height);
  // Whether the driver can draw into them; they are bound.
  bool complete() const { return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE; }
  // Bound and cleared, for opaque surfaces of which the nearest counts; so much of them is drawn into [pixel].
  void begin(std::uint32_t width, std::uint32_t height) const;
  std::uint32_t width() const { return width_; }
  std::uint32_t height() const { return height_; }
  GLuint texture(std::size_t target) const { return textures_[target].name(); }

 private:
  std::uint32_t width_ = 0, height_ = 0;
  GlFramebuffer framebuffer_;
  std::array<GlTexture, 4> textures_;
  GlTexture depth_;
};

}  // namespace relume
