// SPDX-License-Identifier: MIT
// What cones read in OpenGL: the sides of volumes' voxels with their radiance, and all levels above, found in compute
// from them. The twin of RadianceMips (runtime/cones/radiance_mips.h), of one volume or of several that lie in one
// another (runtime/cones/nested_cones.h).
//
// Of each level the voxels that are not empty are listed, and no others are found anew in a frame. Level 1 is a 3-D
// texture of RGBA16F, or RGBA32F for software drivers, its directions beside each other along x; the further levels are
// another one, one behind the other along z. Halves count radiance in a unit of their own (shaders/lib/cone_unit.glsl).
//
// Several volumes share all textures: levels and layers of cells one volume behind the other along z, voxels numbered
// through, each with room for a quarter more than it needs. What has not changed stays.
#pragma once

#include "relume/result.h"
#include "runtime/cones/radiance_mips.h"
#include "runtime/gl/timer.h"
#include "runtime/live_gl/cone_volume.h"
#include "runtime/live_gl/lit_sides.h"
#include "runtime/live_gl/live_objects.h"
#include "runtime/live_gl/rsm_passes_gl.h"
#include "runtime/passes/programs.h"
#include "runtime/voxels/voxel_volume.h"
#include "shaders/shared/layout.h"

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume::gl {

class ConeLevels {
 public:
  ConeLevels(const Functions& gl, RadianceMips::Directions directions, gpu::GroupThreads groups);

  // State must be saved, here and below. failed: a shader's log.
  Status compile();
  // Take over volumes, from the outermost on, and their radiance, as their reflect() left it, as passes have written
  // it, or of one alone by reflective shadow maps, and fill the levels. lit: [Size 0 or volumes]. One of `lit` and
  // `maps` or neither. usage: the sides have not followed these volumes; unsupported: more than this OpenGL holds,
  // after which there is nothing until volumes fit. Throws std::bad_alloc.
  Status fill(std::span<const VoxelVolume> volumes, std::span<const LitSides* const> lit, const RsmMaps* maps);
  bool isFilled() const { return follows_; }
  std::size_t volumes() const { return volumes_.size(); }
  // Textures, buffer and uniforms of a program with lib/cone_trace.glsl, made for one volume or for several.
  void bind(const Program& program) const;

  // Definitions that all programs with cones need.
  std::vector<std::pair<std::string, std::string>> defines() const;
  std::uint32_t levels(std::size_t volume) const {
    return volume < volumes_.size() ? static_cast<std::uint32_t>(volumes_[volume]->found.sizes().size()) : 0;
  }
  // As RadianceMips::texels(), read back. [1..levels(volume)]
  std::vector<glm::vec4> texels(std::uint32_t level, std::size_t volume) const;
  // Radiance of a volume's sides as cones read it, black where none does. [Size of its sides] Read back.
  std::vector<glm::vec3> sideRadiance(std::size_t volume) const;
  // "voxels" on the CPU, "inject", "levels".
  std::vector<PassTime> passTimes();
  std::size_t voxelBytes() const;
  std::size_t levelBytes() const;

 private:
  // One volume, and where its own begin in what all share.
  struct Followed {
    explicit Followed(const Functions& gl) : sources(gl), list(gl) {}

    ConeVolume found;
    VolumeReach reach;
    GrowingBuffer sources, list;
    std::uint32_t layer = 0;             // of cells
    std::uint32_t first = 0, room = 0;   // of voxels
    std::vector<std::uint32_t> offsets;  // along z, of each level
    bool isDirty = false;                // its own are not in the textures
  };

  Status checkSize(std::span<const VoxelVolume> volumes, bool hasMaps) const;
  void follow(std::span<const VoxelVolume> volumes);
  void makeLevels();
  void placeVoxels();
  void write(Followed& volume);
  void inject(const Followed& volume, const LitSides& lit);
  void findUnit();
  void runLevels(const Followed& volume);
  void bindVoxels(const Program& program, const Followed& volume) const;
  void bindLevels() const;
  void bindVolumes(const Program& program) const;
  void bindLevelImage(std::uint32_t level) const;
  GLenum levelFormat() const { return halves_ ? GL_RGBA16F : GL_RGBA32F; }
  std::uint32_t perVoxel() const { return directions_ == RadianceMips::Directions::six ? 6 : 1; }

  const Functions& gl_;
  RadianceMips::Directions directions_;
  bool halves_;  // of the levels' texels
  Program injectProgram_, brightestProgram_, firstProgram_, levelProgram_;
  std::vector<std::unique_ptr<Followed>> volumes_;  // from the outermost on
  Texture first_, further_;
  glm::uvec3 firstSize_{0}, furtherSize_{0};  // of both [texel]
  bool follows_ = false;
  CellTexture cells_;
  GrowingBuffer brightest_;
  GrowingRows radiance_, sides_;
  RsmPasses rsm_;
  FrameTimer<2> timer_;
  double voxelsMs_ = 0.0;
};

}  // namespace relume::gl
