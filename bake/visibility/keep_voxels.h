// SPDX-License-Identifier: MIT
// Chooses which of the voxels that the walks hit are worth surfels.
#pragma once

#include "bake/visibility/seen_voxels.h"
#include "relume/bake/context.h"

#include <vector>

namespace relume {

// Drop the voxels with the fewest hits per area, as long as those dropped have no more than 0.5 % of all hits together:
// little light can come from there. Then add voxels that lie between kept ones: hits are random, so that a surface with
// few of them would be full of holes. totalArea [m²]: of the scene, both sides. hasLarge: some triangles have so many
// parts that a VoxelTree pays. Voxels come and go by ascending key.
std::vector<VoxelHits> keepVoxels(const Scene& scene, const VoxelGrid& grid, std::vector<VoxelHits> voxels,
                                  double totalArea, bool hasLarge, Context& context);

}  // namespace relume
