// SPDX-License-Identifier: MIT
// The tiles of sub-pixels that an image is drawn in by OpenGL: where they lie, what each sees, what it is drawn into.
#pragma once

#include "runtime/live_gl/cones_gl.h"
#include "tools/gl_scene/draw_targets.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/render/render_frame.h"

#include <glm/mat4x4.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kRenderTile = 1024;  // sub-pixels a side

// What a tile is drawn into.
class TileTargets : public DrawTargets {
 public:
  using DrawTargets::DrawTargets;
  // What cones start from, as drawn with renderSurfaces.
  PixelTextures surfaces(bool mirrors) const {
    return {width(), height(), texture(0), texture(1), texture(2), mirrors ? texture(3) : 0u};
  }
  // Pixels of one target, row 0 at the bottom.
  void read(int target, std::uint32_t width, std::uint32_t height, std::vector<glm::vec4>& pixels) const {
    pixels.resize(std::size_t{width} * height);
    glReadBuffer(GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(target));
    glReadPixels(0, 0, static_cast<GLsizei>(width), static_cast<GLsizei>(height), GL_RGBA, GL_FLOAT, pixels.data());
  }
};

// A rectangle of pixels of the image.
struct Tile {
  std::uint32_t x = 0, y = 0, width = 0, height = 0;
};

// The tiles of an image with so many sub-pixels along a pixel's side.
std::vector<Tile> tilesOf(const RenderRequest& request, std::uint32_t samples);

// What a tile sees, y up, from the camera's place. Near and far enclose the level.
LevelView tileView(const RenderRequest& request, const GlLevel& level, const Tile& tile);

}  // namespace relume
