// SPDX-License-Identifier: MIT
// Volumes as functions take them that light one or several.
#pragma once

#include "runtime/voxels/nested_volumes.h"

#include <span>

namespace relume {

// Volumes that lie in one another, from the outermost on, or one alone.
struct VolumeRange : std::span<const VoxelVolume> {
  VolumeRange(const NestedVolumes& volumes) : span(volumes.all()) {}
  VolumeRange(const VoxelVolume& only) : span(&only, 1) {}
  VolumeRange(std::span<const VoxelVolume> volumes) : span(volumes) {}
};

}  // namespace relume
