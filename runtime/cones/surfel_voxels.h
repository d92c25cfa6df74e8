// SPDX-License-Identifier: MIT
// A voxel volume lit by a bake: each side of a voxel sends out what the bake's surfels in it do, so that cones find
// light after all bounces. What has no surfel, such as things that move, reflects direct light and what the bake's grid
// has there.
//
// Threads: as a Relighter's (relume/relighter.h), with the CPU backend.
#pragma once

#include "relume/bake_data.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/voxels/voxel_volume.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

class SurfelVoxels {
 public:
  // A surfel in a voxel: its leaf, and how squarely it faces the side.
  struct Sender {
    std::uint32_t node = 0;
    float weight = 0.0f;
  };

  // Which surfels of a bake lie in which standing voxels. Of a bake of another level few do. memory: it ran out.
  static Result<SurfelVoxels> create(const VoxelVolume& volume, const Bake& bake);

  // A frame: radiance of all sides from the light that `relighter`, of that bake, has, and for sides without surfels
  // from the volume's lightDirectly(). usage: the volume's standing parts have been edited since create(); memory.
  [[nodiscard]] Status light(VoxelVolume& volume, const Relighter& relighter, const glm::vec3& emissionScale);

  // [0..1] of the standing sides that have triangles: those with surfels.
  float covered() const { return covered_; }

  // usage: the volume's standing parts have been edited since create().
  [[nodiscard]] Status checkVolume(const VoxelVolume& volume) const;
  // Where the senders of each standing side begin, and of the last one end. [Size standing sides + 1]
  std::span<const std::uint32_t> first() const { return first_; }
  std::span<const Sender> senders() const { return sender_; }

 private:
  std::vector<std::uint32_t> first_;  // [Size standing sides + 1] of each side in sender_
  std::vector<Sender> sender_;
  std::uint64_t standingVersion_ = 0;
  float covered_ = 0.0f;
};

}  // namespace relume
