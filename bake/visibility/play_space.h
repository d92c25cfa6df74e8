// SPDX-License-Identifier: MIT
// Finds the surfaces that matter: random walks start where receivers can be (at cameras, in play volumes, or in free
// space without either) and note from which sides of which triangles light could come. What no walk reaches gets
// neither surfels nor caches.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "bake/visibility/seen_voxels.h"
#include "bake/visibility/side_array.h"
#include "bake/visibility/voxel_tree.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/result.h"

#include <cmath>
#include <cstdint>
#include <vector>

namespace relume {

// A side of a scene-wide triangle: 2 * triangle + (back ? 1 : 0).
struct PlaySpace {
  SideArray<float> seenArea;      // [m²] [Size 2 * triangles] area of the side that can send light to receivers, from
                                  // 0 to the triangle's area: a large triangle may be seen in part
  SideArray<std::uint8_t> flags;  // [Size 2 * triangles] kVisible, kPartly
  SideArray<float> farShare;      // [Size 0 or 2 * triangles] > 0 for sides seen from far away only, such as a sky box:
                                  // their share of what receivers see. They are not in seenTotal
  glm::vec3 lookedAtMin{INFINITY};  // [m] box of what receivers look at, without the outermost hundredth at each end of
  glm::vec3 lookedAtMax{-INFINITY};     // each axis; empty when no walks were made
  std::vector<glm::vec3> receivers;     // [m] points in free space that the walks passed: where receivers can be
  double seenTotal = 0.0, total = 0.0;  // [m²] both sides counted

  // Which parts of a side are seen, where not all of it is: those in a seen voxel. See seenAt().
  const Scene* scene = nullptr;  // must outlive this; null = no side is seen in part
  VoxelIndex voxels;             // the seen ones
  VoxelTree tree;                // the same by boxes; empty when no triangle is large
  glm::vec3 voxelOrigin{0.0f};   // [m]
  float voxelSize = 0.0f;        // [m]

  // A receiver sees the side itself; a side that has only seenArea matters through the light that it bounces on.
  static constexpr std::uint8_t kVisible = 1;
  // seenAt() has to look the voxel up.
  static constexpr std::uint8_t kPartly = 2;
  bool isVisible(std::uint32_t side) const { return (flags[side] & kVisible) != 0; }
  bool isPartly(std::uint32_t side) const { return scene != nullptr && (flags[side] & kPartly) != 0; }
  bool isFar(std::uint32_t side) const { return !farShare.empty() && farShare[side] > 0.0f; }
  // Whether seenAt() may hold for some point of this side within a box [m]. Never says no where it does.
  bool mayBeSeenIn(std::uint32_t side, const glm::vec3& low, const glm::vec3& high) const;
  // Whether light from this point of this side can reach a receiver. Thread-safe.
  bool seenAt(std::uint32_t side, const glm::vec2& barycentric) const;
};

// failed: no surface can be seen at all, or cancelled. The result is the same at any number of threads. The tracer's
// scene must outlive it. Reports the figures "seen_area_m2" and "culled_share".
Result<PlaySpace> findPlaySpace(const RayTracer& tracer, const PlaySpaceOptions& options, std::uint64_t seed,
                                Context& context);

}  // namespace relume
