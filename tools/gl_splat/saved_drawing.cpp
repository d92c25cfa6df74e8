// SPDX-License-Identifier: MIT
// See saved_drawing.h.
#include "tools/gl_splat/saved_drawing.h"

#include "runtime/gl/saved_state.h"

namespace relume::gl {

const std::array<GLenum, SavedDrawing::kSwitches> SavedDrawing::kOff = {
    GL_DEPTH_TEST,     GL_STENCIL_TEST,   GL_CULL_FACE,      GL_RASTERIZER_DISCARD, GL_POLYGON_SMOOTH,
    GL_COLOR_LOGIC_OP, GL_CLIP_DISTANCE0, GL_CLIP_DISTANCE1, GL_CLIP_DISTANCE2,     GL_CLIP_DISTANCE3,
    GL_CLIP_DISTANCE4, GL_CLIP_DISTANCE5, GL_CLIP_DISTANCE6, GL_CLIP_DISTANCE7};

SavedDrawing::SavedDrawing(const Functions& gl, const DrawFunctions& draw)
    : gl_(gl),
      draw_(draw),
      drawFramebuffer_(integerOf(gl_, GL_DRAW_FRAMEBUFFER_BINDING)),
      readFramebuffer_(integerOf(gl_, GL_READ_FRAMEBUFFER_BINDING)),
      vertexArray_(integerOf(gl_, GL_VERTEX_ARRAY_BINDING)),
      scissors_(static_cast<std::size_t>(integerOf(gl_, GL_MAX_VIEWPORTS))) {
  gl_.GetIntegerv(GL_POLYGON_MODE, polygonMode_.data());
  draw_.GetFloati_v(GL_VIEWPORT, 0, viewport_.data());
  for (std::size_t i = 0; i < kSwitches; ++i) {
    switch_[i] = draw_.IsEnabled(kOff[i]);
    draw_.Disable(kOff[i]);
  }
  for (std::size_t i = 0; i < scissors_.size(); ++i)
    scissors_[i] = draw_.IsEnabledi(GL_SCISSOR_TEST, static_cast<GLuint>(i)) != GL_FALSE;
  // All of them: with that of viewport 0 alone off, Mesa 22.3's llvmpipe was seen to draw nothing.
  draw_.Disable(GL_SCISSOR_TEST);
  draw_.PolygonMode(GL_FRONT_AND_BACK, GL_FILL);
  for (GLuint i = 0; i < kTargets; ++i) {
    target_[i] = {draw_.IsEnabledi(GL_BLEND, i),
                  integerOf(gl_, GL_BLEND_EQUATION_RGB, i),
                  integerOf(gl_, GL_BLEND_EQUATION_ALPHA, i),
                  integerOf(gl_, GL_BLEND_SRC_RGB, i),
                  integerOf(gl_, GL_BLEND_DST_RGB, i),
                  integerOf(gl_, GL_BLEND_SRC_ALPHA, i),
                  integerOf(gl_, GL_BLEND_DST_ALPHA, i),
                  {}};
    draw_.GetBooleani_v(GL_COLOR_WRITEMASK, i, target_[i].mask.data());
    draw_.ColorMaski(i, GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  }
  if (draw_.ClipControl == nullptr) return;
  clipOrigin_ = integerOf(gl_, GL_CLIP_ORIGIN);
  clipDepth_ = integerOf(gl_, GL_CLIP_DEPTH_MODE);
  draw_.ClipControl(GL_LOWER_LEFT, GL_NEGATIVE_ONE_TO_ONE);
}

SavedDrawing::~SavedDrawing() {
  if (draw_.ClipControl != nullptr)
    draw_.ClipControl(static_cast<GLenum>(clipOrigin_), static_cast<GLenum>(clipDepth_));
  for (GLuint i = 0; i < kTargets; ++i) {
    const Target& t = target_[i];
    (t.blends != GL_FALSE ? draw_.Enablei : draw_.Disablei)(GL_BLEND, i);
    draw_.BlendEquationSeparatei(i, static_cast<GLenum>(t.colorEquation), static_cast<GLenum>(t.alphaEquation));
    draw_.BlendFuncSeparatei(i, static_cast<GLenum>(t.colorSource), static_cast<GLenum>(t.colorDestination),
                             static_cast<GLenum>(t.alphaSource), static_cast<GLenum>(t.alphaDestination));
    draw_.ColorMaski(i, t.mask[0], t.mask[1], t.mask[2], t.mask[3]);
  }
  draw_.PolygonMode(GL_FRONT_AND_BACK, static_cast<GLenum>(polygonMode_[0]));
  for (std::size_t i = 0; i < scissors_.size(); ++i) {
    if (scissors_[i]) draw_.Enablei(GL_SCISSOR_TEST, static_cast<GLuint>(i));
  }
  for (std::size_t i = 0; i < kSwitches; ++i) (switch_[i] != GL_FALSE ? draw_.Enable : draw_.Disable)(kOff[i]);
  draw_.ViewportIndexedfv(0, viewport_.data());
  draw_.BindVertexArray(static_cast<GLuint>(vertexArray_));
  draw_.BindFramebuffer(GL_READ_FRAMEBUFFER, static_cast<GLuint>(readFramebuffer_));
  draw_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, static_cast<GLuint>(drawFramebuffer_));
}

}  // namespace relume::gl
