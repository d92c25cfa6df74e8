// SPDX-License-Identifier: MIT
// See light_surfels.h. Lights are punctual as KHR_lights_punctual defines them, read in radiometric units.
#include "runtime/cpu/light_surfels.h"

#include "formats/color.h"
#include "formats/pack.h"
#include "runtime/cpu/chunks.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <cmath>
#include <numbers>

namespace relume::cpu {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr std::uint32_t kGrain = 1024;

// Smooth edge of a spot's cone: 1 inside the inner angle, 0 outside the outer.
float spotAttenuation(const Light& light, const glm::vec3& towardLight) {
  const float outer = std::cos(light.outerConeRad), inner = std::cos(light.innerConeRad);
  const float cosine = -glm::dot(light.direction, towardLight);
  const float t = glm::clamp((cosine - outer) / std::max(inner - outer, 0.001f), 0.0f, 1.0f);
  return t * t;
}

glm::vec3 directAtSurfel(const LightSetup& setup, const glm::vec3& position, const glm::vec3& normal) {
  glm::vec3 sum(0.0f);
  for (std::uint32_t i = 0; i < setup.lights.size(); ++i) {
    const glm::vec3 e = directIrradiance(setup.lights[i], position, normal);
    if (e == glm::vec3(0.0f)) continue;
    sum += setup.visibility ? e * setup.visibility(i, position, normal) : e;
  }
  return sum;
}

glm::vec3 bouncedAtSurfel(const Bake& bake, const CacheLight& last, std::uint32_t s) {
  const Surfels& surfels = bake.surfels;
  if (surfels.receiver[s] == kGridReceiver) {
    return irradianceInGrid(bake.caches, last, surfels.positionWorld[s], surfels.normal[s]);
  }
  return irradianceOnLightmap(bake.caches, last, unpackUnorm16x2(surfels.receiver[s]), surfels.normal[s]);
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
  if (light.kind == LightKind::directional) return light.intensity * std::max(-glm::dot(light.direction, normal), 0.0f);
  // E = I cos / d², with a window that ends at the range.
  const glm::vec3 toward = light.positionWorld - positionWorld;
  const float d2 = glm::dot(toward, toward);
  const float cosineTimesD = glm::dot(toward, normal);
  if (!(cosineTimesD > 0.0f)) return glm::vec3(0.0f);
  const float d = std::sqrt(d2);
  float factor = cosineTimesD / (d * std::max(d2, 1e-8f));
  if (light.range > 0.0f) {
    const float share = d2 / (light.range * light.range);
    factor *= std::max(1.0f - share * share, 0.0f);
  }
  if (light.kind == LightKind::spot) factor *= spotAttenuation(light, toward / d);
  return light.intensity * factor;
}

void lightSurfels(const Bake& bake, const LightSetup& setup, const CacheLight& last, std::span<glm::vec4> node,
                  const ParallelFor& parallelFor) {
  const Surfels& surfels = bake.surfels;
  const bool bounce = setup.bounceScale > 0.0f && !last.coefficients.empty();
  const bool emits = setup.emissionScale != glm::vec3(0.0f);
  forChunks(parallelFor, surfels.count(), kGrain, [&](std::uint32_t begin, std::uint32_t end) {
    for (std::uint32_t s = begin; s < end; ++s) {
      glm::vec3 e = setup.surfelIrradiance.empty() ? directAtSurfel(setup, surfels.positionWorld[s], surfels.normal[s])
                                                   : setup.surfelIrradiance[s];
      if (bounce) e += setup.bounceScale * bouncedAtSurfel(bake, last, s);
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
