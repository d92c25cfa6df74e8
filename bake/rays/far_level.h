// SPDX-License-Identifier: MIT
// A level that lies too far out for its size.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/scene.h"

namespace relume {

// Warn of one, all that is drawn counted. For who draws it without rays: RayTracer::create() does so itself.
void warnOfFarLevel(const Scene& scene, Context& context);

}  // namespace relume
