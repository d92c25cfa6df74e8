// SPDX-License-Identifier: MIT
// What drawing into one's own targets sets, put back when it is done; runtime/gl/saved_state.h has the rest.
#pragma once

#include "runtime/gl/functions.h"

#include <array>
#include <cstddef>
#include <vector>

namespace relume::gl {

// Remembers on construction and restores on destruction: both framebuffers, the vertex array, viewport 0, the clip
// control, the polygon mode; of draw buffers 0 and 1 the blending and its functions and the colour mask; and what it
// turns off: depth and stencil test, culling, scissors, clip distances, smooth polygons, logical operations, which put
// an end to blending, and the discarding of all that is drawn.
class SavedDrawing {
 public:
  static constexpr GLuint kTargets = 2;

  SavedDrawing(const Functions& gl, const DrawFunctions& draw);
  ~SavedDrawing();
  SavedDrawing(const SavedDrawing&) = delete;
  SavedDrawing& operator=(const SavedDrawing&) = delete;

 private:
  struct Target {
    GLboolean blends = GL_FALSE;
    GLint colorEquation = 0, alphaEquation = 0, colorSource = 0, colorDestination = 0, alphaSource = 0,
          alphaDestination = 0;
    std::array<GLboolean, 4> mask{};
  };
  static constexpr std::size_t kSwitches = 14;
  static const std::array<GLenum, kSwitches> kOff;

  const Functions& gl_;
  const DrawFunctions& draw_;
  GLint drawFramebuffer_ = 0, readFramebuffer_ = 0, vertexArray_ = 0, clipOrigin_ = 0, clipDepth_ = 0;
  std::array<GLint, 2> polygonMode_{};  // of the front, which is that of both in core contexts
  std::array<GLfloat, 4> viewport_{};
  std::vector<bool> scissors_;  // of each viewport
  std::array<GLboolean, kSwitches> switch_{};
  std::array<Target, kTargets> target_;
};

}  // namespace relume::gl
