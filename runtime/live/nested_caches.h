// SPDX-License-Identifier: MIT
// Light without a bake in volumes that lie in one another (runtime/voxels/nested_volumes.h): caches in the cells of
// each. Rays that leave a volume go on in the one around it; voxels reflect the caches of their own volume; a receiver
// reads those of the innermost volume that holds it, and near a face of that more and more of the one around it.
//
// Threads: as a Relighter's (relume/relighter.h), with the CPU backend.
#pragma once

#include "relume/result.h"
#include "runtime/live/live_caches.h"
#include "runtime/voxels/nested_volumes.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

// What a receiver reads in each volume, from the outermost on. The shares sum to 1, or are 0 where there is no cache.
struct NestedStencil {
  std::array<CellStencil, kMaxCascades> stencil{};
  std::array<float, kMaxCascades> share{};
  float sky = 0.0f;  // the sky's, near the faces of an outermost that follows the eye, and beyond them
};

// Caches of a volume, wherever they were found. [The others: as LiveCaches has them]
struct VolumeCaches {
  const CellSet* cells = nullptr;
  VolumeReach reach{};
  std::span<const float> coefficients, brightest;
};
// What NestedCaches::stencil() and irradianceBy() say, of volumes from the outermost on. [1 to kMaxCascades]
NestedStencil nestedStencil(std::span<const VolumeCaches> caches, const glm::vec3& positionWorld,
                            const glm::vec3& normal);
glm::vec3 nestedIrradiance(std::span<const VolumeCaches> caches, const CacheSum& sky, const NestedStencil& stencil,
                           const glm::vec3& normal);
// The light of a frame's sky, were it all that there is.
CacheSum skySum(const LiveFrame& frame);

class NestedCaches {
 public:
  // Errors of checkLiveOptions().
  static Result<NestedCaches> create(const LiveOptions& options);

  // A frame, as LiveCaches has it: light onto the voxels of all volumes, then all caches.
  [[nodiscard]] Status update(NestedVolumes& volumes, const LiveFrame& frame);
  void reset();

  // receivedIrradiance() of open_air.h.
  [[nodiscard]] glm::vec3 irradiance(const glm::vec3& positionWorld, const glm::vec3& normal) const;
  // As LiveCaches's.
  [[nodiscard]] NestedStencil stencil(const glm::vec3& positionWorld, const glm::vec3& normal) const;
  [[nodiscard]] glm::vec3 irradianceBy(const NestedStencil& stencil, const glm::vec3& normal) const;

  // Of each volume, from the outermost on, as of the last update(); one at least.
  std::size_t size() const { return caches_.size(); }
  const LiveCaches& operator[](std::size_t level) const { return caches_[level]; }
  const VolumeReach& reach(std::size_t level) const { return reach_[level]; }
  const CacheSum& sky() const { return sky_; }  // skySum(), where the outermost has it behind its faces
  // Sums over all.
  std::uint32_t activeCells() const;
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  explicit NestedCaches(LiveCaches first) { caches_.push_back(std::move(first)); }
  std::array<VolumeCaches, kMaxCascades> all() const;

  std::vector<LiveCaches> caches_;
  std::array<VolumeReach, kMaxCascades> reach_{};  // of the volumes, as of the last update()
  CacheSum sky_;                                   // as of the last update(), were it all that there is
};

}  // namespace relume
