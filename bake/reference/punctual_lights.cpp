// SPDX-License-Identifier: MIT
// Irradiance by punctual lights as KHR_lights_punctual defines them, intensities read as radiometric: point and spot
// I [W/sr], directional E [W/m²]. No light has a size.
#include "bake/reference/path_tracer.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

namespace relume {
namespace {

// Smooth window of KHR_lights_punctual: max(min(1 - (d/range)^4, 1), 0); range 0 = no window.
float rangeWindow(float distance, float range) {
  if (range <= 0.0f) return 1.0f;
  const float r = distance / range, r2 = r * r;
  return std::clamp(1.0f - r2 * r2, 0.0f, 1.0f);
}

// Spot cone of KHR_lights_punctual: the squared, clamped line in the cosine from outer to inner angle.
float spotCone(const SceneLight& light, const glm::vec3& toLight) {
  const float cosInner = std::cos(light.innerConeRad), cosOuter = std::cos(light.outerConeRad);
  const float scale = 1.0f / std::max(0.001f, cosInner - cosOuter);
  const float t = std::clamp((glm::dot(light.direction, -toLight) - cosOuter) * scale, 0.0f, 1.0f);
  return t * t;
}

}  // namespace

glm::vec3 lightIrradiance(const SceneLight& light, const glm::vec3& positionWorld, const glm::vec3& normal,
                          glm::vec3& toLight, float& distance) {
  if (light.kind == LightKind::directional) {
    toLight = -light.direction;
    distance = std::numeric_limits<float>::infinity();
    return light.intensity * std::max(0.0f, glm::dot(normal, toLight));
  }
  const glm::vec3 offset = light.positionWorld - positionWorld;
  distance = glm::length(offset);
  if (!(distance > 0.0f)) {
    toLight = normal;
    return glm::vec3(0.0f);
  }
  toLight = offset / distance;
  // E = I cos / d²
  float factor = std::max(0.0f, glm::dot(normal, toLight)) / (distance * distance) * rangeWindow(distance, light.range);
  if (light.kind == LightKind::spot) factor *= spotCone(light, toLight);
  return light.intensity * factor;
}

glm::vec3 directIrradiance(const RayTracer& tracer, std::span<const SceneLight> lights, const glm::vec3& positionWorld,
                           const glm::vec3& normal) {
  const glm::vec3 origin = positionWorld + normal * tracer.epsilonAt(positionWorld);
  glm::vec3 sum(0.0f);
  for (const SceneLight& light : lights) {
    glm::vec3 toLight;
    float distance = 0.0f;
    const glm::vec3 irradiance = lightIrradiance(light, origin, normal, toLight, distance);
    if (irradiance == glm::vec3(0.0f)) continue;
    if (!tracer.occluded({origin, 0.0f, toLight, distance})) sum += irradiance;
  }
  return sum;
}

void directIrradiance(const RayTracer& tracer, std::span<const SceneLight> lights,
                      std::span<const glm::vec3> positionWorld, std::span<const glm::vec3> normal,
                      std::span<glm::vec3> irradiance) {
  std::fill(irradiance.begin(), irradiance.end(), glm::vec3(0.0f));
  std::vector<Ray> rays;
  std::vector<std::pair<std::size_t, glm::vec3>> open;  // point, light unless blocked
  std::vector<std::uint8_t> blocked;
  for (const SceneLight& light : lights) {
    rays.clear();
    open.clear();
    for (std::size_t i = 0; i < positionWorld.size(); ++i) {
      const glm::vec3 origin = positionWorld[i] + normal[i] * tracer.epsilonAt(positionWorld[i]);
      glm::vec3 toLight;
      float distance = 0.0f;
      const glm::vec3 e = lightIrradiance(light, origin, normal[i], toLight, distance);
      if (e == glm::vec3(0.0f)) continue;
      rays.push_back({origin, 0.0f, toLight, distance});
      open.emplace_back(i, e);
    }
    blocked.assign(rays.size(), 0);
    tracer.occluded(rays, blocked);
    for (std::size_t k = 0; k < open.size(); ++k) {
      if (blocked[k] == 0) irradiance[open[k].first] += open[k].second;
    }
  }
}

glm::vec3 directHighlights(const RayTracer& tracer, std::span<const SceneLight> lights, const glm::vec3& positionWorld,
                           const glm::vec3& geometric, const glm::vec3& reflected, float exponent) {
  const glm::vec3 origin = positionWorld + geometric * tracer.epsilonAt(positionWorld);
  glm::vec3 sum(0.0f);
  for (const SceneLight& light : lights) {
    glm::vec3 toLight;
    float distance = 0.0f;
    lightIrradiance(light, origin, geometric, toLight, distance);
    const float cosine = glm::dot(toLight, reflected);
    if (!(cosine > 0.0f) || glm::dot(toLight, geometric) <= 0.0f) continue;
    const glm::vec3 across = lightIrradiance(light, origin, toLight, toLight, distance);
    if (across == glm::vec3(0.0f) || tracer.occluded({origin, 0.0f, toLight, distance})) continue;
    sum += (exponent + 1.0f) * 0.5f * std::numbers::inv_pi_v<float> * std::pow(cosine, exponent) * across;
  }
  return sum;
}

}  // namespace relume
