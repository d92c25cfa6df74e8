// SPDX-License-Identifier: MIT
// Which surfaces matter: random walks start where receivers can be (cameras, play volumes, free space without either)
// and note the sides of the triangles that light could come from. What no walk reaches gets no surfels and no caches.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/visibility/cell_tree.h"
#include "bake/visibility/seen_cells.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/result.h"

#include <cmath>
#include <cstdint>
#include <vector>

namespace relume {

// A side of a scene-wide triangle: 2 * triangle + (back ? 1 : 0).
struct PlaySpace {
  std::vector<float> seenArea;  // [m²] [Size 2 * triangles] how much of the side's area can send light to receivers;
                                // between 0 and the triangle's area (big triangles may be seen in part)
  std::vector<std::uint8_t> visible;  // [Size 2 * triangles] 1 where light goes straight to some receiver; a side with
                                      // seenArea alone matters through bounces only
  std::vector<float> farShare;      // [Size 0 or 2 * triangles] of sides that are seen from far away only, as a sky box
                                    // is, all of them: their share of what receivers see, > 0. Not in seenTotal
  glm::vec3 lookedAtMin{INFINITY};  // [m] the box of all but the outermost hundredth of what receivers look at along
  glm::vec3 lookedAtMax{-INFINITY};     // each axis; empty when walks were not asked
  std::vector<glm::vec3> receivers;     // [m] points in free space the walks passed: where receivers can be
  double seenTotal = 0.0, total = 0.0;  // [m²] both sides counted

  // Where a side is seen in part: the cells of space in which it is. See seenAt().
  const Scene* scene = nullptr;      // must outlive this; null = no side is seen in part
  std::vector<std::uint8_t> partly;  // [Size 0 or 2 * triangles] 1 where seenAt() has to look at the cells
  CellIndex cells;                   // the seen ones: instance, direction of the normal, voxel
  CellTree tree;                     // and where there are any; empty when no triangle is large
  glm::vec3 cellOrigin{0.0f};        // [m]
  float cellSize = 0.0f;             // [m]

  bool isFar(std::uint32_t side) const { return !farShare.empty() && farShare[side] > 0.0f; }
  // Whether light may matter from some point of this side in a box [m]; never says no where seenAt() says yes.
  bool mayBeSeenIn(std::uint32_t side, const glm::vec3& low, const glm::vec3& high) const;
  // Whether light from this point's side can matter. Thread-safe.
  bool seenAt(std::uint32_t side, const glm::vec2& barycentric) const;
};

// failed: no surface can be seen at all, or cancelled. Same result at any thread count. The tracer's scene must
// outlive the result. Notes "seen_area_m2" and "culled_share" as figures.
Result<PlaySpace> findPlaySpace(const RayTracer& tracer, const PlaySpaceOptions& options, std::uint64_t seed,
                                Context& context);

}  // namespace relume
