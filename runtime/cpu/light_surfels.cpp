// SPDX-License-Identifier: MIT
// See light_surfels.h. Lights are punctual as KHR_lights_punctual defines them, read in radiometric units.
#include "runtime/cpu/light_surfels.h"

#include "formats/color.h"
#include "runtime/cpu/chunks.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <cmath>
#include <numbers>
#include <vector>

namespace relume::cpu {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr std::uint32_t kGrain = 1024;

// A light with what every surfel would compute again.
struct PreparedLight {
  Light light;
  float inverseRange2;        // [1/m²] 0 = no range
  float cosOuter, coneScale;  // a spot's smooth edge: 1 inside the inner angle, 0 outside the outer
};

PreparedLight prepare(const Light& light) {
  const float cosOuter = std::cos(light.outerConeRad);
  return {light, light.range > 0.0f ? 1.0f / (light.range * light.range) : 0.0f, cosOuter,
          1.0f / std::max(std::cos(light.innerConeRad) - cosOuter, 0.001f)};
}

glm::vec3 irradianceBy(const PreparedLight& prepared, const glm::vec3& positionWorld, const glm::vec3& normal) {
  const Light& light = prepared.light;
  if (light.kind == LightKind::directional) return light.intensity * std::max(-glm::dot(light.direction, normal), 0.0f);
  // E = I cos / d², with a window that ends at the range.
  const glm::vec3 toward = light.positionWorld - positionWorld;
  const float d2 = glm::dot(toward, toward);
  const float cosineTimesD = glm::dot(toward, normal);
  if (!(cosineTimesD > 0.0f)) return glm::vec3(0.0f);
  const float d = std::sqrt(d2);
  const float share = d2 * prepared.inverseRange2;
  float factor = cosineTimesD / (d * std::max(d2, 1e-8f)) * std::max(1.0f - share * share, 0.0f);
  if (light.kind == LightKind::spot) {
    const float cosine = -glm::dot(light.direction, toward) / d;
    const float t = glm::clamp((cosine - prepared.cosOuter) * prepared.coneScale, 0.0f, 1.0f);
    factor *= t * t;
  }
  return light.intensity * factor;
}

glm::vec3 directAtSurfel(std::span<const PreparedLight> lights, const Visibility& visibility, const glm::vec3& position,
                         const glm::vec3& normal) {
  glm::vec3 sum(0.0f);
  for (std::uint32_t i = 0; i < lights.size(); ++i) {
    const glm::vec3 e = irradianceBy(lights[i], position, normal);
    if (e == glm::vec3(0.0f)) continue;
    sum += visibility ? e * visibility(i, position, normal) : e;
  }
  return sum;
}

glm::vec4 toNode(const glm::vec3& radiosity) { return glm::vec4(rgbToYCoCg(radiosity), 0.0f); }

void lightSky(const Hierarchy& hierarchy, std::uint32_t surfelCount, const LightSetup& setup, std::span<glm::vec4> node) {
  for (std::uint32_t p = 0; p < hierarchy.skyDirection.size(); ++p) {
    const glm::vec3 radiance = setup.skyPatches.empty() ? setup.skyRadiance : setup.skyPatches[p];
    node[hierarchy.leafNode[surfelCount + p]] = toNode(kPi * radiance);
  }
}

}  // namespace

glm::vec3 directIrradiance(const Light& light, const glm::vec3& positionWorld, const glm::vec3& normal) {
  return irradianceBy(prepare(light), positionWorld, normal);
}

void lightSurfels(const Bake& bake, const LightSetup& setup, const Bounce* bounce, std::span<glm::vec4> node,
                  const ParallelFor& parallelFor) {
  const Surfels& surfels = bake.surfels;
  const bool bounces = bounce && setup.bounceScale > 0.0f;
  const bool emits = setup.emissionScale != glm::vec3(0.0f);
  std::vector<PreparedLight> lights;
  for (const Light& light : setup.lights) lights.push_back(prepare(light));
  forChunks(parallelFor, surfels.count(), kGrain, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t s = begin; s < end; ++s) {
      glm::vec3 e = setup.surfelIrradiance.empty()
                        ? directAtSurfel(lights, setup.visibility, surfels.positionWorld[s], surfels.normal[s])
                        : setup.surfelIrradiance[s];
      if (bounces) e += setup.bounceScale * bounce->irradiance(s);
      glm::vec3 radiosity = surfels.albedo[s] * e;
      if (!setup.surfelEmission.empty()) {
        radiosity += kPi * setup.surfelEmission[s];
      } else if (emits) {
        radiosity += kPi * surfels.emission[s] * setup.emissionScale;
      }
      node[bake.hierarchy.leafNode[s]] = toNode(radiosity);
    }
  });
  lightSky(bake.hierarchy, surfels.count(), setup, node);
}

}  // namespace relume::cpu
