// SPDX-License-Identifier: MIT
// Frames of half as many pixels along each side while what is seen moves, where a whole frame takes long, as it does
// where a processor draws. The first frame after it has come to rest is whole.
#pragma once

#include "tools/gl_scene/gl_handle.h"
#include "tools/view/view_state.h"

#include <cstdint>
#include <optional>
#include <vector>

namespace relume {

class CoarseFrames {
 public:
  // Before any frame has been timed: a whole one will take long.
  void expectSlow() { isSlow_ = true; }
  // Whether this frame is to be coarse. Once a frame.
  bool isWanted(const ViewState& state);

  struct Target {
    GLuint framebuffer = 0;
    std::uint32_t width = 0, height = 0;
  };
  // To draw a frame of a window of this size into; nothing where OpenGL cannot.
  std::optional<Target> begin(std::uint32_t width, std::uint32_t height);
  // And to enlarge it into the window's framebuffer, which is bound then.
  void end(GLuint framebuffer, std::uint32_t width, std::uint32_t height) const;
  // What drawing a frame took.
  void tell(double drawMs, bool wasCoarse);

 private:
  // What a view shows, as far as dragging and flying change it.
  struct Seen {
    FlyCamera camera;
    std::vector<Light> lights;
    std::vector<glm::mat4> moves;
  };

  bool isSlow_ = false;
  std::optional<Seen> last_;
  GlTexture color_, depth_;
  GlFramebuffer framebuffer_;
  std::uint32_t width_ = 0, height_ = 0;
};

}  // namespace relume
