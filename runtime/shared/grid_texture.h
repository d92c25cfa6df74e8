// SPDX-License-Identifier: MIT
// The grid as a texture that filters: at each point of a denser lattice irradiance vectors of the six halves
// (formats/irradiance_vector.h). What the texels are made of depends on the level alone and is found once; backends
// fill them every frame, and receivers read them where that is as good as reading the caches around (IVG 4.1, 4.3).
//
// Shares. A texel, a half of a point, is a sum over caches: the mean of what receivers read by gridStencil(), over
// eight positions around the point and four normals of that half. So visibility and wrap act for each half by itself.
// Positions that see no cache are left out; the share of those that do is the texel's weight, by which readers divide.
//
// Trust. A cell is open if its receivers read from the texture what they would read from the caches: half the summed
// difference of the two's weights, in the mean over kProbes receivers, is below RelightOptions::gridTrust. What can
// leak through a wall in an open cell is that share of the weights in the mean, whatever the light. Texels at no corner
// of an open cell have no shares: nothing reads them.
#pragma once

#include "formats/irradiance_vector.h"
#include "relume/relighter.h"
#include "runtime/shared/packed_caches.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory_resource>
#include <optional>
#include <span>
#include <vector>

namespace relume {

// Caches that a texel has at most.
inline constexpr std::size_t kMaxTexelCaches = 8;
// Bytes of a point in OpenGL: six times RGBA16F and RG16F.
inline constexpr std::size_t kTexturePointBytes = 72;
// Receivers that a cell is tried with.
inline constexpr std::uint32_t kProbes = 24;
// Bits of GridTexture::open: the cell may be read, and so may all cells around, as tricubic reads do.
inline constexpr std::uint8_t kOpenCell = 1, kOpenAround = 2;
// Weight of texels below which nothing is known of a receiver's light.
inline constexpr float kMinTexelWeight = 1.0f / 64.0f;

struct GridTexture {
  explicit GridTexture(std::pmr::memory_resource* memory) : begin(memory), shares(memory), open(memory) {}

  glm::vec3 originWorld{0.0f};             // [m] of point (0, 0, 0)
  glm::vec3 spacing{0.0f};                 // [m]
  glm::uvec3 resolution{0};                // points along each axis; 0 = no texture
  std::pmr::vector<std::uint32_t> begin;   // [Size 6 * points + 1] first share of texel 6 * point + half, x fastest
  std::pmr::vector<std::uint32_t> shares;  // as those of gridded surfels (runtime/shared/receivers.h)
  std::pmr::vector<std::uint8_t> open;     // [Size cells, x fastest] kOpenCell, kOpenAround
  std::uint32_t cacheCount = 0;            // caches before it have a part in texels

  bool empty() const { return resolution.x == 0; }
  std::uint32_t points() const { return resolution.x * resolution.y * resolution.z; }
  glm::uvec3 cells() const { return glm::max(resolution, glm::uvec3(2)) - 1u; }
  std::size_t openCells() const;
  std::size_t bytes() const {
    return sizeof(std::uint32_t) * (begin.size() + shares.size()) + open.size() * sizeof(open[0]);
  }
};

// What a texture may be: trust [0..1] and bytes are RelightOptions' gridTrust and gridTextureBytes; maxSide [texel] the
// longest side of a 3-D texture, 0 = any.
struct GridTextureLimits {
  float trust = 0.35f;
  std::size_t bytes = 4u << 20;
  std::uint32_t maxSide = 0;
};

// Texels along z of the 3-D texture: six slabs, one for each half, with a texel between two.
inline std::uint64_t textureDepth(std::uint64_t pointsAlongZ) { return 6 * (pointsAlongZ + 1) - 1; }

// Points four, three, two times or just as dense along each axis as the grid's lattice, the first that is within the
// limits; empty where none is, and without a grid. On the threads of parallelFor. Throws std::bad_alloc.
GridTexture makeGridTexture(const PackedCaches& caches, const GridTextureLimits& limits, const ParallelFor& parallelFor,
                            std::pmr::memory_resource* memory);

// A texel as the processor keeps it: luma vector [W/m²], weight, Co and Cg of the axis, all times the weight;
// two of padding.
inline constexpr std::size_t kTexelFloats = 8;

// Weights of the cubic B-spline for the points before, at, and two past a cell's lower corner, at f [0..1] within it.
inline std::array<float, 4> splineWeights(float f) {
  const float g = 1.0f - f, f2 = f * f, g2 = g * g;
  return {g * g2 / 6.0f, (4.0f - 3.0f * f2 * (2.0f - f)) / 6.0f, (4.0f - 3.0f * g2 * (2.0f - g)) / 6.0f, f * f2 / 6.0f};
}

// Irradiance [W/m²] at a receiver by texels [Size kTexelFloats * 6 * points], never negative; nothing where the cell is
// not open, the position is more than half a spacing outside the grid, or no texel around knows any light. smooth: by a
// cubic B-spline over 64 points, where all cells around are open, in place of trilinear. normal: as irradianceInGrid().
std::optional<glm::vec3> readGridTexture(const GridTexture& texture, std::span<const float> texels,
                                         const glm::vec3& positionWorld, const glm::vec3& normal, bool smooth);

}  // namespace relume
