// SPDX-License-Identifier: MIT
// A voxel volume lit by reflective shadow maps: what their texels reflect is added to the voxels that they lie in, by
// the side that their normals face, so that cones find light after one bounce without a ray (VCT, Hong 2015, Sections
// 2.5.3.3.9 and 4.1). Radiosity of a side is the sum of its flux over its area: flux is conserved.
//
// Sums are of integers, so that threads and the twin in OpenGL (shaders/cone_rsm.comp) come to the same bits.
//
// Deviation: VCT adds to a voxel. Here each of its two sides has a sum of its own, and walls are lit on one side.
//
// Threads: as a Relighter's (relume/relighter.h), with the CPU backend.
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/live/rsm_image.h"
#include "runtime/voxels/voxel_volume.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Texels along a map's side, at least twice as many as voxels along the part of the volume that it sees (VCT 4.1: 256
// for 128 voxels): with fewer, voxels between texels stay dark.
inline constexpr std::uint32_t kRsmVoxelsSide = 512;

// The unit in which flux is counted [W]: a power of two, so that the brightest texel has 2^30 to 2^31 of it in its
// brightest channel. Texels lose less than one unit each, and light a 2^31st as bright is lost. Sums have 64 bits,
// which 2^33 texels fill: they cannot overflow. largestFlux [W]: of a texel's channel, >= 0 and finite.
float rsmUnit(float largestFlux);
// [W] Of a texel's channel, over all maps.
float largestFlux(std::span<const RsmImage> images);

// Where the flux of a volume's sides goes. A voxel that a surface passes through the edge of has hardly any of its
// area, and few texels or none: such a side is one with a neighbour's that faces the same way, and both have the flux
// of both over the area of both.
struct RsmTargets {
  std::vector<std::uint32_t> side;  // [Size sideCount()] that has the sum: the side itself, or a neighbour's
  // [1/(m² sr)] [Size sideCount()] radiance by flux: 1 / (pi area), with the area of all sides that go to the same one,
  // a sixteenth of a voxel's face at least. 0 = no cone reads it.
  std::vector<float> perFlux;
};
// Throws std::bad_alloc.
RsmTargets findRsmTargets(const VoxelVolume& volume);

class RsmVoxels {
 public:
  // A frame: the radiance of all sides that cones read, in place of what the volume's reflect() found. emissionScale:
  // factor on emission. [images: of each light that is on] usage: checkRsm(), an emissionScale outside of 0 to 1e9;
  // memory. What is refused leaves the light. What lies outside of the volume, or in no voxel, lights nothing; radiance
  // is cut at 1e9 W/m²/sr.
  [[nodiscard]] Status light(VoxelVolume& volume, std::span<const RsmImage> images, const glm::vec3& emissionScale);

  // Of the last frame: three channels a side, in units. [Size 3 sideCount()]
  std::span<const std::uint64_t> sums() const { return sums_; }
  float unit() const { return unit_; }  // [W]
  const RsmTargets& targets() const { return targets_; }
  // [0..1] of the flux of all channels: what lay in voxels. 1 where nothing reflects.
  float arrived() const { return arrived_; }
  std::vector<PassTime> passTimes() const { return {{"voxel sides", targetsMs_}, {"inject", injectMs_}}; }
  std::size_t sizeBytes() const;

 private:
  RsmTargets targets_;
  bool follows_ = false;
  std::uint64_t standingVersion_ = 0, movingVersion_ = 0;  // that the targets are of
  std::vector<std::uint64_t> sums_;
  float unit_ = 0.0f, arrived_ = 1.0f;
  double targetsMs_ = 0.0, injectMs_ = 0.0;
};

// usage: a channel outside of 0 to 1e9.
Status checkEmissionScale(const glm::vec3& emissionScale);

}  // namespace relume
