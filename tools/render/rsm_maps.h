// SPDX-License-Identifier: MIT
// Reflective shadow maps of a level's lights by rays (runtime/live/rsm_image.h), and what a camera sees as depths.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "runtime/live/occupancy.h"
#include "runtime/live/rsm_image.h"

#include <cstdint>
#include <vector>

namespace relume {

struct RsmMap {
  std::vector<RsmTexel> texel;
  std::uint32_t side = 0, faces = 1;
  RsmImage image() const { return {texel, side, faces}; }
};

// What each texel's middle sees, with the light of its solid angle or, of a directional light, of its area across the
// light. A spot's map is as wide as its outer cone, beyond 80 degrees and for point lights a cube. A directional
// light's holds the sphere around the level and stands at whole texels, so that it does not shimmer as the sphere
// moves. Incomplete when the context is cancelled.
RsmMap renderRsm(const RayTracer& tracer, const SceneLight& light, std::uint32_t side, Context& context);

// Depths of a camera's view, and the view itself, which reads them.
struct DepthPicture {
  std::vector<float> depth;
  DepthView view;
};
// Only the pixels that the view's stride looks at are traced, the others are 0. Incomplete when cancelled.
DepthPicture renderDepth(const RayTracer& tracer, const Camera& camera, std::uint32_t width, std::uint32_t height,
                         Context& context);

}  // namespace relume
