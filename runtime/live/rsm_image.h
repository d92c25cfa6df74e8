// SPDX-License-Identifier: MIT
// Reflective shadow maps (CRC 2.2, after Dachsbacher and Stamminger 2005): of what the texels of a light's shadow map
// see, where it is and how much light it reflects. And the samples that a frame draws from them.
#pragma once

#include "relume/result.h"

#include <glm/vec3.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace relume {

struct RsmTexel {
  glm::vec3 positionWorld{0.0f};  // [m] within 1e9 on each axis
  float area = 0.0f;              // [m²] [>= 0, finite] of the surface that the texel sees; 0 = it sees nothing
  glm::vec3 normal{0.0f};         // unit, on the side that is lit; of texels that see nothing not read
  glm::vec3 flux{0.0f};           // [W] [>= 0, finite] reflected: albedo times the light that arrives
};

// The map of one light: a square for directional lights and spots, the six sides of a cube for lights that shine all
// around. Which way they look does not matter here.
struct RsmImage {
  std::span<const RsmTexel> texel;  // [Size faces side²] face after face
  std::uint32_t side = 0;           // [1..4096]
  std::uint32_t faces = 1;          // 1 or 6
};

// One X_k of CRC Eq. (2), and where in each cell it is received.
struct RsmSample {
  glm::vec3 positionWorld{0.0f};  // X_k [m]
  glm::vec3 normal{0.0f};         // n_k
  glm::vec3 power{0.0f};          // n_texels / (pi n_s) Phi_k [W/sr] as Y, Co, Cg
  float softening = 0.0f;         // [m²] area that the sample stands for, over pi
  glm::vec3 place{0.0f};          // P_k in its cell [0..1)
};

inline constexpr float kMaxRsmFlux = 1e30f;  // [W] of a channel, and [m²]: sums over a map stay finite

// usage: side or faces out of range; the message names the map.
Status checkRsmSize(std::size_t map, std::uint32_t side, std::uint32_t faces);
// usage: a span of another size than side and faces say, side or faces out of range, a texel with a number that is not
// finite or out of its range; the message names map and texel.
Status checkRsm(std::span<const RsmImage> images);

// About `count` samples of all maps, shared out by their flux, at least one of each map that reflects light: points of
// the Halton sequence over the map, which go on where the set before ended. A map with no more texels than samples has
// each of its texels once. Samples of texels that reflect nothing are left out. [images pass
// checkRsm(), count >= 1]
std::vector<RsmSample> drawSamples(std::span<const RsmImage> images, std::uint32_t count, std::uint32_t set);

}  // namespace relume
