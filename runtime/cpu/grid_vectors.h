// SPDX-License-Identifier: MIT
// Fills the grid's texture (runtime/shared/grid_texture.h) with a frame's light: irradiance vectors of each cache that
// has a part in it, then of each texel the sum over its caches. shaders/fill_grid_texture.comp is the same arithmetic;
// a test runs both.
#pragma once

#include "runtime/shared/grid_texture.h"
#include "runtime/shared/resolve.h"

#include <array>
#include <memory_resource>
#include <span>
#include <vector>

namespace relume::cpu {

// Vectors of the six halves of a cache: Y, Co and Cg, three floats each and three of padding [W/m²].
inline constexpr std::size_t kVectorFloats = 12;
using CacheVectors = std::array<float, 6 * kVectorFloats>;

// From the coefficients of a grid cache; what two bands of luma or chroma lack of the clamped cosine is guessed as it
// is for receivers (runtime/shared/resolve.h). [Size c = bands.stride()]
void makeCacheVectors(const CacheBands& bands, std::span<const float> c, CacheVectors& vectors);

class GridVectors {
 public:
  // Takes all memory that fill() needs.
  GridVectors(GridTexture texture, std::pmr::memory_resource* memory);

  void fill(const CacheLight& light, const ParallelFor& parallelFor);

  const GridTexture& texture() const { return texture_; }
  // [Size kTexelFloats * 6 * points]
  std::span<const float> texels() const { return texels_; }
  std::size_t bytes() const;

 private:
  GridTexture texture_;
  std::pmr::vector<CacheVectors> vectors_;
  std::pmr::vector<float> texels_;
};

}  // namespace relume::cpu
