// SPDX-License-Identifier: MIT
// Which caches a receiver reads, and how much of each: around a point of the light map, or of the grid.
#pragma once

#include "formats/map_sight.h"
#include "runtime/shared/packed_caches.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace relume {

// The four texels around a point and its position between them. Texel centres are at (i + 0.5) / size; beyond the outer
// ones the map is constant.
struct TexelQuad {
  std::array<std::size_t, 4> texel;
  std::array<float, 4> weight;
};

// The map must not be empty. Any uv will do: NaN counts as 0.
inline TexelQuad texelsAround(const PackedMap& map, const glm::vec2& uv) {
  const glm::vec2 size(static_cast<float>(map.width), static_cast<float>(map.height));
  const glm::vec2 p = glm::min(glm::max(glm::vec2(0.0f), uv * size - 0.5f), size - 1.0f);
  const auto x0 = static_cast<std::uint32_t>(p.x), y0 = static_cast<std::uint32_t>(p.y);
  const std::uint32_t x1 = std::min(x0 + 1, map.width - 1), y1 = std::min(y0 + 1, map.height - 1);
  const glm::vec2 f(p.x - static_cast<float>(x0), p.y - static_cast<float>(y0));
  const std::size_t row0 = std::size_t{y0} * map.width, row1 = std::size_t{y1} * map.width;
  return {{row0 + x0, row0 + x1, row1 + x0, row1 + x1},
          {(1 - f.x) * (1 - f.y), f.x * (1 - f.y), (1 - f.x) * f.y, f.x * f.y}};
}

// Where a receiver at that point of the map reads it: on its own side of what stands on its surface. What is not finite
// stays.
inline glm::vec2 pointInSight(const PackedMap& map, const glm::vec2& uv) {
  if (map.sight.empty() || !std::isfinite(uv.x) || !std::isfinite(uv.y)) return uv;
  const glm::vec2 size(static_cast<float>(map.width), static_cast<float>(map.height));
  const glm::vec2 p = glm::min(glm::max(glm::vec2(0.0f), uv * size - 0.5f), size - 1.0f);
  const glm::uvec2 low(p);
  const std::uint32_t word = map.sight[std::size_t{low.y} * map.width + low.x];
  if (word >> 24 == 0) return uv;
  return (glm::vec2(low) + placeInSight(word, p - glm::vec2(low)) + 0.5f) / size;
}

// Up to sixteen caches and their weights, of which each is a normal float: the reciprocal of their total is finite.
struct Stencil {
  std::array<std::uint32_t, 16> cache;
  std::array<float, 16> weight;
  int count = 0;

  void add(std::uint32_t c, float w) {
    if (!(w >= std::numeric_limits<float>::min())) return;
    cache[static_cast<std::size_t>(count)] = c;
    weight[static_cast<std::size_t>(count++)] = w;
  }
  float total() const {
    float sum = 0.0f;
    for (int k = 0; k < count; ++k) sum += weight[static_cast<std::size_t>(k)];
    return sum;
  }
};

// The caches of a point of the map, texels without one left out. Empty without a map.
inline Stencil lightmapStencil(const PackedMap& map, const glm::vec2& uv) {
  Stencil stencil;
  if (map.cache.empty()) return stencil;
  const TexelQuad quad = texelsAround(map, uv);
  for (std::size_t k = 0; k < 4; ++k) {
    const std::uint32_t cache = map.cache[quad.texel[k]];
    if (cache != kNoCache) stencil.add(cache, quad.weight[k]);
  }
  return stencil;
}

// The mean of their normals: unit where they agree, the shorter the more they differ, zero when they have none.
inline glm::vec3 meanNormal(const PackedMap& map, const Stencil& stencil) {
  glm::vec3 sum(0.0f);
  for (std::size_t k = 0; k < static_cast<std::size_t>(stencil.count); ++k) {
    sum += stencil.weight[k] * map.normalOf(stencil.cache[k]);
  }
  const float total = stencil.total();
  return total > 0.0f ? sum / total : glm::vec3(0.0f);
}

// What the corners of a receiver's cell weigh before it is known which of their caches it sees: bit 0 of a corner is x.
struct CornerWeights {
  std::array<float, 8> lattice{}, brick{};
  glm::uvec3 cell{0};      // of the lattice
  glm::uvec3 middle{0};    // which half of the brick along each axis
  std::size_t points = 0;  // where the brick's are in PackedGrid::fine
};

// Weights of a cube's corners at f within it.
inline std::array<float, 8> trilinear(const glm::vec3& f) {
  const glm::vec3 g = 1.0f - f;
  const float yz[4] = {g.y * g.z, f.y * g.z, g.y * f.z, f.y * f.z};
  return {g.x * yz[0], f.x * yz[0], g.x * yz[1], f.x * yz[1], g.x * yz[2], f.x * yz[2], g.x * yz[3], f.x * yz[3]};
}

