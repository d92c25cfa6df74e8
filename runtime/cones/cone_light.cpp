// SPDX-License-Identifier: MIT
// See cone_light.h.
#include "runtime/cones/cone_light.h"

#include "formats/frame_about.h"
#include "relume/glossy.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

constexpr double kGolden = 2.399963229728653;  // the golden angle

// Cone `i` of a Vogel spiral about +z, so wide that its cap has the solid angle 2 pi (1 - cos) = `solidAngle`.
LocalCone coneAt(std::uint32_t i, double z, double solidAngle) {
  constexpr double kLeastCosine = 0.1;
  const double r = std::sqrt(std::max(1.0 - z * z, 0.0));
  const double cosine = std::max(1.0 - solidAngle / (2.0 * std::numbers::pi), kLeastCosine);
  return {glm::vec3(r * std::cos(i * kGolden), r * std::sin(i * kGolden), z),
          static_cast<float>(std::sqrt(1.0 - cosine * cosine) / cosine)};
}

std::array<LocalCone, kHemisphereCones> makeHemisphere() {
  std::array<LocalCone, kHemisphereCones> cones;
  constexpr auto kCount = static_cast<double>(kHemisphereCones);
  for (std::uint32_t i = 0; i < kHemisphereCones; ++i) {
    const double z = std::sqrt(1.0 - (i + 0.5) / kCount);
    cones[i] = coneAt(i, z, std::numbers::pi / (kCount * z));
  }
  return cones;
}

// The frame about a reflected direction that turns with the plane that reflects.
glm::mat3 frameOver(const glm::vec3& normal, const glm::vec3& reflected) {
  const glm::vec3 up = normal - glm::dot(normal, reflected) * reflected;
  const float length2 = glm::dot(up, up);
  if (!(length2 > 1e-6f)) return frameAbout(reflected);
  const glm::vec3 t = up / std::sqrt(length2);
  return {t, glm::cross(reflected, t), reflected};
}

}  // namespace

const std::array<LocalCone, kHemisphereCones>& hemisphereCones() {
  static const std::array<LocalCone, kHemisphereCones> cones = makeHemisphere();
  return cones;
}

std::array<LocalCone, kLobeCones> lobeCones(float exponent) {
  const double n = exponent >= 0.0f ? static_cast<double>(std::min(exponent, kMaxExponent)) : 0.0;
  std::array<LocalCone, kLobeCones> cones;
  constexpr auto kCount = static_cast<double>(kLobeCones);
  for (std::uint32_t i = 0; i < kLobeCones; ++i) {
    const double z = std::pow(1.0 - (i + 0.5) / kCount, 1.0 / (n + 1.0));
    // The lobe has (n + 1) / (2 pi) cos^n of itself to the solid angle here.
    cones[i] = coneAt(i, z, 2.0 * std::numbers::pi / ((n + 1.0) * std::pow(z, n) * kCount));
  }
  return cones;
}

Gathered ConeTracer::follow(const Cone& cone) const {
  const ConeLight light = cones_.trace(cone);
  Gathered found{light.radiance, light.occlusion};
  if (light.clear > 0.0f) found.radiance += light.clear * skyAlong(sky_, cone.direction);
  return found;
}

glm::vec3 ConeTracer::glossy(const glm::vec3& positionWorld, const glm::vec3& normal, const glm::vec3& reflected,
                             float exponent) const {
  const glm::mat3 frame = frameOver(normal, reflected);
  glm::vec3 sum(0.0f);
  float count = 0.0f;
  for (const LocalCone& cone : lobeCones(exponent)) {
    const glm::vec3 direction = frame * cone.direction;
    if (glm::dot(direction, normal) <= 0.0f) continue;
    sum += follow({positionWorld, normal, direction, cone.spread}).radiance;
    count += 1.0f;
  }
  return count > 0.0f ? sum / count : glm::vec3(0.0f);
}

Gathered ConeTracer::hemisphereCone(std::uint32_t which, const glm::vec3& positionWorld, const glm::vec3& plane,
                                    const glm::mat3& frame, float falloff) const {
  const LocalCone& cone = hemisphereCones()[which];
  Cone world{positionWorld, plane, frame * cone.direction, kNarrowHemisphereCone * cone.spread};
  // Below the plane there is the surface itself.
  if (glm::dot(world.direction, plane) <= 0.0f) return {glm::vec3(0.0f), 1.0f};
  world.falloff = falloff;
  return follow(world);
}

Gathered ConeTracer::hemisphere(const glm::vec3& positionWorld, const glm::vec3& plane, const glm::vec3& normal,
                                float falloff) const {
  const glm::mat3 frame = frameAbout(normal);
  Gathered sum;
  for (std::uint32_t i = 0; i < kHemisphereCones; ++i) {
    const Gathered one = hemisphereCone(i, positionWorld, plane, frame, falloff);
    sum.radiance += one.radiance;
    sum.occlusion += one.occlusion;
  }
  constexpr float kEach = 1.0f / static_cast<float>(kHemisphereCones);
  return {kEach * sum.radiance, kEach * sum.occlusion};
}

}  // namespace relume
