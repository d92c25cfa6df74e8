// SPDX-License-Identifier: MIT
// How well a surfel stands for a point of a surface: what the map from hits to surfels minimises.
#pragma once

#include "bake/surfels/neighbours.h"
#include "bake/surfels/surface_sampler.h"

#include <cstdint>
#include <limits>

namespace relume {

inline constexpr float kNoMapping = std::numeric_limits<float>::infinity();

// A point of a surface, or a surfel, as the cost sees it.
struct MapPoint {
  glm::vec3 positionWorld, normal;
  std::uint32_t instance, emits;  // emits: 0 or 1
};

inline MapPoint mapPoint(const SurfaceSample& s) {
  return {s.positionWorld, s.normal, s.point.instance, s.emitter != kReflector ? 1u : 0u};
}

// [m²] Squared distance, plus: heights over the other's plane, which part thin layers, counted kHeight times; the
// angle between the normals; kForeign squared spacings where the surfel lies neither on the point's plane nor on its
// instance. Never below the squared distance. Infinite where the surfel must not stand for the point: farther than
// reach [m] away, faces away, or one of the two emits and the other does not. spacing [m]: of the densest packing of
// the surfels. Without branches: loops over it become vectors.
inline float mapCost(const MapPoint& point, const MapPoint& surfel, float spacing, float reach) {
  constexpr float kHeight = 32.0f, kNormal = 1.0f, kForeign = 4.0f, kSamePlane = 0.02f;
  const float cosine = glm::dot(point.normal, surfel.normal);
  const glm::vec3 apart = surfel.positionWorld - point.positionWorld;
  const float distanceSquared = glm::dot(apart, apart);
  const float h1 = glm::dot(point.normal, apart), h2 = glm::dot(surfel.normal, apart);
  const float plane = kSamePlane * spacing;
  const bool samePlane = (h1 * h1 <= plane * plane) & (h2 * h2 <= plane * plane);
  const bool foreign = (point.instance != surfel.instance) & (!samePlane | (point.emits != 0));
  const bool mayStand = (cosine > 0.0f) & (point.emits == surfel.emits) & (distanceSquared <= reach * reach);
  const float cost = distanceSquared + kHeight * (h1 * h1 + h2 * h2) + kNormal * spacing * spacing * (1.0f - cosine) +
                     (foreign ? kForeign * spacing * spacing : 0.0f);
  return mayStand ? cost : kNoMapping;
}

}  // namespace relume
