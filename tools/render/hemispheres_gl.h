// SPDX-License-Identifier: MIT
// `relume preview --backend gl`: surroundings of records drawn in OpenGL without a window.
#pragma once

#include "bake/preview/draw_hemispheres.h"
#include "bake/preview/preview.h"
#include "relume/bake/scene.h"
#include "relume/result.h"

#include <cstdint>
#include <span>
#include <string>

namespace relume {

struct GlHemispheres {
  DrawHemispheres draw;  // owns its OpenGL context and makes it current; for the thread that made it alone
  std::string renderer;  // what OpenGL calls itself
};

// Of a scene lit by punctual lights, whose light is reflected once. options: the plane's side and angle. shadowSize
// [64..8192] texels. unsupported: no EGL or no OpenGL 4.3; usage: more lights than there are shadow maps; failed: out
// of GPU memory.
Result<GlHemispheres> drawHemispheresByGl(const Scene& scene, std::span<const SceneLight> lights,
                                          const PreviewOptions& options, std::uint32_t shadowSize);

}  // namespace relume
