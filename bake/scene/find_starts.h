// SPDX-License-Identifier: MIT
// Where the walks of the play space start: cameras and play volumes, or free space when a level has neither.
#pragma once

#include "bake/context.h"
#include "bake/random.h"
#include "bake/scene/ray_tracer.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// A point where a receiver can be, and a first direction to look.
struct Start {
  glm::vec3 position{0.0f};   // [m]
  glm::vec3 direction{0.0f};  // unit
  bool known = true;          // in free space for sure; otherwise a start that sees a back face is inside a solid
};

// Points that see mostly fronts, within and around the level's bounds. Empty when there are none.
std::vector<glm::vec3> findFreePoints(const RayTracer& tracer, std::uint64_t seed, Context& context);

// Draw a start from the free points; from the scene's cameras (half of them looking through the frustum) and play
// volumes when there are no free points given. The scene must have one of them.
Start drawStart(const Scene& scene, std::span<const glm::vec3> freePoints, RandomStream& random);

// A uniformly distributed unit vector.
glm::vec3 uniformDirection(const glm::vec2& u);

}  // namespace relume
