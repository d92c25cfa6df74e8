// SPDX-License-Identifier: MIT
// The sides of a volume's voxels in OpenGL: what shaders read of them, their direct light, and the texture that takes
// their radiance, which passes of the caches (live_caches_gl.h) or of a bake (bake_voxels_gl.h) write and cones read.
//
// State must be saved around all that is not const, and around radiance().
#pragma once

#include "relume/lights.h"
#include "relume/result.h"
#include "runtime/gl/timer.h"
#include "runtime/live_gl/live_objects.h"
#include "runtime/voxels/voxel_volume.h"
#include "shaders/shared/layout.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <memory_resource>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume::gl {

class LitSides {
 public:
  explicit LitSides(const Functions& gl);
  // With the program and the texture of another.
  LitSides(const Functions& gl, const LitSides& first);

  // visibilityGlsl: as LiveCachesGlOptions has it. failed: a shader's log.
  Status compile(const std::string& visibilityGlsl);
  // unsupported: the volume has more sides than this OpenGL's buffers and textures hold.
  Status checkSize(const VoxelVolume& volume) const;
  // Take over what has changed of the volume; sides that are new have no direct light. Throws std::bad_alloc.
  // firstRow: of the texture, which several share. [checkSize()]
  void follow(const VoxelVolume& volume, std::uint32_t firstRow = 0);
  // Rows of the texture for so many sides; true where there was no room: what it held is gone.
  bool reserveRows(std::size_t sides) { return radiance_->reserve(rowsOfSides(sides)); }
  static std::uint32_t rowsOfSides(std::size_t sides) {
    return static_cast<std::uint32_t>((sides + RELUME_LIVE_SIDES_A_ROW - 1) / RELUME_LIVE_SIDES_A_ROW);
  }
  // Follow no volume: there was no memory for it.
  void leave() { follows_ = false; }

  // Direct light of each side by the lights, which are checked, and the host's visibility. Throws std::bad_alloc.
  void lightDirectly(std::span<const Light> lights);
  // The same as VoxelVolume::lightDirectly() has found it. [follows(volume)]
  void copyDirect(const VoxelVolume& volume);
  // The program whose uniforms visibilityGlsl reads.
  GLuint directProgram() const { return directProgram_->get(); }

  // Whether it has followed the volume as it is now.
  bool isOf(const VoxelVolume& volume) const;
  std::uint32_t count() const { return count_; }
  bool emits() const { return emits_; }  // any of them
  // Slots are those of shaders/shared/layout.h.
  void bindSides() const { sides_.bind(RELUME_LIVE_SLOT_SIDES); }
  void bindVoxels() const { voxels_.bind(RELUME_LIVE_SLOT_VOXELS); }
  void bindDirect() const { direct_.bind(RELUME_LIVE_SLOT_DIRECT); }
  void bindRadianceImage() const { radiance_->bindImage(0, GL_WRITE_ONLY); }
  // RELUME_LIVE_SIDES_A_ROW sides a row [W/m²/sr]; the front's w: packAxis(), the back's, where anything emits:
  // VoxelLayer::emitters.
  GLuint radianceTexture() const { return radiance_->name(); }
  std::uint32_t firstRow() const { return firstRow_; }
  std::vector<glm::vec3> radiance() const;  // read back [Size count()]

  double directMs() { return timer_.passMs()[0]; }  // of the last frame that the GPU has finished
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  const Functions& gl_;
  std::shared_ptr<Program> directProgram_;
  VolumeGrid grid_;
  bool follows_ = false, emits_ = false;
  std::uint64_t standingVersion_ = 0, movingVersion_ = 0;
  std::uint32_t count_ = 0, firstRow_ = 0;
  GrowingBuffer sides_, samples_, voxels_, direct_, lights_;
  std::shared_ptr<GrowingRows> radiance_;
  std::pmr::vector<Light> normalised_;
  std::pmr::vector<RelumeLight> packed_;
  FrameTimer<1> timer_;
};

// Uniforms of lib/live_volume.glsl. voxel: [m], 0 = there is no light.
void setGrid(const Functions& gl, GLuint program, const VolumeGrid& grid, float voxel);

}  // namespace relume::gl
