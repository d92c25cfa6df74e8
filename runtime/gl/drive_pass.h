// SPDX-License-Identifier: MIT
// Before step 2: the emission of surfels whose material a frame drives, written over the baked one (GpuBake::emission),
// and the baked one back when no frame drives any more.
#pragma once

#include "relume/lights.h"
#include "runtime/gl/upload.h"
#include "runtime/shared/driven_emission.h"

#include <array>
#include <memory_resource>

namespace relume::gl {

class DrivePass {
 public:
  explicit DrivePass(std::pmr::memory_resource* memory) : texture_(memory) {}
  // State must be saved. failed: the shader's log.
  static Result<DrivePass> create(const Functions& gl, const Emitters& emitters, const ImageSizes& sizes,
                                  std::pmr::memory_resource* memory);
  // What cannot be read of the textures: usage. Puts back what it binds.
  Status check(const Functions& gl, const LightSetup& setup, const ImageSizes& sizes) const;
  // Textures for images that come for the first time. State must be saved.
  void reserve(const Functions& gl, const LightSetup& setup, DrivenEmission& driven);
  // `driven` has begun the frame. undriven: factor on what is baked. State must be saved.
  void run(const Functions& gl, const GpuBake& gpu, DrivenEmission& driven, const glm::vec3& undriven);
  std::size_t textureBytes() const { return textureBytes_; }

 private:
  void uploadImage(const Functions& gl, const ImagePyramid& image, const Texture& texture) const;
  void dispatch(const Functions& gl, GLuint first, GLuint end, GLuint by, const glm::vec3& factor) const;

  Program program_;
  std::array<Sampler, 4> sampler_;     // repeat or clamp along u (bit 0) and v (bit 1); none without declared images
  std::pmr::vector<Texture> texture_;  // [Size materials] of images in main memory, made when the first one comes
  std::size_t textureBytes_ = 0;
  GLint firstEntry_ = -1, endEntry_ = -1, drivenBy_ = -1, factor_ = -1;
};

}  // namespace relume::gl
