// SPDX-License-Identifier: MIT
// Flattens regions of faces to charts: orthogonal projection along the mean normal, a search for overlaps, and the
// smallest rectangle around the result.
#pragma once

#include "bake/caches/caches.h"
#include "bake/caches/charts/segment.h"

#include <span>
#include <vector>

namespace relume {

// Project faces along their area-weighted mean normal. `scale` turns object units to metres.
Chart projectPlanar(const Mesh& mesh, const FaceGraph& graph, std::span<const std::uint32_t> faces, float scale);

// Split off the triangles of a chart that lie over others of it in uv, found by sampling: `chart` keeps the rest, in
// order. Returns the triangles split off; empty when nothing overlaps.
std::vector<std::uint32_t> splitOverlaps(Chart& chart);

// Turn the chart to the rectangle of least area around it, longer side along u, and shift its corner to (0, 0).
void fitRectangle(Chart& chart);

// Recompute Chart::areaUv and areaSurface from its corners.
void measureChart(Chart& chart, const FaceGraph& graph, float scale);

// Area-weighted root mean square of the stretch of the map uv -> surface (Sander et al. 2001), after scaling to equal
// areas; 1 = isometric. Infinite when a triangle is turned over or has no area in uv.
double stretchOf(const Mesh& mesh, const Chart& chart, const FaceGraph& graph, float scale);

}  // namespace relume
