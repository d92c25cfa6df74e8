// SPDX-License-Identifier: MIT
// The grid as one buffer of words, in the order that shaders/resolve.glsl reads: caches of the lattice's points, bricks
// of its cells, the bricks, then for each cache of the grid its position and how far it sees. Last come the words that
// keep receivers of the light map on their side of walls.
#pragma once

#include "formats/grid_depth.h"
#include "formats/limits.h"
#include "relume/glossy.h"
#include "runtime/shared/grid_texture.h"
#include "runtime/shared/packed_caches.h"
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

struct PackedGridLayout {
  gl::RelumeResolve resolve{};
  std::uint32_t caches = 0;  // that have a record: all that the grid reads
  std::size_t words = 0;
};

inline PackedGridLayout layoutGrid(const PackedCaches& packed, const GridTexture& texture) {
  const PackedGrid& grid = packed.grid();
  PackedGridLayout layout;
  gl::RelumeResolve& resolve = layout.resolve;
  resolve.gridOriginWorld = grid.originWorld;
  resolve.gridSpacing = grid.spacing;
  resolve.gridResolution = grid.resolution;
  resolve.gridDepthUnit = grid.depthUnit;
  resolve.gridFinestSpacing = grid.finestSpacing;
  resolve.gridTextureSpacing = texture.spacing;
  resolve.gridTextureStep = texture.resolution.z + 1;
  resolve.gridTextureResolution = texture.resolution;
  layout.words = grid.cache.size();
  resolve.gridBricks = grid.brick.empty() ? gl::kRelumeNone : static_cast<std::uint32_t>(layout.words);
  layout.words += grid.brick.size();
  resolve.gridFine = static_cast<std::uint32_t>(layout.words);
  layout.words += grid.fine.size();
  resolve.gridCaches = static_cast<std::uint32_t>(layout.words);
  resolve.gridDepthWords = grid.sight.empty() ? 0 : kDepthWords;
  layout.caches = static_cast<std::uint32_t>(grid.positionWorld.size());
  layout.words += std::size_t{layout.caches} * (3 + resolve.gridDepthWords);
  const std::size_t sight = packed.map().sight.size();
  resolve.mapSight = sight == 0 ? gl::kRelumeNone : static_cast<std::uint32_t>(layout.words);
  layout.words += sight;
  return layout;
}

inline std::pmr::vector<std::uint32_t> packGrid(const PackedCaches& packed, const PackedGridLayout& layout,
                                                std::pmr::memory_resource* memory) {
  const PackedGrid& grid = packed.grid();
  std::pmr::vector<std::uint32_t> words(memory);
  words.reserve(layout.words);
  for (const CacheIndex* part : {&grid.cache, &grid.brick, &grid.fine}) {
    for (std::size_t i = 0; i < part->size(); ++i) words.push_back((*part)[i]);
  }
  const std::size_t depthWords = layout.resolve.gridDepthWords;
  for (std::uint32_t cache = 0; cache < layout.caches; ++cache) {
    for (int k = 0; k < 3; ++k) words.push_back(std::bit_cast<std::uint32_t>(grid.positionWorld[cache][k]));
    words.resize(words.size() + depthWords);
    if (depthWords > 0) grid.sight.read(cache, std::span(words).last(depthWords));
  }
  words.insert(words.end(), packed.map().sight.begin(), packed.map().sight.end());
  return words;
}

}  // namespace relume
