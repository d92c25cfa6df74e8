// SPDX-License-Identifier: MIT
// How well a surfel stands for a point of a surface: what the map from hits to surfels minimises.
#pragma once

#include "bake/surfels/neighbours.h"
#include "bake/surfels/surface_sampler.h"

#include <cstdint>
#include <limits>

namespace relume {

inline constexpr float kNoMapping = std::numeric_limits<float>::infinity();

// [m²] Squared distance, plus: heights over the other's plane, which part thin layers, counted kHeight times; the
// angle between the normals; kForeign squared spacings where the surfel lies neither on the point's plane nor on its
// instance. Never below the squared distance. Infinite where the surfel must not stand for the point: faces away, or
// one of the two emits and the other does not. spacing [m]: of the densest packing of the surfels.
inline float mapCost(const SurfaceSample& point, const SurfaceSample& surfel, float spacing) {
  constexpr float kHeight = 32.0f, kNormal = 1.0f, kForeign = 4.0f, kSamePlane = 0.02f;
  const float cosine = glm::dot(point.normal, surfel.normal);
  if (!(cosine > 0.0f) || (point.emitter == kReflector) != (surfel.emitter == kReflector)) return kNoMapping;
  const glm::vec3 apart = surfel.positionWorld - point.positionWorld;
  const float h1 = glm::dot(point.normal, apart), h2 = glm::dot(surfel.normal, apart);
  const float plane = kSamePlane * spacing;
  const bool samePlane = h1 * h1 <= plane * plane && h2 * h2 <= plane * plane;
  const bool foreign = point.point.instance != surfel.point.instance && (!samePlane || point.emitter != kReflector);
  return glm::dot(apart, apart) + kHeight * (h1 * h1 + h2 * h2) + kNormal * spacing * spacing * (1.0f - cosine) +
         (foreign ? kForeign * spacing * spacing : 0.0f);
}

}  // namespace relume
