// SPDX-License-Identifier: MIT
// An image that drives a material, as both backends read it: the host's texels and the mip levels over them, sizes as
// OpenGL's. Levels are means by area, also where a size is odd, so that each has the mean of the image.
#pragma once

#include "relume/relighter.h"

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include <array>
#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume {

// [texel] A side of a driven image, at most.
inline constexpr std::uint32_t kMaxDrivenSide = 8192;

class ImagePyramid {
 public:
  // [width, height 1..kMaxDrivenSide] Takes all memory.
  ImagePyramid(std::uint32_t width, std::uint32_t height, std::pmr::memory_resource* memory);

  std::uint32_t levels() const { return levels_; }
  glm::uvec2 size(std::uint32_t level) const;
  // Texels of a level after set(). [Size width * height of the level]
  std::span<const glm::vec3> texels(std::uint32_t level) const;
  std::size_t bytes() const { return below_.size() * sizeof(glm::vec3); }

  // Another image, which the host keeps until clear().
  void set(std::span<const glm::vec3> image, const ParallelFor& parallelFor);
  void clear() { image_ = {}; }

  // Trilinear, as textureLod() with GL_LINEAR_MIPMAP_LINEAR. at: [0..1]²; clampU, clampV: edges are continued, else the
  // image is repeated.
  glm::vec3 sample(const glm::vec2& at, float level, bool clampU, bool clampV) const;

 private:
  glm::vec3 bilinear(const glm::vec2& at, std::uint32_t level, bool clampU, bool clampV) const;

  std::uint32_t width_, height_, levels_ = 1;
  std::array<std::size_t, 15> first_{};  // of each level in below_
  std::span<const glm::vec3> image_;     // level 0
  std::pmr::vector<glm::vec3> below_;    // the others
};

// The level at which a texel stands for as much of the image as a tap of that width (Emitters::tapWidth). [>= 0]
float levelOfTap(float tapWidth, std::uint32_t width, std::uint32_t height);

}  // namespace relume
