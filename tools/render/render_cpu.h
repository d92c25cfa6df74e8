// SPDX-License-Identifier: MIT
// `relume render --backend cpu`: primary and shadow rays by Embree, light over links by the runtime's CPU backend.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "tools/render/render_frame.h"

namespace relume {

// Draw a frame. The bake must be of this scene. Errors of the relighter; failed when cancelled. The same numbers at any
// thread count.
Result<RenderedFrame> renderCpu(const RayTracer& tracer, const RenderRequest& request, Context& context);

}  // namespace relume
