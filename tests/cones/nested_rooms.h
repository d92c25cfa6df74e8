// SPDX-License-Identifier: MIT
// Volumes in one another whose sides send light out, for tests of cones.
#pragma once

#include "runtime/cones/nested_cones.h"
#include "runtime/voxels/nested_volumes.h"
#include "tests/voxels/boxes.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <functional>
#include <utility>

namespace relume::test {

// What a side of a volume sends out. [side: of the volume]
using Sends = std::function<glm::vec3(const VoxelVolume& volume, std::uint32_t side)>;

struct NestedRoom {
  NestedVolumes volumes;
  NestedMips mips;

  NestedRoom(VoxelLevel& level, const NestedOptions& options, const Sends& sends,
             RadianceMips::Directions directions = RadianceMips::Directions::six)
      : volumes(make(level, options)), mips(directions) {
    light(sends);
  }
  static NestedVolumes make(VoxelLevel& level, const NestedOptions& options) {
    auto made = NestedVolumes::create(level.geometry(), options);
    EXPECT_TRUE(made) << made.error().message;
    return std::move(*made);
  }
  void light(const Sends& sends) {
    for (std::size_t level = 0; level < volumes.size(); ++level) {
      VoxelVolume& volume = volumes[level];
      for (std::uint32_t s = 0; s < volume.sideCount(); ++s) volume.setRadiance(s, sends(volume, s));
    }
    EXPECT_TRUE(mips.update(volumes.all()));
  }
  NestedCones cones() const { return {volumes.all(), mips.all()}; }
  // Of the outermost alone.
  ConeLight outermost(const Cone& cone) const { return mips.all().front().trace(volumes.outermost(), cone); }
};

// The albedo of a side that a triangle faces; nothing is on the other.
inline glm::vec3 albedoOfLitSide(const VoxelVolume& volume, std::uint32_t side) {
  return volume.side(side).isFaced ? volume.side(side).albedo : glm::vec3(0.0f);
}

inline NestedOptions nestedAbout(std::uint32_t cascades, std::uint32_t cells, const glm::vec3& low,
                                 const glm::vec3& high, const glm::vec3& eyeWorld) {
  NestedOptions options;
  options.outermost.boxMin = low;
  options.outermost.boxMax = high;
  options.outermost.cells = cells;
  options.cascades = cascades;
  options.eyeWorld = eyeWorld;
  return options;
}

}  // namespace relume::test