inline glm::uvec3 cornerOffset(std::uint32_t corner) { return {corner & 1u, (corner >> 1) & 1u, corner >> 2}; }

// The cell of a receiver, the position clamped to the lattice. A hanging point of a brick hands its weight to the
// corners of the lattice that it lies between.
inline CornerWeights cornersAround(const PackedGrid& grid, const glm::vec3& positionWorld) {
  CornerWeights corners;
  const glm::uvec3 cells = grid.cells();
  const glm::vec3 safeSpacing = glm::max(grid.spacing, glm::vec3(1e-20f));
  const glm::vec3 p = glm::min(glm::max(glm::vec3(0.0f), (positionWorld - grid.originWorld) / safeSpacing),
                               glm::vec3(grid.resolution - 1u));
  corners.cell = glm::min(glm::uvec3(p), cells - 1u);
  const glm::vec3 f = p - glm::vec3(corners.cell);
  const std::uint32_t brick =
      grid.brick.empty()
          ? kNoBrick
          : grid.brick[(std::size_t{corners.cell.z} * cells.y + corners.cell.y) * cells.x + corners.cell.x];
  if (brick == kNoBrick) {
    corners.lattice = trilinear(f);
    return corners;
  }
  corners.points = std::size_t{kBrickWords} * brick;
  corners.middle = glm::min(glm::uvec3(2.0f * f), glm::uvec3(1u));
  corners.brick = trilinear(2.0f * f - glm::vec3(corners.middle));
  for (std::uint32_t c = 0; c < 8; ++c) {
    const glm::uvec3 at = corners.middle + cornerOffset(c);
    if (grid.fine[corners.points + (at.z * 3 + at.y) * 3 + at.x] != kHangingPoint) continue;
    const std::array<float, 8> share = trilinear(0.5f * glm::vec3(at));
    for (std::size_t k = 0; k < 8; ++k) corners.lattice[k] += corners.brick[c] * share[k];
    corners.brick[c] = 0.0f;
  }
  return corners;
}

// Weight of a cache by the cosine between a receiver's normal and the way to it: one behind the receiver's plane sees
// what the receiver does not.
inline float wrapWeight(float cosine) {
  const float wrap = std::max(0.05f, 0.5f + 0.5f * cosine);
  return wrap * wrap;
}

// visit(cache, corner, visible, toward) for each cache of the grid around a position: the weight of its corner, how
// much of it is seen from there (formats/grid_depth.h), and the way from the position to it [m]. At most sixteen;
// points without a cache are left out. Needs a grid. A position outside of it has the corners of the nearest place
// in it, but sight and way from where it is itself: a level's outer walls lie there, half a cell off.
template <class Visit>
void visitGridPoints(const PackedCaches& caches, const glm::vec3& positionWorld, const Visit& visit) {
  const PackedGrid& grid = caches.grid();
  const CornerWeights corners = cornersAround(grid, positionWorld);
  const auto add = [&](std::uint32_t cache, float w) {
    if (cache == kNoCache) return;
    const glm::vec3 toward = grid.positionWorld[cache] - positionWorld;
    visit(cache, w, grid.sight.empty() ? 1.0f : grid.sight.weight(cache, -toward), toward);
  };
  const glm::uvec3 r = grid.resolution;
  for (std::uint32_t c = 0; c < 8; ++c) {
    const glm::uvec3 offset = cornerOffset(c), at = glm::min(corners.cell + offset, r - 1u),
                     fine = corners.middle + offset;
    if (corners.lattice[c] > 0.0f) add(grid.cache[(std::size_t{at.z} * r.y + at.y) * r.x + at.x], corners.lattice[c]);
    if (corners.brick[c] > 0.0f) add(grid.fine[corners.points + (fine.z * 3 + fine.y) * 3 + fine.x], corners.brick[c]);
  }
}

// The caches of the grid around a receiver with unit normal. Two weights beside the corners': wrap, as a cache behind
// the receiver's plane sees what the receiver does not; and visibility, as one behind a wall sees another room. Points
// without a cache are left out.
inline Stencil gridStencil(const PackedCaches& caches, const glm::vec3& positionWorld, const glm::vec3& normal) {
  Stencil stencil;
  if (caches.grid().cache.empty()) return stencil;
  visitGridPoints(caches, positionWorld,
                  [&](std::uint32_t cache, float corner, float visible, const glm::vec3& toward) {
                    const float distance = glm::length(toward);
                    const float wrap = wrapWeight(distance > 0.0f ? glm::dot(toward, normal) / distance : 1.0f);
                    stencil.add(cache, corner * wrap * visible);
                  });
  return stencil;
}

}  // namespace relume
