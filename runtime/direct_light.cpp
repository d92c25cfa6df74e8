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

namespace {

// The solid angle of a disc over its area [1/m²], from a height above its plane and a distance from its middle, both in
// radii: 2 (1 - sqrt(1 - x)) / radius², where x = sqrt(across² nearness²). On the axis it is exact, far off cos / d²,
// and in the plane the half of space over the disc and nothing beside it; across² is half of 1 - the cosine of the
// angle under which a diameter is seen. Its sum over a plane of discs is 2 pi within 4 % at any height.
float discFactor(float height, float distance2, float radius) {
  const float b = height * height, u = distance2 - 1.0f, w = std::max(std::sqrt(u * u + 4.0f * b), 1e-15f);
  const float across2 = u > 0.0f ? 2.0f * b / (w * (w + u)) : 0.5f * (w - u) / w;
  const float x = std::min(std::sqrt(across2 / std::max(distance2, b + 1.0f)), 1.0f);
  return 2.0f * x / ((1.0f + std::sqrt(1.0f - x)) * radius * radius);
}

}  // namespace

glm::vec3 directIrradiance(const Light& light, const glm::vec3& positionWorld, const glm::vec3& normal, float radius) {
  if (light.kind == LightKind::directional) return light.intensity * std::max(-glm::dot(light.direction, normal), 0.0f);
  // E = I cos / d², with a window that ends at the range.
  const glm::vec3 toward = light.positionWorld - positionWorld;
  // Squares of the smallest distances are 0.
  const float d2 = std::max(glm::dot(toward, toward), 1e-12f);
  const float cosineTimesD = glm::dot(toward, normal);
  if (!(cosineTimesD > 0.0f)) return glm::vec3(0.0f);
  const float d = std::sqrt(d2);
  const float share = d2 * inverseRangeSquared(light.range);
  const bool isNear = d < kDiscReach * radius;
  float factor = isNear ? discFactor(cosineTimesD / radius, d2 / (radius * radius), radius)
                        : cosineTimesD / (d * std::max(d2, 1e-8f));
  factor *= std::max(1.0f - share * share, 0.0f);
  if (light.kind == LightKind::spot) {
    const SpotEdge edge = spotEdge(light);
    const float cosine = -glm::dot(light.direction, toward) / d;
    const float t = glm::clamp((cosine - edge.cosOuter) * edge.scale, 0.0f, 1.0f);
    factor *= t * t;
  }
  return light.intensity * factor;
}

}  // namespace relume
