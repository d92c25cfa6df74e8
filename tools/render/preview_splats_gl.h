// SPDX-License-Identifier: MIT
// `relume preview --backend gl`: records splatted in OpenGL without a window.
#pragma once

#include "bake/preview/draw_splats.h"
#include "relume/result.h"

#include <memory>
#include <string>

namespace relume {

struct GlPreviewSplats {
  std::unique_ptr<SplatDrawer>
      drawer;            // owns its OpenGL context and makes it current; for the thread that made it alone
  std::string renderer;  // what OpenGL calls itself
};

// unsupported: no EGL, no OpenGL 4.3, or one that does not add up 32-bit floats.
Result<GlPreviewSplats> splatPreviewByGl();

}  // namespace relume
