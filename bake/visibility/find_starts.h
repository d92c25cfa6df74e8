// SPDX-License-Identifier: MIT
// Finds where the walks of the play space start: in the play volumes and at the cameras that count as play space, or in
// free space when a level has neither.
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
  bool known = true;          // surely in free space; otherwise a walk that first meets a back face started in a solid
};

// Points within and around the level's bounds from which rays meet mostly fronts. Empty when there are none.
std::vector<glm::vec3> findFreePoints(const RayTracer& tracer, std::uint64_t seed, Context& context);

// What starts are drawn from: the free points if there are any, otherwise cameras and play volumes.
struct StartSources {
  explicit StartSources(const Scene& scene);
  bool empty() const { return cameras.empty() && volumes.empty() && freePoints.empty(); }

  std::vector<Camera> cameras;  // Scene::playSpaceCameras()
  std::vector<PlayVolume> volumes;
  std::vector<glm::vec3> freePoints;  // [m] findFreePoints()
};

// Draw a start. Half of those at a camera look into its frustum, the others anywhere. The sources must not be empty.
Start drawStart(const StartSources& sources, RandomStream& random);

// A uniformly distributed unit vector.
glm::vec3 uniformDirection(const glm::vec2& u);

}  // namespace relume
