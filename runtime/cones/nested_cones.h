// SPDX-License-Identifier: MIT
// Cones through volumes that lie in one another about the eye (runtime/voxels/nested_volumes.h): at each place a cone
// reads the innermost volume that all of its sample lies in, and near a face of that more and more of the one around
// it. How it goes, its sizes in voxels, is in each volume as in one alone (radiance_mips.h).
//
// Threads: as RadianceMips.
#pragma once

#include "relume/result.h"
#include "runtime/cones/radiance_mips.h"
#include "runtime/voxels/nested_volumes.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// The radiance of each volume at every scale, from the outermost on.
class NestedMips {
 public:
  explicit NestedMips(RadianceMips::Directions directions = RadianceMips::Directions::six) : directions_(directions) {}

  // As RadianceMips::update(), of all; empty afterwards where memory ran out.
  [[nodiscard]] Status update(std::span<const VoxelVolume> volumes);

  bool empty() const { return mips_.empty(); }
  std::span<const RadianceMips> all() const { return mips_; }
  // Sums over all.
  std::vector<PassTime> passTimes() const;
  std::size_t sizeBytes() const;

 private:
  RadianceMips::Directions directions_;
  std::vector<RadianceMips> mips_;
};

// Volumes and what was found of them by their last update(), by reference, from the outermost on. [Size 1 to
// kMaxCascades, both alike]
class NestedCones {
 public:
  NestedCones(std::span<const VoxelVolume> volumes, std::span<const RadianceMips> mips);

  // As RadianceMips::trace(), to the bit where there is one volume.
  [[nodiscard]] ConeLight trace(const Cone& cone) const;

 private:
  std::span<const VoxelVolume> volumes_;
  std::span<const RadianceMips> mips_;
};

}  // namespace relume
