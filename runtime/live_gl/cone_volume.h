// SPDX-License-Identifier: MIT
// What cones in OpenGL read of one volume, as the CPU finds it from its voxels: where they are, what their sides are
// and which voxels of the levels above are not empty. ConeLevels (cone_levels_gl.h) has it in textures.
//
// Voxels that stand and those that move have one numbering, so that a place is looked up once.
#pragma once

#include "runtime/cones/radiance_mips.h"
#include "runtime/voxels/voxel_volume.h"
#include "shaders/shared/layout.h"

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstddef>
#include <cstdint>
#include <vector>

namespace relume::gl {

inline constexpr std::uint32_t kNoSource = 0xFFFFFFFFu;
inline constexpr std::uint32_t kConeSideTexels = 4;  // of a voxel

// Of an occupied voxel the place of its sides among the volume's, kNoSource = it was dropped; and its front's share of
// the area.
struct ConeSource {
  std::uint32_t voxel = 0;
  float front = 0.5f;
};

class ConeVolume {
 public:
  bool isOf(const VoxelVolume& volume) const {
    return volume.standingVersion() == standingVersion_ && volume.movingVersion() == movingVersion_;
  }
  // Nothing of what it followed is in the textures any more. Whose cells are not those of before has to be told.
  void forget();
  // Take over which voxels there are. Throws std::bad_alloc.
  void follow(const VoxelVolume& volume);

  const VolumeGrid& grid() const { return grid_; }
  std::uint32_t sideCount() const { return sideCount_; }
  std::uint32_t count() const { return static_cast<std::uint32_t>(source_.size()); }  // occupied voxels
  const std::vector<ConeSource>& sources() const { return source_; }
  // Bits of a cell; the number of its first voxel.
  const std::vector<glm::uvec4>& cellTexels() const { return cellTexels_; }
  const std::vector<glm::vec4>& sideTexels() const { return sideTexels_; }  // RELUME_CONE_UNIT_SIDES
  // Sizes of the levels above the voxels. [Size levels]
  const std::vector<glm::uvec3>& sizes() const { return sizes_; }
  // Of all levels the voxels that are found in a frame: places, 10 bits an axis; and where each level's begin. [Size
  // levels + 1]
  const std::vector<std::uint32_t>& listed() const { return listed_; }
  const std::vector<std::uint32_t>& firstListed() const { return firstListed_; }

  // Radiance as the volume's reflect() left it: RELUME_CONE_UNIT_RADIANCE, as shaders/cone_inject.comp writes it.
  std::vector<glm::vec4> radianceTexels(const VoxelVolume& volume, RadianceMips::Directions directions) const;
  // As RsmVoxels finds them.
  std::vector<RelumeRsmVoxel> rsmVoxels(const VoxelVolume& volume) const;

 private:
  void findVoxels(const VoxelVolume& volume);
  void listVoxels();

  VolumeGrid grid_;
  std::uint32_t sideCount_ = 0;
  std::uint64_t standingVersion_ = 0, movingVersion_ = 0;
  std::vector<ConeSource> source_;
  std::vector<glm::uvec4> cellTexels_;
  std::vector<glm::vec4> sideTexels_;
  std::vector<glm::uvec3> sizes_;
  std::vector<std::uint32_t> occupied_, firstOccupied_, listed_,
      firstListed_;  // those that are not empty; those to find
};

}  // namespace relume::gl
