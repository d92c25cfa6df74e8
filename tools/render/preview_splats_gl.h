// SPDX-License-Identifier: MIT
// `relume preview --backend gl`: records splatted in OpenGL without a window.
#pragma once

#include "bake/preview/draw_splats.h"
#include "relume/result.h"

#include <memory>
#include <string>

namespace relume {

struct GlPreviewSplats {
  // Both own an OpenGL context and make it current; for the thread that made them alone.
  std::shared_ptr<SplatDrawer> drawer;
  DrawMirrors mirrors;
  std::string renderer;  // what OpenGL calls itself
};

// unsupported: no EGL, no OpenGL 4.3, or one that does not add up 32-bit floats.
Result<GlPreviewSplats> splatPreviewByGl();

}  // namespace relume
