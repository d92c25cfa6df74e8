// SPDX-License-Identifier: MIT
// Voxels that cones read, lit by reflective shadow maps in OpenGL: the passes of RsmVoxels::light()
// (runtime/cones/rsm_voxels.h), whose bits they find. State must be saved around all of it.
#pragma once

#include "relume/result.h"
#include "runtime/live_gl/cone_volume.h"
#include "runtime/live_gl/live_objects.h"
#include "runtime/shared/shader_text.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

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

class RsmPasses {
 public:
  explicit RsmPasses(const Functions& gl);

  // defines: of all programs with cones. failed: a shader's log.
  Status compile(Defines defines);
  // The volume is another one, or has changed.
  void forget() { follows_ = false; }
  // Take over which sides maps light, unless it is known. found: of that volume. Throws std::bad_alloc.
  void follow(const VoxelVolume& volume, const ConeVolume& found);
  // Radiance of the voxels, from maps. cells: of that volume alone. [follow()]
  void light(const ConeVolume& found, const RsmMaps& maps, const CellTexture& cells, const GrowingRows& radiance);

  // [byte] Of the largest buffer.
  static std::size_t bytesNeeded(std::uint32_t voxels, std::uint32_t sides);
  std::size_t bytes() const { return voxels_.bytes() + sums_.bytes(); }

 private:
  const Functions& gl_;
  Program program_, lightProgram_;
  GrowingBuffer voxels_, sums_;
  HostTextures textures_;
  bool follows_ = false;
};

}  // namespace relume::gl
