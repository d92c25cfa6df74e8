// SPDX-License-Identifier: MIT
// See cone_light.h.
#include "runtime/cones/cone_light.h"

#include "relume/glossy.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

constexpr float kWidest = 8.0f;  // tangent of a half angle

float tangentOf(float cosine) { return std::min(std::sqrt(std::max(1.0f - cosine * cosine, 0.0f)) / cosine, kWidest); }

std::array<HemisphereCone, kHemisphereCones> makeHemisphere() {
  std::array<HemisphereCone, kHemisphereCones> cones;
  constexpr double kGolden = 2.399963229728653;  // the golden angle
  constexpr auto kCount = static_cast<double>(kHemisphereCones);
  for (std::uint32_t i = 0; i < kHemisphereCones; ++i) {
    const double r2 = (i + 0.5) / kCount, r = std::sqrt(r2), z = std::sqrt(1.0 - r2);
    cones[i].direction = glm::vec3(r * std::cos(i * kGolden), r * std::sin(i * kGolden), z);
    // A cap of solid angle 2 pi (1 - cos) = pi / (25 z)
    cones[i].spread = tangentOf(std::max(static_cast<float>(1.0 - 0.5 / (kCount * z)), 0.1f));
  }
  return cones;
}

}  // namespace

const std::array<HemisphereCone, kHemisphereCones>& hemisphereCones() {
  static const std::array<HemisphereCone, kHemisphereCones> cones = makeHemisphere();
  return cones;
}

float lobeSpread(float exponent) {
  const float n = exponent >= 0.0f ? std::min(exponent, kMaxExponent) : 0.0f;
  return n > 0.0f ? tangentOf(n / (n + 2.0f)) : kWidest;
}

glm::mat3 frameAbout(const glm::vec3& n) {
  const float sign = std::copysign(1.0f, n.z), a = -1.0f / (sign + n.z), b = n.x * n.y * a;
  return {{1.0f + sign * n.x * n.x * a, sign * b, -sign * n.x}, {b, sign + n.y * n.y * a, -n.y}, n};
}

Gathered ConeTracer::follow(const Cone& cone) const {
  const ConeLight light = mips_.trace(volume_, cone);
  Gathered found{light.radiance, light.occlusion};
  if (light.clear > 0.0f) found.radiance += light.clear * skyAlong(sky_, cone.direction);
  return found;
}

glm::vec3 ConeTracer::glossy(const glm::vec3& positionWorld, const glm::vec3& normal, const glm::vec3& reflected,
                             float exponent) const {
  return follow({positionWorld, normal, reflected, lobeSpread(exponent)}).radiance;
}

Gathered ConeTracer::hemisphereCone(std::uint32_t which, const glm::vec3& positionWorld, const glm::vec3& plane,
                                    const glm::mat3& frame, float falloff) const {
  const HemisphereCone& cone = hemisphereCones()[which];
  Cone world{positionWorld, plane, frame * cone.direction, cone.spread};
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
