// SPDX-License-Identifier: MIT
// Indirect light without a bake: caches in the cells of a voxel volume, after CRC (Vardis et al. 2014). Each active
// cell gathers what its rays meet in the volume into spherical harmonics of three bands; voxels reflect what the caches
// had a frame before, so that bounces add up over the frames.
//
// Deviation: CRC gathers a first bounce from reflective shadow maps and later ones with one albedo for the whole level.
// Here rays find lit voxels, each with its own albedo, and all bounces are one pass.
//
// Threads: as a Relighter's (relume/relighter.h), with the CPU backend.
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/live/cell_set.h"
#include "runtime/live/live_frame.h"
#include "runtime/voxels/voxel_volume.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Light of some caches, weighted.
struct CacheSum {
  std::array<float, 27> coefficients{};  // [W/m²/sr] nine of red, of green, of blue
  float brightest = 0.0f;                // [W/m²/sr] of any of their rays

  // Of a stencil, `share` of it. The others: as LiveCaches has them.
  void add(const CellStencil& stencil, float share, std::span<const float> from, std::span<const float> brightestOf);
  glm::vec3 irradiance(const glm::vec3& normal) const;  // [W/m²]
};

// Irradiance [W/m²] at a unit normal from the caches of a stencil. coefficients and brightest: as LiveCaches has them.
glm::vec3 readStencil(const CellStencil& stencil, std::span<const float> coefficients, std::span<const float> brightest,
                      const glm::vec3& normal);
// What LiveCaches::stencil() says: nothing for a place or normal that is not finite.
CellStencil checkedStencil(const CellSet& cells, const glm::vec3& positionWorld, const glm::vec3& normal);

class LiveCaches {
 public:
  // Errors of checkLiveOptions().
  static Result<LiveCaches> create(const LiveOptions& options);

  // A frame: light of the caches onto the voxels, their radiosity, and all active cells gathered anew. The volume has
  // been lit directly. Cells that have just become active begin with what they gather now. Errors of
  // checkLiveFrame(); memory: it ran out. Last frame's light stays then.
  [[nodiscard]] Status update(VoxelVolume& volume, const LiveFrame& frame);
  // The same in two steps, for volumes in one another (nested_caches.h). What has entered the volume begins with the
  // light of `around`, the caches of the one that it lies in.
  [[nodiscard]] Status reflect(VoxelVolume& volume, const LiveFrame& frame, const LiveCaches* around);
  // Rays that leave the volume go on in the last of `beyond`, and from there in the one before it.
  [[nodiscard]] Status gather(const VoxelVolume& volume, const LiveFrame& frame, std::span<const VoxelVolume> beyond);
  void reset();
  // Others with the same options, of no volume as yet.
  LiveCaches withoutLight() const { return LiveCaches(options_); }

  // Irradiance [W/m²] by all light but the punctual lights' own, at a receiver with unit normal, from the caches around
  // it that it sees. Finite and never negative; zero outside of the volume, and where position or normal is not finite.
  [[nodiscard]] glm::vec3 irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const;

  // The same in two steps, for several LiveCaches that have followed one volume.
  [[nodiscard]] CellStencil stencil(const glm::vec3& positionWorld, const glm::vec3& normal) const;
  [[nodiscard]] glm::vec3 irradianceBy(const CellStencil& stencil, const glm::vec3& normal) const;

  // Cells as of the last update(), and of each active one the largest channel of its brightest ray [W/m²/sr].
  const CellSet& cells() const { return cells_; }
  std::span<const float> brightest() const { return brightest_; }
  std::uint32_t activeCells() const { return static_cast<std::uint32_t>(cells_.active.size()); }
  // Coefficients [W/m²/sr] of the active cells: 9 of red, 9 of green, 9 of blue.
  std::span<const float> coefficients() const { return coefficients_; }
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  explicit LiveCaches(const LiveOptions& options) : options_(options) {}
  bool follow(const VoxelVolume& volume, const LiveCaches* around);

  LiveOptions options_;
  CellSet cells_;
  std::vector<float> coefficients_;  // [Size 27 active]
  std::vector<float> brightest_;     // [Size active] [W/m²/sr] the brightest ray's largest channel, blended alike
  std::vector<std::uint8_t> isLit_;  // [Size active] whether the cell has gathered before
  std::vector<SeenCaches> standing_, moving_;  // of the voxels' sides
  std::uint64_t standingVersion_ = 0, movingVersion_ = 0;
  double cellsMs_ = 0.0, bounceMs_ = 0.0, gatherMs_ = 0.0;
};

}  // namespace relume
