// SPDX-License-Identifier: MIT
// See coarse_frames.h.
#include "tools/view/coarse_frames.h"

#include "tools/gl_scene/draw_targets.h"
#include "tools/render/live_level.h"

namespace relume {
namespace {

constexpr double kSlowMs = 100.0;  // of a whole frame
constexpr double kQuick = 0.5;     // share of that below which slow frames count as quick again
constexpr double kWhole = 3.0;     // times as long as one of a quarter of the pixels, whose triangles are as many

}  // namespace

bool CoarseFrames::isWanted(const ViewState& state) {
  const Seen now{state.camera, activeLights(state), movesOf(state)};
  const bool moves =
      !last_ || now.camera != last_->camera || now.moves != last_->moves || !areSame(now.lights, last_->lights);
  last_ = now;
  // Records and cones keep what they have found by pixels of the window.
  const bool keepsPixels = state.records || state.cones || state.mode == ViewMode::occlusion;
  return state.coarse && isSlow_ && moves && !keepsPixels;
}

std::optional<CoarseFrames::Target> CoarseFrames::begin(std::uint32_t width, std::uint32_t height) {
  const std::uint32_t halfWidth = (width + 1) / 2, halfHeight = (height + 1) / 2;
  if (halfWidth != width_ || halfHeight != height_) {
    color_ = makeTexture(GL_RGBA8, halfWidth, halfHeight);
    depth_ = makeTexture(GL_DEPTH_COMPONENT32F, halfWidth, halfHeight);
    framebuffer_ = GlFramebuffer::make();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, color_.name(), 0);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth_.name(), 0);
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) return std::nullopt;
    width_ = halfWidth;
    height_ = halfHeight;
  }
  return Target{framebuffer_.name(), width_, height_};
}

void CoarseFrames::end(GLuint framebuffer, std::uint32_t width, std::uint32_t height) const {
  glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer_.name());
  glBindFramebuffer(GL_DRAW_FRAMEBUFFER, framebuffer);
  glBlitFramebuffer(0, 0, static_cast<GLint>(width_), static_cast<GLint>(height_), 0, 0, static_cast<GLint>(width),
                    static_cast<GLint>(height), GL_COLOR_BUFFER_BIT, GL_LINEAR);
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glViewport(0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height));
}

void CoarseFrames::tell(double drawMs, bool wasCoarse) {
  isSlow_ = (wasCoarse ? kWhole : 1.0) * drawMs > (isSlow_ ? kQuick : 1.0) * kSlowMs;
}

}  // namespace relume
