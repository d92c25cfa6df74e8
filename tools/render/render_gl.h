// SPDX-License-Identifier: MIT
// `relume render --backend gl`: OpenGL through EGL without a window, shadow maps, the runtime's GL backend.
#pragma once

#include "tools/render/render_frame.h"

namespace relume {

// Draw a frame. The bake must be of this scene. unsupported: no EGL or no OpenGL 4.3; errors of the relighter; failed
// when cancelled.
Result<RenderedFrame> renderGl(const Scene& scene, const RenderRequest& request, Context& context);

}  // namespace relume
