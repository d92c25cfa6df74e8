// SPDX-License-Identifier: MIT
// The grid as one buffer of words, in the order that shaders/resolve.glsl reads: caches of the lattice's points, bricks
// of its cells, the bricks, then for each cache of the grid its position and how far it sees.
#pragma once

#include "formats/grid_depth.h"
#include "formats/limits.h"
#include "relume/caches.h"
#include "relume/glossy.h"
#include "runtime/shared/grid_texture.h"
#include "runtime/shared/resolve.h"
#include "shaders/shared/layout.h"

#include <algorithm>
#include <bit>
#include <memory_resource>
#include <vector>

namespace relume {

static_assert(gl::kRelumeDepthSide == kDepthSide && gl::kRelumeBrickWords == kBrickWords &&
              gl::kRelumeHanging == kHangingPoint);
static_assert(RELUME_MAX_COORDINATE == kMaxCoordinate && RELUME_MAX_NORMAL2 == kMaxNormal2 &&
              RELUME_MAX_EXPONENT == kMaxExponent);
static_assert(RELUME_OPEN_CELL == kOpenCell && RELUME_OPEN_AROUND == kOpenAround &&
              RELUME_MIN_TEXEL_WEIGHT == kMinTexelWeight);

struct PackedGrid {
  std::pmr::vector<std::uint32_t> words;
  gl::RelumeResolve resolve{};
};

inline PackedGrid packGrid(const Caches& caches, const GridTexture& texture, std::pmr::memory_resource* memory) {
  const CacheGrid& grid = caches.grid;
  PackedGrid packed{std::pmr::vector<std::uint32_t>(memory)};
  std::pmr::vector<std::uint32_t>& words = packed.words;
  gl::RelumeResolve& resolve = packed.resolve;
  resolve.gridOriginWorld = grid.originWorld;
  resolve.gridSpacing = grid.spacing;
  resolve.gridResolution = grid.resolution;
  resolve.gridDepthUnit = grid.depthUnit();
  resolve.gridFinestSpacing = grid.finestSpacing();
  resolve.gridTextureSpacing = texture.spacing;
  resolve.gridTextureStep = texture.resolution.z + 1;
  resolve.gridTextureResolution = texture.resolution;
  words.assign(grid.cache.begin(), grid.cache.end());
  resolve.gridBricks = grid.brick.empty() ? gl::kRelumeNone : static_cast<std::uint32_t>(words.size());
  words.insert(words.end(), grid.brick.begin(), grid.brick.end());
  resolve.gridFine = static_cast<std::uint32_t>(words.size());
  words.insert(words.end(), grid.fine.begin(), grid.fine.end());
  resolve.gridCaches = static_cast<std::uint32_t>(words.size());

  // Every cache that the grid reads has a record.
  std::uint32_t count = 0;
  const auto grow = [&](std::uint32_t cache) { count = cache >= kHangingPoint ? count : std::max(count, cache + 1); };
  for (const std::uint32_t cache : grid.cache) grow(cache);
  for (const std::uint32_t cache : grid.fine) grow(cache);
  resolve.gridDepthWords = grid.depth.empty() ? 0 : kDepthWords;
  for (std::uint32_t cache = 0; cache < count; ++cache) {
    for (int k = 0; k < 3; ++k) words.push_back(std::bit_cast<std::uint32_t>(caches.positionWorld[cache][k]));
    const auto depth = grid.depth.span().subspan(std::size_t{resolve.gridDepthWords} * cache, resolve.gridDepthWords);
    words.insert(words.end(), depth.begin(), depth.end());
  }
  return packed;
}

}  // namespace relume
