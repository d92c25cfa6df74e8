// SPDX-License-Identifier: MIT
// See check_setup.h.
#include "runtime/check_setup.h"

#include "formats/limits.h"

#include <glm/geometric.hpp>

#include <cmath>
#include <string>

namespace relume {
namespace {

Error refused(const std::string& what) { return Error{ErrorCode::usage, "light setup: " + what}; }

bool finite(const glm::vec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }
bool finiteAndPositive(const glm::vec3& v) { return finite(v) && v.x >= 0.0f && v.y >= 0.0f && v.z >= 0.0f; }

Status checkLight(const Light& light, std::size_t index) {
  const std::string name = "lights[" + std::to_string(index) + "]";
  if (light.kind > LightKind::spot) return refused(name + ".kind is none of directional, point, spot");
  if (!finiteAndPositive(light.intensity) || !isWithin(light.intensity, kMostIntensity))
    return refused(name + ".intensity is negative, not finite or above 1e20");
  if (light.kind != LightKind::directional && !isWithin(light.positionWorld, kMostCoordinate)) {
    return refused(name + ".positionWorld is not finite or beyond 1e9 m");
  }
  if (light.kind != LightKind::point && !(std::abs(glm::dot(light.direction, light.direction) - 1.0f) < 0.01f)) {
    return refused(name + ".direction is not a unit vector");
  }
  if (!(light.range >= 0.0f)) return refused(name + ".range is negative or not a number");
  if (light.kind == LightKind::spot && !(light.innerConeRad >= 0.0f && light.innerConeRad <= light.outerConeRad)) {
    return refused(name + " has cone angles out of order: expected 0 <= inner <= outer");
  }
  return done();
}

// A span that must be empty or hold `size` radiometric colours.
Status checkColors(const char* name, std::span<const glm::vec3> colors, std::size_t size) {
  if (colors.empty()) return done();
  if (colors.size() != size) {
    return refused(std::string(name) + " has " + std::to_string(colors.size()) + " elements, expected none or " +
                   std::to_string(size));
  }
  for (std::size_t i = 0; i < size; ++i) {
    if (!finiteAndPositive(colors[i])) {
      return refused(std::string(name) + "[" + std::to_string(i) + "] is negative or not finite");
    }
  }
  return done();
}

}  // namespace

Status checkSetup(const LightSetup& setup, std::size_t surfelCount, std::size_t skyPatchCount) {
  for (std::size_t i = 0; i < setup.lights.size(); ++i) {
    if (Status ok = checkLight(setup.lights[i], i); !ok) return ok;
  }
  if (Status ok = checkColors("surfelIrradiance", setup.surfelIrradiance, surfelCount); !ok) return ok;
  if (Status ok = checkColors("surfelEmission", setup.surfelEmission, surfelCount); !ok) return ok;
  if (Status ok = checkColors("skyPatches", setup.skyPatches, skyPatchCount); !ok) return ok;
  if (!finiteAndPositive(setup.emissionScale)) return refused("emissionScale is negative or not finite");
  if (!finiteAndPositive(setup.skyRadiance)) return refused("skyRadiance is negative or not finite");
  if (!(setup.bounceScale >= 0.0f && setup.bounceScale <= 1.0f)) return refused("bounceScale is outside [0,1]");
  return done();
}

}  // namespace relume
