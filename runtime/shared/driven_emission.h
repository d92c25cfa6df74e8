// SPDX-License-Identifier: MIT
// What a frame puts in place of the baked emission (MaterialEmission): the check of it, which is the relighter's, and
// the radiance of each emitter entry, which the CPU backend asks for.
#pragma once

#include "relume/emitters.h"
#include "relume/lights.h"
#include "relume/relighter.h"
#include "runtime/shared/image_pyramid.h"

#include <memory_resource>
#include <span>
#include <vector>

namespace relume {

// Size of the image that was declared for a material; 0 x 0 = none.
using ImageSizes = std::pmr::vector<glm::uvec2>;

// The declared images by material. [Size materials] usage: no such drivable material, no texture coordinates, declared
// twice, a size out of range.
Result<ImageSizes> declareImages(const Emitters& emitters, std::span<const DrivenImage> images,
                                 std::pmr::memory_resource* memory);

// What check() says of LightSetup::materialEmissions: everything but whether textures exist.
Status checkEmissions(const LightSetup& setup, const Emitters& emitters, const ImageSizes& sizes, BackendKind backend);

// Radiance as the bake's packed colours hold it: NaN and what is negative are 0.
glm::vec3 clampRadiance(const glm::vec3& radiance);

class DrivenEmission {
 public:
  DrivenEmission(const Emitters& emitters, const ImageSizes& sizes, std::pmr::memory_resource* memory);
  DrivenEmission(const DrivenEmission&) = delete;
  DrivenEmission& operator=(const DrivenEmission&) = delete;

  const Emitters& emitters() const { return emitters_; }
  // Begin a frame whose emissions have passed checkEmissions(): mip levels of its images. end() forgets the host's.
  void begin(std::span<const MaterialEmission> emissions, const ParallelFor& parallelFor);
  void end();

  bool drives(std::uint32_t material) const { return frame_[material] != nullptr; }
  // [W/m²/sr] Of an entry of a material that the frame drives, not by a texture.
  glm::vec3 radiance(std::uint32_t material, std::uint32_t entry) const;
  // What the frame says of a material; null = nothing.
  const MaterialEmission* of(std::uint32_t material) const { return frame_[material]; }
  // Of a material whose image was declared; null = none was.
  ImagePyramid* image(std::uint32_t material);
  std::size_t bytes() const;

 private:
  static constexpr std::uint32_t kNoImage = 0xFFFFFFFFu;
  Emitters emitters_;
  std::pmr::vector<const MaterialEmission*> frame_;  // [Size materials]
  std::pmr::vector<std::uint32_t> imageOf_;          // [Size materials] into image_, or kNoImage
  std::pmr::vector<ImagePyramid> image_;
};

}  // namespace relume
