// SPDX-License-Identifier: MIT
// Volumes in one another about the eye, each half as wide as the one that it lies in, with as many cells: small voxels
// near the eye, and large ones all around (CRC, Vardis et al. 2014, Section 7: cascades).
//
// All count their cells from one corner, the outermost one's first. They follow the eye in whole cells of their own and
// stay within the outermost, so that the faces of each lie between voxels of the next. Where each is read from follows
// the eye without a step (VolumeReach).
#pragma once

#include "relume/lights.h"
#include "relume/result.h"
#include "runtime/voxels/voxel_volume.h"

#include <glm/mat4x3.hpp>
#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

inline constexpr std::uint32_t kMaxCascades = 4;

struct NestedOptions {
  VoxelOptions outermost;
  std::uint32_t cascades = 1;           // [1..4]
  bool boxFollowsEye = false;           // the outermost moves as well
  std::optional<glm::vec3> eyeWorld{};  // nothing = the middle of the box
};

// Set the reach of volumes in one another, from the outermost on, about an eye. Of a volume that has not followed the
// eye yet less is read.
void setReach(std::span<VoxelVolume> volumes, const glm::vec3& eyeWorld, bool boxFollowsEye);

class NestedVolumes {
 public:
  // Errors of VoxelVolume::create(); usage: cascades out of range, an eye that is not finite.
  static Result<NestedVolumes> create(const VoxelGeometry& geometry, const NestedOptions& options);
  explicit NestedVolumes(VoxelVolume only);

  // As VoxelVolume's: all volumes and parts change or none.
  [[nodiscard]] Status place(const PartPlaces& places);
  [[nodiscard]] Status move(std::span<const glm::mat4x3> toWorld) { return place({.edits = {}, .toWorld = toWorld}); }
  [[nodiscard]] Status edit(std::span<const PartEdit> edits) { return place({.edits = edits, .toWorld = {}}); }
  [[nodiscard]] Status lightDirectly(const LightSetup& setup);
  // The same of the volumes that have changed since, by the lights and shadows from before.
  [[nodiscard]] Status lightChanged(const LightSetup& setup);

  // Follow the eye. Each stays while the eye is within 3/4 of a cell of where it is centred. Returns whether any has
  // moved. usage: an eye that is not finite or farther than kMaxCoordinate; memory; all stay where they are then.
  Result<bool> centre(const glm::vec3& eyeWorld);

  // Radiance [W/m²/sr] of the voxel that a ray meets first, in the innermost volume that holds its origin and beyond;
  // black where there is none. [direction unit]
  glm::vec3 radianceAlong(const glm::vec3& originWorld, const glm::vec3& direction) const;

  std::size_t size() const { return volumes_.size(); }
  // From the outermost on.
  VoxelVolume& operator[](std::size_t level) { return volumes_[level]; }
  const VoxelVolume& operator[](std::size_t level) const { return volumes_[level]; }
  VoxelVolume& outermost() { return volumes_.front(); }
  const VoxelVolume& outermost() const { return volumes_.front(); }
  std::span<const VoxelVolume> all() const { return volumes_; }

  // Voxels of all; triangles as the outermost has them.
  VoxelStats stats() const;
  // Sums over all, by the names that VoxelVolume's have; "voxelise" and
  // "direct" of those that the last call was of.
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;
  const ParallelFor& parallelFor() const { return volumes_.front().parallelFor(); }

 private:
  std::vector<VoxelVolume> volumes_;
  std::vector<std::uint8_t> isLit_;  // [Size 0 or volumes] directly, as they are now
  bool boxFollowsEye_ = false;
  double voxeliseMs_ = 0.0, directMs_ = 0.0;  // of the last create(), edit() or centre(); of the last direct light
};

}  // namespace relume
