// SPDX-License-Identifier: MIT
// Lays the two levels of the grid (include/relume/caches.h): its lattice, and the cells that get bricks because
// surfaces that are seen pass through them. Air then costs an eighth.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/options.h"

#include <cstdint>
#include <vector>

namespace relume {

struct GridLayout {
  glm::uvec3 resolution{0};     // points of the lattice
  glm::vec3 originWorld{0.0f};  // [m]
  glm::vec3 spacing{0.0f};      // [m]
  std::vector<std::uint32_t>
      brick;  // [Size 0 or cells] brick of a cell, kNoBrick = none; numbered in the order of cells
  std::uint32_t brickCount = 0;

  glm::uvec3 cells() const { return glm::max(resolution, glm::uvec3(2)) - 1u; }
};

// A point of a layout by its place on the fine lattice; even ones are the lattice's.
struct GridPoint {
  glm::uvec3 fine{0};
  bool refined = false;  // surrounded by bricks in part: its neighbours may be at half the spacing
};

// All points that a layout has: the lattice's in their order, then those of bricks that do not hang.
std::vector<GridPoint> pointsOf(const GridLayout& layout);

// The points of all bricks as indices into pointsOf(), kHangingPoint and kNoCache. [Size kBrickWords * bricks]
std::vector<std::uint32_t> brickPoints(const GridLayout& layout);

// By the options: a lattice alone for gridResolution; two levels for gridSpacing, which is that of bricks; two levels
// of about `count` points for gridCaches. No points for 0.
Result<GridLayout> layoutGrid(const RayTracer& tracer, const PlaySpace& playSpace, const CacheOptions& options,
                              double count, Context& context);

}  // namespace relume
