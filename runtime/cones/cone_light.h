// SPDX-License-Identifier: MIT
// Light that a receiver finds by cones through a lit voxel volume: what it mirrors, what lies around it, and how much
// of that hides the rest (VCT, Hong 2015, Sections 2.5.3.3.8, 3.2, 4.2 and 4.4). Hemisphere and lobe are cut into cones
// of equal weight.
//
// Deviation: VCT has one cone for a lobe. Seven halve the error of exponent 16 (docs/notes/cones.md).
//
// Threads: any number, between changes of volume and mips.
#pragma once

#include "runtime/cones/nested_cones.h"
#include "runtime/cones/radiance_mips.h"
#include "runtime/live/live_sky.h"

#include <glm/mat3x3.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <span>

namespace relume {

inline constexpr std::uint32_t kHemisphereCones = 25;  // VCT Section 4.2: 5 x 5
inline constexpr std::uint32_t kLobeCones = 7;
// What covers the same half of a cone at each step hides all of it in the end, so that walls beside a receiver hide too
// much; of narrower cones less. A lobe of narrower ones shows them one by one.
inline constexpr float kNarrowHemisphereCone = 0.6f;  // of its spread

// One of the cones of a hemisphere or lobe.
struct LocalCone {
  glm::vec3 direction{0.0f, 0.0f, 1.0f};  // unit, about +z
  float spread = 0.0f;                    // tangent of the half angle
};

// Cones of equal share in the cosine-weighted hemisphere: on the disc below it a Vogel spiral, each as wide as its
// share pi / (25 cos) of solid angle.
const std::array<LocalCone, kHemisphereCones>& hemisphereCones();

// Cones of equal share in the lobe cos^exponent about +z, on a Vogel spiral as well. [exponent 0..kMaxExponent,
// clamped]
std::array<LocalCone, kLobeCones> lobeCones(float exponent);

// What one cone or several bring to a receiver.
struct Gathered {
  glm::vec3 radiance{0.0f};  // [W/m²/sr] the mean; irradiance is pi times it
  float occlusion = 0.0f;    // [0..1] the mean of ConeLight::occlusion
};

// Volumes, mips and the sky's map are kept by reference. The sky is what cones see beyond the volumes.
class ConeTracer {
 public:
  ConeTracer(const VoxelVolume& volume, const RadianceMips& mips, const LiveSky& sky)
      : cones_({&volume, 1}, {&mips, 1}), sky_(sky) {}
  // Of volumes in one another, as NestedCones has them.
  ConeTracer(std::span<const VoxelVolume> volumes, std::span<const RadianceMips> mips, const LiveSky& sky)
      : cones_(volumes, mips), sky_(sky) {}

  // Mean radiance in the lobe cos^exponent about the unit direction `reflected`, as far as it lies above the surface's
  // plane. normal: of that plane, unit.
  glm::vec3 glossy(const glm::vec3& positionWorld, const glm::vec3& normal, const glm::vec3& reflected,
                   float exponent) const;

  // The cosine-weighted hemisphere about `normal`, unit, over the plane of `plane`, unit. falloff: as Cone's.
  Gathered hemisphere(const glm::vec3& positionWorld, const glm::vec3& plane, const glm::vec3& normal,
                      float falloff) const;

  // One of its cones; `frame` is frameAbout() the normal (formats/frame_about.h), turned about it or not.
  Gathered hemisphereCone(std::uint32_t which, const glm::vec3& positionWorld, const glm::vec3& plane,
                          const glm::mat3& frame, float falloff) const;

 private:
  Gathered follow(const Cone& cone) const;

  NestedCones cones_;
  LiveSky sky_;
};

}  // namespace relume
