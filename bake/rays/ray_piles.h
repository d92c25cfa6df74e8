// SPDX-License-Identifier: MIT
// Finds piles: many opaque triangles with the same corners, as in a level that has a thousand copies of a mesh at one
// spot. Of coincident triangles, a ray hits the first whose front it meets (ray_overlaps.cpp). So only the first of
// each winding can ever be hit, and to ask about the others would cost the square of their number.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/scene.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Fewer coincident triangles than this are left in: they cost little, and the trees of most levels stay as they are.
inline constexpr std::size_t kPile = 8;

// For each instance in `instances`, 1 for its triangles that no ray can hit; empty when any of them can be hit.
// [Size instances][Size triangles or 0]
std::vector<std::vector<std::uint8_t>> findBuried(const Scene& scene, std::span<const std::uint32_t> instances,
                                                  Context& context);

// For each instance in `instances`, 1 when at least kPile instances before it have the same opaque mesh and the same
// transform. [Size instances]
std::vector<std::uint8_t> findBuriedInstances(const Scene& scene, std::span<const std::uint32_t> instances);

}  // namespace relume
