// SPDX-License-Identifier: MIT
// See draw_targets.h.
#include "tools/gl_scene/draw_targets.h"

namespace relume {

GlTexture makeTexture(GLenum format, std::uint32_t width, std::uint32_t height) {
  GlTexture made = GlTexture::make();
  glBindTexture(GL_TEXTURE_2D, made.name());
  glTexStorage2D(GL_TEXTURE_2D, 1, format, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glBindTexture(GL_TEXTURE_2D, 0);
  return made;
}

DrawTargets::DrawTargets(std::uint32_t width, std::uint32_t height)
    : width_(width), height_(height), framebuffer_(GlFramebuffer::make()) {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  std::array<GLenum, 4> buffers{};
  for (std::size_t i = 0; i < buffers.size(); ++i) {
    textures_[i] = makeTexture(GL_RGBA32F, width, height);
    buffers[i] = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i);
    glFramebufferTexture2D(GL_FRAMEBUFFER, buffers[i], GL_TEXTURE_2D, textures_[i].name(), 0);
  }
  depth_ = makeTexture(GL_DEPTH_COMPONENT32F, width, height);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth_.name(), 0);
  glDrawBuffers(static_cast<GLsizei>(buffers.size()), buffers.data());
}

void DrawTargets::begin(std::uint32_t width, std::uint32_t height) const {
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  glViewport(0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glDepthMask(GL_TRUE);
  glDisable(GL_CULL_FACE);
  glDisable(GL_BLEND);
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glClearDepth(1.0);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

}  // namespace relume
