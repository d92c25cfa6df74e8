// SPDX-License-Identifier: MIT
// A view of a level that has no camera.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/result.h"

namespace relume {

struct FramedView {
  glm::vec3 eye{0.0f}, target{0.0f};  // [m]
};

// Where to look from: outside, so that the whole level fits the image, if fronts of surfaces show there; else from
// within, out of a play volume or of the middle of the level's air. failed: Embree's message.
Result<FramedView> frameLevel(const Scene& scene, float yfovRad, float aspect, Context& context);

}  // namespace relume
