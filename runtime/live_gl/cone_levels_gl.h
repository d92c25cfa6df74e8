// SPDX-License-Identifier: MIT
// What cones read in OpenGL: the sides of a volume's voxels with their radiance, and all levels above, found in compute
// from them. The twin of RadianceMips (runtime/cones/radiance_mips.h).
//
// Voxels that stand and those that move have one numbering, so that a place is looked up once. Of each level the voxels
// that are not empty are listed, and no others are found anew in a frame.
//
// Level 1 is a 3-D texture of RGBA16F, or RGBA32F for software drivers, its directions beside each other along x; the
// further levels are another one, one behind the other along z. Halves count radiance in a unit of their own
// (shaders/lib/cone_unit.glsl).
#pragma once

#include "relume/result.h"
#include "runtime/cones/radiance_mips.h"
#include "runtime/gl/timer.h"
#include "runtime/live_gl/lit_sides.h"
#include "runtime/live_gl/live_objects.h"
#include "runtime/passes/programs.h"
#include "runtime/voxels/voxel_volume.h"
#include "shaders/shared/layout.h"

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume::gl {

// Reflective shadow maps as passes read them (RsmTextures in cones_gl.h), checked.
struct RsmMaps {
  struct Map {
    GLuint places, normals, flux;
    std::uint32_t width, height;
  };
  std::span<const Map> map;
  float largestFlux = 0.0f;       // [W]
  glm::vec3 emissionScale{0.0f};  // factor
};

class ConeLevels {
 public:
  ConeLevels(const Functions& gl, RadianceMips::Directions directions, gpu::GroupThreads groups);

  // State must be saved, here and below. failed: a shader's log.
  Status compile();
  // Take over the volume and its radiance, as its reflect() left it, as passes have written it, or by reflective
  // shadow maps, and fill the levels. One of `lit` and `maps` or neither. usage: the sides have not followed this
  // volume; unsupported: more than this OpenGL holds, after which there is nothing until a volume fits. Throws
  // std::bad_alloc.
  Status fill(const VoxelVolume& volume, const LitSides* lit, const RsmMaps* maps);
  bool isFilled() const { return follows_; }
  // Textures, buffer and uniforms of a program with lib/cone_trace.glsl.
  void bind(const Program& program) const;

  // Definitions that all programs with cones need.
  std::vector<std::pair<std::string, std::string>> defines() const;
  std::uint32_t levels() const { return static_cast<std::uint32_t>(sizes_.size()); }
  // As RadianceMips::texels(), read back. [1..levels()]
  std::vector<glm::vec4> texels(std::uint32_t level) const;
  // Radiance of the volume's sides as cones read it, black where none does. [Size of its sides] Read back.
  std::vector<glm::vec3> sideRadiance() const;
  // "voxels" on the CPU, "inject", "levels".
  std::vector<PassTime> passTimes();
  std::size_t voxelBytes() const {
    return cells_.bytes() + sides_.bytes() + radiance_.bytes() + sources_.bytes() + listBuffer_.bytes() +
           rsmVoxels_.bytes() + rsmSums_.bytes() + brightest_.bytes();
  }
  std::size_t levelBytes() const;

 private:
  Status checkSize(const VoxelVolume& volume, bool hasMaps) const;
  void makeLevels();
  void findVoxels(const VoxelVolume& volume);
  void listVoxels();
  void writeVoxels();
  void writeRadiance(const VoxelVolume& volume);
  void writeRsmVoxels(const VoxelVolume& volume);
  void inject(const LitSides& lit);
  void inject(const RsmMaps& maps);
  void findUnit();
  void runLevels();
  void bindVoxels(const Program& program) const;
  void bindLevels() const;
  void bindLevelImage(std::uint32_t level) const;
  GLenum levelFormat() const { return halves_ ? GL_RGBA16F : GL_RGBA32F; }
  std::uint32_t perVoxel() const { return directions_ == RadianceMips::Directions::six ? 6 : 1; }

  const Functions& gl_;
  RadianceMips::Directions directions_;
  bool halves_;  // of the levels' texels
  Program injectProgram_, rsmProgram_, rsmLightProgram_, brightestProgram_, firstProgram_, levelProgram_;
  VolumeGrid grid_;
  std::vector<glm::uvec3> sizes_;       // [Size levels()]
  std::vector<std::uint32_t> offsets_;  // along z, of each
  Texture first_, further_;
  bool follows_ = false, rsmFollows_ = false;
  std::uint32_t sideCount_ = 0;
  std::uint64_t standingVersion_ = 0, movingVersion_ = 0;
  // Of each occupied voxel the place of its sides among the volume's, kNoSource = it was dropped; and its front's share
  // of the area.
  struct Source {
    std::uint32_t voxel = 0;
    float front = 0.5f;
  };
  std::vector<Source> source_;
  std::vector<glm::uvec4> cellTexels_;
  std::vector<glm::vec4> sideTexels_;
  // Of all levels the voxels that are not empty, and those that are found in a frame: places, 10 bits an axis; and
  // where each level's begin. [Size levels() + 1]
  std::vector<std::uint32_t> occupied_, firstOccupied_, listed_, firstListed_;
  CellTexture cells_;
  GrowingBuffer sources_, listBuffer_, rsmVoxels_, rsmSums_, brightest_;
  GrowingRows radiance_, sides_;
  FrameTimer<2> timer_;
  double voxelsMs_ = 0.0;
};

}  // namespace relume::gl
