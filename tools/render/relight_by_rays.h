// SPDX-License-Identifier: MIT
// The light of a request on the CPU, shadows by rays.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "relume/result.h"
#include "tools/render/render_frame.h"

namespace relume {

// relightRequest() with the CPU backend on the context's threads; `tracer` casts the shadows of the punctual lights.
// Without light where the context is cancelled meanwhile.
Result<Relit> relightByRays(const RayTracer& tracer, const RenderRequest& request, Context& context);

}  // namespace relume
