// SPDX-License-Identifier: MIT
// Caches: the points where light is gathered (PIC 4.4), the grid and the light map that index them, and where each
// triangle of the scene finds its light.
#pragma once

#include "relume/array.h"
#include "relume/vectors.h"

#include <glm/common.hpp>

#include <cstdint>

namespace relume {

inline constexpr std::uint32_t kNoCache = 0xFFFFFFFFu;
// Caches of a bake, at most: the runtime names one in kCacheBits bits where it bounces light.
inline constexpr std::uint32_t kCacheBits = 22, kMaxCaches = 1u << kCacheBits;
// Light-map coordinate of a triangle corner that has none: the triangle is lit by the grid.
inline constexpr std::uint32_t kGridLit = 0xFFFFFFFFu;

// A cell of the grid that is not refined.
inline constexpr std::uint32_t kNoBrick = 0xFFFFFFFFu;
// Words of a brick: the caches of 3 x 3 x 3 points, x fastest, at half the lattice's spacing.
inline constexpr std::uint32_t kBrickWords = 27;
// A brick's point that lies on the border of a cell without a brick: it stands for what the lattice has there, so that
// light is continuous where bricks end.
inline constexpr std::uint32_t kHangingPoint = 0xFFFFFFFEu;

// Cache positions in two levels: a uniform lattice, point (x, y, z) at origin + (x, y, z) * spacing, and bricks of half
// its spacing in the cells where surfaces are.
struct CacheGrid {
  glm::uvec3 resolution{0};     // points of the lattice along each axis; 0 = no grid
  glm::vec3 originWorld{0.0f};  // [m]
  glm::vec3 spacing{0.0f};      // [m] of the lattice
  Array<std::uint32_t> cache;   // [Size x*y*z, x fastest] cache of a point, kNoCache = inside something or unseen
  Array<std::uint32_t> brick;   // [Size 0 or cells, max(r-1, 1) along each axis, x fastest] brick of a cell or kNoBrick
  Array<std::uint32_t> fine;    // [Size kBrickWords * bricks] cache of a point, kNoCache or kHangingPoint
  Array<std::uint32_t> depth;   // [Size 0 or kDepthWords * grid caches] how far each sees (formats/grid_depth.h); empty
                                // = receivers behind walls are not told apart

  std::uint32_t brickCount() const { return static_cast<std::uint32_t>(fine.size() / kBrickWords); }
  glm::uvec3 cells() const { return glm::max(resolution, glm::uvec3(2)) - 1u; }
  // [m] what depths are counted in: the largest spacing
  float depthUnit() const { return glm::max(spacing.x, glm::max(spacing.y, spacing.z)); }
  // [m] how far apart points are at least
  float finestSpacing() const {
    return (brick.empty() ? 1.0f : 0.5f) * glm::min(spacing.x, glm::min(spacing.y, spacing.z));
  }
};

// Where the triangles of one drawable part (glTF node x primitive x GPU instance) are on the light map. What a part is
// found again by: Bake::instances[i].node, the node's name, and the three numbers below. The index of a glTF node is
// not among them: it changes whenever a node is put before it.
struct LightmapPart {
  std::uint32_t occurrence = 0;   // how many parts before it have the same node name, primitive and GPU instance; 0 but
                                  // where several nodes have one name
  std::uint32_t primitive = 0;    // primitive of that node's mesh
  std::uint32_t gpuInstance = 0;  // index within EXT_mesh_gpu_instancing; 0 without
  std::uint32_t triangleCount = 0;  // triangles in glTF order; a strip's or fan's triangles in drawing order
  std::uint64_t firstCorner = 0;    // corner k of triangle t is cornerUv[firstCorner + 3 t + k]
};

// The light map: a texture of cache indices, and texture coordinates into it.
struct Lightmap {
  std::uint32_t width = 0, height = 0;  // [texel]
  Array<std::uint32_t> cache;           // [Size width*height, row 0 first] unique cache a texel copies from, dilation
                                        // included; kNoCache = never read
  Array<LightmapPart> parts;            // [Size instances of the bake] in the order of Bake::instances
  Array<std::uint32_t> cornerUv;        // [Size 3 * triangles] packUnorm16x2 or kGridLit; (0,0) is the corner of texel
                                        // row 0, texel centres at (i + 0.5) / size. For the front side; corners in glTF
                                        // order, also where an instance mirrors
  Array<std::uint32_t> backCornerUv;  // [Size 0 or 3 * triangles] the same for the back side, whose light differs: read
                                      // it where gl_FrontFacing is false. Empty = no back side is seen
  Array<std::uint32_t> sight;         // [Size 0 or width*height] for the square between the centres of a texel and
                                      // its upper neighbours: where its points are read, so that none reads across a
                                      // wall. 0 = where they are; formats/map_sight.h has the bits. Relume's resolves
                                      // do it; filters of a host's over irradianceMap() do not
};

// Caches in the order grid, then light map: none is on both. Only unique, valid caches are kept.
struct Caches {
  Array<glm::vec3> positionWorld;  // [m] [Size n_C] where rays start
  Array<glm::vec3> normal;         // [Size n_C] unit for caches on a surface (they gather a hemisphere), zero for
                                   // grid caches (they gather the sphere)
  CacheGrid grid;
  Lightmap lightmap;

  std::uint32_t count() const { return static_cast<std::uint32_t>(positionWorld.size()); }
  // The first cache that a texel holds; count() where none does. The grid reads those before it. Looks at all texels.
  std::uint32_t firstMapCache() const {
    std::uint32_t first = count();
    for (const std::uint32_t held : lightmap.cache) first = glm::min(first, held);
    return first;
  }
};

}  // namespace relume
