// SPDX-License-Identifier: MIT
// Piles: many opaque triangles with the same corners, as a level has them that places one mesh a thousand times at one
// spot. Of triangles in one place a ray hits the first whose front it meets (ray_overlaps.cpp), so all but the first of
// each winding can never be hit; asked about one after the other they would cost the square of their number.
#pragma once

#include "relume/bake/scene.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Fewer triangles than this in one place stay: they cost little, and leaving them in keeps every tree as it was.
inline constexpr std::size_t kPile = 8;

// For each instance in `instances`, which of its triangles no ray can hit (1), or nothing where all can be.
// [Size instances][Size triangles or 0]
std::vector<std::vector<std::uint8_t>> findBuried(const Scene& scene, std::span<const std::uint32_t> instances);

// For each instance in `instances`, 1 where it is one of a pile of instances: the same opaque mesh with the same
// transform as at least kPile before it. [Size instances]
std::vector<std::uint8_t> findBuriedInstances(const Scene& scene, std::span<const std::uint32_t> instances);

}  // namespace relume
