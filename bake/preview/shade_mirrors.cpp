// SPDX-License-Identifier: MIT
// See shade_mirrors.h.
#include "bake/preview/shade_mirrors.h"

#include "bake/base/random.h"
#include "bake/reference/path_tracer.h"

#include <glm/geometric.hpp>

#include <cmath>

namespace relume {
namespace {

constexpr std::uint32_t kMirrorStage = 0x7263736c;  // the random streams' stage
constexpr std::uint64_t kMirrored = 1ull << 41;     // makes items of mirrored rays
constexpr float kSpread = 0.05f;                    // of a mirrored ray: what its albedo is the mean over
constexpr float kSameAxis = 0.9999f;                // cosine of 0.8 degrees, a tenth of the sharpest lobe's
constexpr float kSameExponent = 0.01f;              // of it

// Whether two lobes are alike enough to mirror the same.
bool isSameLobe(const MirrorSurface& a, const MirrorSurface& b) {
  return glm::dot(a.axis, b.axis) > kSameAxis && std::abs(a.exponent - b.exponent) <= kSameExponent * a.exponent;
}

}  // namespace

MirroredLight MirrorShader::light(std::uint32_t x, std::uint32_t y, std::size_t pixel, std::uint64_t item,
                                  const PixelReceiver& receiver, const PixelReceiver* center,
                                  const MirrorSurface& mirror, Scratch& scratch) const {
  if (!mirror.byRecords()) return {alongLobe(item, receiver, mirror), true};
  if (center != nullptr && !in_.drawn.empty() && in_.drawn[pixel].weight > 0.0f &&
      isSameLobe(in_.surfaces[pixel], mirror))
    return {in_.drawn[pixel].radiance, false};
  RadianceSplat* splat = &scratch.own;
  if (center != nullptr) {
    splat = &scratch.center;
    if (scratch.pixel != pixel) in_.radiance.splat(in_.tiles, in_.records, x, y, *center, *splat);
    scratch.pixel = pixel;
  } else {
    in_.radiance.splat(in_.tiles, in_.records, x, y, receiver, *splat);
  }
  if (!(splat->weight > 0.0f)) return {alongLobe(item, receiver, mirror), true};
  return {mirroredLight(*splat, in_.lobes, mirror.exponent, mirror.axis), false};
}

// What one ray of the lobe finds above the surface.
glm::vec3 MirrorShader::alongLobe(std::uint64_t item, const PixelReceiver& receiver,
                                  const MirrorSurface& mirror) const {
  RandomStream random(in_.seed, kMirrorStage, item);
  const glm::vec3 direction = lobeDirectionAbove(mirror.axis, mirror.exponent, receiver.geometricNormal, random);
  if (direction == glm::vec3(0.0f)) return direction;
  const RayTracer& transport = in_.scene.transport;
  const glm::vec3 origin =
      receiver.positionWorld + receiver.geometricNormal * transport.epsilonAt(receiver.positionWorld);
  const Ray ray{origin, 0.0f, direction};
  const Hit hit = transport.trace(ray);
  if (!hit) return in_.scene.sky.along(direction);
  glm::vec3 radiance(0.0f);
  in_.reflected(item + kMirrored, kSpread, {&ray, 1}, {&hit, 1}, {&radiance, 1});
  if (!std::isfinite(radiance.x + radiance.y + radiance.z)) radiance = glm::vec3(0.0f);
  const Scene& scene = transport.scene();
  if (in_.emissive && (!hit.back || scene.bothSides(scene.instances[hit.instance], hit.triangle)))
    radiance += emissionAt(scene, hit.point());
  return radiance;
}

}  // namespace relume
