// SPDX-License-Identifier: MIT
// Volumes that lie in one another, as the passes of live_caches_gl.h see them, one alone as well: their cells one layer
// after the other in one texture, numbers of voxels and slots of caches counted through in others, so that rays and
// receivers go from one volume to the next. Each has room to grow in; what has not changed stays where it is.
//
// State must be saved around all that is not const.
#pragma once

#include "relume/result.h"
#include "runtime/live/live_caches.h"
#include "runtime/live_gl/lit_sides.h"
#include "runtime/live_gl/live_objects.h"
#include "runtime/voxels/nested_volumes.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume::gl {

inline constexpr std::uint32_t kTexelsOfCache = 7;

// Where one volume's own begin in what all share, and for how many there is room.
struct SharedPlaces {
  int layer = 0;
  std::uint32_t firstCache = 0, caches = 0;  // [a multiple of RELUME_LIVE_CACHES_A_ROW]
  std::uint32_t firstVoxel = 0, voxels = 0;  // [a multiple of RELUME_LIVE_SIDES_A_ROW]
  // Voxels that have sub-voxels. [a multiple of RELUME_LIVE_SUB_VOXELS_A_ROW]
  std::uint32_t firstSubVoxels = 0, subVoxels = 0;
  bool beginsAt(const SharedPlaces& other) const {
    return layer == other.layer && firstCache == other.firstCache && firstVoxel == other.firstVoxel &&
           firstSubVoxels == other.firstSubVoxels;
  }
};

// One of them, as of the last follow().
struct FollowedVolume {
  explicit FollowedVolume(const Functions& gl) : sides(gl), stencils(gl) {}
  FollowedVolume(const Functions& gl, const FollowedVolume& outermost) : sides(gl, outermost.sides), stencils(gl) {}

  bool isOf(const VoxelVolume& volume) const {
    return volume.standingVersion() == standingVersion && volume.movingVersion() == movingVersion;
  }
  // Numbers of voxels end there: of those that stand and are kept, and of all.
  glm::uvec2 ends() const { return at.firstVoxel + glm::uvec2(standingKept, sides.count() / 2); }

  CellSet cells;
  VolumeReach reach;
  SharedPlaces at;
  LitSides sides;
  GrowingBuffer stencils;  // live_stencils.comp
  std::uint64_t standingVersion = 0, movingVersion = 0;
  std::uint32_t standingKept = 0;
  bool moves = false;         // something does
  bool lostRadiance = false;  // none is there of some of its sides, until the next reflect()
};

class NestedVolumesGl {
 public:
  explicit NestedVolumesGl(const Functions& gl);

  // As LitSides's, for the sides of all.
  Status compile(const std::string& visibilityGlsl);
  // Take over what has changed of volumes, from the outermost on, as NestedCaches's follow: caches keep their light,
  // what has entered a volume begins with that of the cache around it. unsupported: more than OpenGL's buffers hold;
  // where its memory ran out there is no volume afterwards. Throws std::bad_alloc.
  Status follow(std::span<const VoxelVolume> volumes);
  // Where they are read from, of the volumes that it follows; nothing of others.
  void takeReach(std::span<const VoxelVolume> volumes);
  // No light, as before the first frame.
  void reset();

  std::size_t size() const { return follows_ ? volumes_.size() : 0; }  // 0 = there is no light
  FollowedVolume& operator[](std::size_t level) { return *volumes_[level]; }
  const FollowedVolume& operator[](std::size_t level) const { return *volumes_[level]; }
  const LitSides& outermostSides() const {
    return volumes_.front()->sides;
  }  // they have the program before there are any
  std::uint32_t activeCells() const;
  // The sky's share where the outermost follows the eye has a slot of its own, before all caches.
  bool hasSky() const { return hasSky_; }
  void writeSky(const CacheSum& sky);

  const CellTexture& cells() const { return cells_; }                    // cellTexels(), counted through
  const GrowingRows& subVoxelTexels() const { return subVoxelTexels_; }  // of these
  // Bits of what stands and of what moves; number of the first.
  const CellTexture& standing() const { return standing_; }
  const CellTexture& moving() const { return moving_; }
  const GrowingRows& light() const { return light_; }  // of all caches (lib/live_read.glsl)
  GrowingRows& light() { return light_; }
  const GrowingBuffer& cacheVoxels() const { return cacheVoxels_; }  // where they stand, packVoxel()
  // What rays meet: RelumeRayCell of each of cells(), x fastest, and sub-voxels.
  const GrowingBuffer& rayCells() const { return rayCells_; }
  const GrowingBuffer& subVoxels() const { return subVoxels_; }
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  struct Next;
  Status checkSize(std::span<const VoxelVolume> volumes) const;
  std::vector<SharedPlaces> placesOf(std::span<const VoxelVolume> volumes, const std::vector<Next>& next) const;
  std::vector<std::uint32_t> slotsBefore(std::span<const VoxelVolume> volumes, const std::vector<Next>& next,
                                         const std::vector<SharedPlaces>& places) const;
  void carry(const std::vector<std::uint32_t>& from);
  void write(std::size_t level, const VoxelVolume& volume);
  void writeRayCells(const FollowedVolume& to, const VoxelVolume& volume);
  void findStencils(const FollowedVolume& volume);

  const Functions& gl_;
  Program stencilProgram_, carryProgram_;
  std::vector<std::unique_ptr<FollowedVolume>> volumes_;  // one at least
  bool follows_ = false;                                  // them
  CellTexture cells_, standing_, moving_;
  GrowingRows subVoxelTexels_, light_, otherLight_;
  GrowingBuffer cacheVoxels_, rayCells_, subVoxels_, carried_;
  bool hasSky_ = false;
};

}  // namespace relume::gl
