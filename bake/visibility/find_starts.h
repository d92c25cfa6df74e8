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
  // Surely in free space. Otherwise a walk that first meets a back face started in a solid, or, if the face shows both
  // sides, did so where isHidden().
  bool known = true;
  bool mayBeHidden = false;  // drawn from a play volume most of which is not hidden
};

// Points within and around the level's bounds from which rays meet mostly fronts. Empty when there are none.
std::vector<glm::vec3> findFreePoints(const RayTracer& tracer, std::uint64_t seed, Context& context);

// Whether nearly all that is seen from a point is backs of triangles that show both sides: the inside of an open shell,
// as of a vase or a head, which nobody means to be seen although its material would show it.
bool isHidden(const RayTracer& tracer, const glm::vec3& point);

// What starts are drawn from: the free points if there are any, otherwise cameras and play volumes.
struct StartSources {
  explicit StartSources(const Scene& scene);
  // Find in which play volumes hidden points are starts like others, since most of a volume is hidden: a room that is
  // modelled from outside. Without this call they are in all.
  void findHidden(const RayTracer& tracer, std::uint64_t seed, Context& context);
  bool empty() const { return cameras.empty() && volumes.empty() && freePoints.empty(); }

  std::vector<Camera> cameras;  // Scene::playSpaceCameras()
  std::vector<PlayVolume> volumes;
  std::vector<std::uint8_t> leavesOutHidden;  // by volume, 1 = its hidden points are no starts; empty = in none
  std::vector<glm::vec3> freePoints;          // [m] findFreePoints()
};

// Draw a start. Half of those at a camera look into its frustum, the others anywhere. The sources must not be empty.
Start drawStart(const StartSources& sources, RandomStream& random);

// A uniformly distributed unit vector.
glm::vec3 uniformDirection(const glm::vec2& u);

}  // namespace relume
