// SPDX-License-Identifier: MIT
// Which of the cells that walks hit are worth surfels.
#pragma once

#include "bake/visibility/seen_cells.h"
#include "relume/bake/context.h"

#include <vector>

namespace relume {

// Drop the cells that are thinly hit, so thinly that all of them together hold 0.5 % of the hits: little light can come
// from there. Then add the cells between kept ones: hits are random, and a thinly hit surface would be full of holes.
// totalArea [m²] of the scene, both sides. hasLarge: some triangles are worth a CellTree. Cells by ascending key in and
// out.
std::vector<CellHits> keepCells(const Scene& scene, const CellGrid& grid, std::vector<CellHits> cells, double totalArea,
                                bool hasLarge, Context& context);

}  // namespace relume
