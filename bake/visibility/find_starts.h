// SPDX-License-Identifier: MIT
// Where the walks of the play space start: in the play volumes; at the cameras when there are none; in free space when
// a level has neither.
#pragma once

#include "bake/base/random.h"
#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"

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

// What starts are drawn from: the free points when there are any, else cameras and play volumes, of which there must be
// one then.
struct StartPlaces {
  explicit StartPlaces(const Scene& scene);
  bool empty() const { return cameras.empty() && volumes.empty() && freePoints.empty(); }

  std::vector<Camera> cameras;  // Scene::playSpaceCameras()
  std::vector<PlayVolume> volumes;
  std::vector<glm::vec3> freePoints;  // [m] findFreePoints()
};

// Draw a start; half of those at a camera look through its frustum.
Start drawStart(const StartPlaces& places, RandomStream& random);

// A uniformly distributed unit vector.
glm::vec3 uniformDirection(const glm::vec2& u);

}  // namespace relume
