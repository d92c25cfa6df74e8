// SPDX-License-Identifier: MIT
// Lays the two levels of the grid (include/relume/caches.h): the lattice, and bricks in its cells through which seen
// surfaces pass. Empty air then costs an eighth of what it would at the bricks' spacing.
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

// A point of a layout, by its coordinates on the fine lattice, of which the coarse lattice has the even ones.
struct GridPoint {
  glm::uvec3 fine{0};
  bool refined = false;  // has bricks around it, so that its neighbours may be at half the spacing
};

// All points of a layout: the lattice's in their order, then the points of bricks that do not hang.
std::vector<GridPoint> pointsOf(const GridLayout& layout);

// The points of all bricks as indices into pointsOf(), kHangingPoint and kNoCache. [Size kBrickWords * bricks]
std::vector<std::uint32_t> brickPoints(const GridLayout& layout);

// Lay out what the options ask for: a lattice alone for gridResolution, two levels for gridSpacing (which is that of
// the bricks), or two levels of about `count` points for gridCaches. No points for 0.
Result<GridLayout> layoutGrid(const RayTracer& tracer, const PlaySpace& playSpace, const CacheOptions& options,
                              double count, Context& context);

}  // namespace relume
