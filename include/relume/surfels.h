// SPDX-License-Identifier: MIT
// Surfels: the discs of equal area that stand for every surface light can come from (PIC 4.2). The runtime lights
// them; their radiosity enters the hierarchy at its leaves.
#pragma once

#include "relume/array.h"
#include "relume/vectors.h"

#include <cstdint>

namespace relume {

// Value of Surfels::receiver for a surfel that reads its own irradiance from the grid.
inline constexpr std::uint32_t kGridReceiver = 0xFFFFFFFFu;

// Structure of arrays, all [Size n_S]. Invariants: normals are unit, albedo is in [0,1], emission is finite and >= 0.
struct Surfels {
  Array<glm::vec3> positionWorld;  // [m] centre
  Array<glm::vec3> normal;         // unit, away from the lit side: the shading normal where the surfel stands
  Array<glm::vec3> albedo;         // [0..1] mean over the surfel's footprint, linear
  Array<glm::vec3> emission;       // [W/m²/sr] mean emitted radiance over the footprint
  Array<std::uint32_t> receiver;   // light-map point (packUnorm16x2) where the surfel reads its own irradiance for the
                                   // next bounce, or kGridReceiver
  Array<std::uint32_t> instance;   // index into Bake::instances: which part of the scene the surfel lies on
  float areaEach = 0.0f;           // [m²] of every surfel; n_S * areaEach = represented area within 0.1 %

  std::uint32_t count() const { return static_cast<std::uint32_t>(positionWorld.size()); }
};

}  // namespace relume
