// SPDX-License-Identifier: MIT
// Radiance and opacity of a voxel volume at every scale, and cones that are followed through them: voxel cone tracing
// after VCT (Hong 2015, Sections 2.5.3.3.7 to 2.5.3.3.10 and 4.1). Level 0 are the voxels themselves, whose two sides
// a cone reads by its direction; each further level has voxels twice as wide, with what a ray sees of them along each
// of the six directions of the axes.
//
// Deviations, each measured in docs/notes/cones.md:
//   - Voxels hold optical depth -ln(1 - opacity) and radiance times that, not opacity: what a trilinear read adds up
//     to over steps of half a voxel is then the depth of a wall, wherever the steps fall.
//   - A sample is as wide as d tan(half angle), half of VCT's: the mean of eight boxes read as a tent spreads by half
//     its width, as a disc of that radius does.
//   - No sample reaches below the plane of the surface that the cone starts on: near it the cone slides along the
//     plane, a voxel and a half above, and samples are narrow as long as it is low.
//   - Near its start a cone does not see walls that it starts in front of from their backs: voxels reach out of walls.
//
// Threads: update() by one, with the volume's ParallelFor; trace() by any number, between updates.
#pragma once

#include "runtime/voxels/voxel_volume.h"

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

inline constexpr float kSolidDepth = 7.0f;  // optical depth of a voxel of a wall: 0.1 % goes through
// The same of a voxel by 127 times the longest component of its axis. A wall has one voxel in each column along its
// longest axis, and so fewer to its area where it is slanted.
inline float depthOfWall(int longest) { return kSolidDepth * 127.0f / static_cast<float>(longest > 1 ? longest : 1); }

struct Cone {
  glm::vec3 originWorld{0.0f};      // [m] on a surface, within kMaxCoordinate
  glm::vec3 normal{0.0f, 1, 0};     // unit: of the plane of that surface, toward the cone
  glm::vec3 direction{0.0f, 1, 0};  // unit
  float spread = 0.0f;              // [>= 0] tangent of the half angle
  float falloff = 0.0f;  // [1/m] >= 0: what blocks the cone at distance d counts 1 / (1 + falloff d) in `occlusion`
};

// What a cone found. What is left of it, `clear`, sees what lies beyond: the sky, or the caches around its end.
struct ConeLight {
  glm::vec3 radiance{0.0f};  // [W/m²/sr] of what blocks it, by how much
  float clear = 1.0f;        // [0..1]
  float occlusion = 0.0f;    // [0..1]
};

class RadianceMips {
 public:
  enum class Directions { six, one };  // one: a mean over all sides, as without Section 2.5.3.3.10

  explicit RadianceMips(Directions directions = Directions::six) : directions_(directions) {}

  // Take over what the volume's voxels send out, as its reflect() has left it. memory: it ran out, and the mips are
  // empty.
  [[nodiscard]] Status update(const VoxelVolume& volume);

  // Follow a cone; `volume` is the one of the last update(), and has not changed since. A cone with a number that is
  // not finite or out of its range finds nothing, nor does one that begins half a million voxels away.
  [[nodiscard]] ConeLight trace(const VoxelVolume& volume, const Cone& cone) const;

  // Levels above the voxels; level 1 is the first.
  std::uint32_t levels() const { return static_cast<std::uint32_t>(levels_.size()); }
  // What a cone of a direction reads at a place [voxels] of level `level` [0..levels()]: radiance times optical depth,
  // and optical depth, a voxel of the level long. before: only sides of voxels that this place [voxels] is in front of
  // block; null = all.
  [[nodiscard]] glm::vec4 read(const VoxelVolume& volume, float level, const glm::vec3& place,
                               const glm::vec3& direction, const glm::vec3* before = nullptr) const;

  // Texels of a level [1..levels()], x fastest after the directions: six, or one.
  std::span<const glm::vec4> texels(std::uint32_t level) const { return levels_[level - 1].voxel; }

  std::vector<PassTime> passTimes() const { return {{"mips", ms_}}; }
  std::size_t sizeBytes() const;

 private:
  struct Level {
    glm::ivec3 size{0};
    std::vector<glm::vec4> voxel;  // [Size size.x size.y size.z, directions], x fastest after the directions
  };
  struct View;  // of a direction: which of six, and by how much

  std::uint32_t perVoxel() const { return directions_ == Directions::six ? 6 : 1; }
  glm::vec4 readVoxels(const VoxelVolume& volume, const glm::vec3& place, const glm::vec3& direction,
                       const glm::vec3* before) const;
  glm::vec4 readLevel(const Level& level, const glm::vec3& place, const View& view) const;
  glm::vec4 readAt(const VoxelVolume& volume, float level, const glm::vec3& place, const glm::vec3& direction,
                   const View& view, const glm::vec3* before) const;

  Directions directions_;
  std::vector<float> areas_;  // of sides, where one direction stands for all
  std::vector<Level> levels_;
  double ms_ = 0.0;
};

}  // namespace relume
