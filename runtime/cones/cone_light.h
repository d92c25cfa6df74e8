// SPDX-License-Identifier: MIT
// Light that a receiver finds by cones through a lit voxel volume: what it mirrors, what lies around it, and how much
// of that hides the rest (VCT, Hong 2015, Sections 2.5.3.3.8, 3.2, 4.2 and 4.4). The hemisphere is cut into cones of
// equal weight, a lobe is one cone.
//
// Threads: any number, between changes of volume and mips.
#pragma once

#include "runtime/cones/radiance_mips.h"
#include "runtime/live/live_sky.h"

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>

namespace relume {

inline constexpr std::uint32_t kHemisphereCones = 25;  // VCT Section 4.2: 5 x 5

// One of the cones of a hemisphere.
struct HemisphereCone {
  glm::vec3 direction{0.0f, 0.0f, 1.0f};  // unit, about +z
  float spread = 0.0f;                    // tangent of the half angle
};

// Cones of equal share in the cosine-weighted hemisphere: on the disc below it a Vogel spiral, each as wide as its
// share pi / (25 cos) of solid angle.
const std::array<HemisphereCone, kHemisphereCones>& hemisphereCones();

// Tangent of the half angle of the cone with the mean cosine of a lobe cos^exponent, (n + 1) / (n + 2): its own cosine
// is n / (n + 2).
float lobeSpread(float exponent);

// A frame about a unit vector (Duff et al. 2017): its third column is the vector.
glm::mat3 frameAbout(const glm::vec3& normal);

// What one cone or several bring to a receiver.
struct Gathered {
  glm::vec3 radiance{0.0f};  // [W/m²/sr] the mean; irradiance is pi times it
  float occlusion = 0.0f;    // [0..1] the mean of ConeLight::occlusion
};

// Volume, mips and the sky's map are kept by reference. The sky is what cones see beyond the volume.
class ConeTracer {
 public:
  ConeTracer(const VoxelVolume& volume, const RadianceMips& mips, const LiveSky& sky)
      : volume_(volume), mips_(mips), sky_(sky) {}

  // Mean radiance in the lobe cos^exponent about the unit direction `reflected`. normal: of the surface's plane, unit.
  glm::vec3 glossy(const glm::vec3& positionWorld, const glm::vec3& normal, const glm::vec3& reflected,
                   float exponent) const;

  // The cosine-weighted hemisphere about `normal`, unit, over the plane of `plane`, unit. falloff: as Cone's.
  Gathered hemisphere(const glm::vec3& positionWorld, const glm::vec3& plane, const glm::vec3& normal,
                      float falloff) const;

  // One of its cones; `frame` is frameAbout() the normal, turned about it or not.
  Gathered hemisphereCone(std::uint32_t which, const glm::vec3& positionWorld, const glm::vec3& plane,
                          const glm::mat3& frame, float falloff) const;

 private:
  Gathered follow(const Cone& cone) const;

  const VoxelVolume& volume_;
  const RadianceMips& mips_;
  LiveSky sky_;
};

}  // namespace relume
