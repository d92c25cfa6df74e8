// SPDX-License-Identifier: MIT
// Whether a point of a surface sees a cache of the light map that stands near it on the same surface.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/caches.h"

#include <glm/geometric.hpp>

#include <cstdint>

namespace relume {

inline bool seesCache(const RayTracer& tracer, const Caches& caches, std::uint32_t cache,
                      const glm::vec3& positionWorld, const glm::vec3& normal) {
  constexpr float kLift = 0.2f;  // of the distance: sight passes over skirting boards and bulges of a floor
  const glm::vec3 to = caches.positionWorld[cache];
  const float lift = kLift * glm::distance(to, positionWorld) + tracer.epsilonAt(positionWorld);
  const glm::vec3 from = positionWorld + lift * normal, way = to + lift * caches.normal[cache] - from;
  const float length = glm::length(way);
  return !(length > 0.0f) || !tracer.occluded({from, 0.0f, way / length, length});
}

}  // namespace relume
