// SPDX-License-Identifier: MIT
// See direct_light.h.
#include "runtime/direct_light.h"

#include "runtime/light_window.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {

SpotEdge spotEdge(const Light& light) {
  const float cosOuter = std::cos(light.outerConeRad);
  return {cosOuter, 1.0f / std::max(std::cos(light.innerConeRad) - cosOuter, 0.001f)};
}

glm::vec3 directIrradiance(const Light& light, const glm::vec3& positionWorld, const glm::vec3& normal) {
  if (light.kind == LightKind::directional) return light.intensity * std::max(-glm::dot(light.direction, normal), 0.0f);
  // E = I cos / d², with a window that ends at the range.
  const glm::vec3 toward = light.positionWorld - positionWorld;
  // Squares of the smallest distances are 0.
  const float d2 = std::max(glm::dot(toward, toward), 1e-12f);
  const float cosineTimesD = glm::dot(toward, normal);
  if (!(cosineTimesD > 0.0f)) return glm::vec3(0.0f);
  const float d = std::sqrt(d2);
  const float share = d2 * inverseRangeSquared(light.range);
  float factor = cosineTimesD / (d * std::max(d2, 1e-8f)) * std::max(1.0f - share * share, 0.0f);
  if (light.kind == LightKind::spot) {
    const SpotEdge edge = spotEdge(light);
    const float cosine = -glm::dot(light.direction, toward) / d;
    const float t = glm::clamp((cosine - edge.cosOuter) * edge.scale, 0.0f, 1.0f);
    factor *= t * t;
  }
  return light.intensity * factor;
}

}  // namespace relume
