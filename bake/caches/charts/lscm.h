// SPDX-License-Identifier: MIT
// Least-squares conformal maps by CGAL, for charts too curved for a projection.
#pragma once

#include "bake/caches/caches.h"
#include "bake/caches/charts/segment.h"

#include <optional>
#include <span>

namespace relume {

// The chart of connected faces with a border, scaled so that areaUv = areaSurface; nothing when the faces are closed or
// not a manifold, or the solver fails. May turn triangles over or overlap: the caller checks.
std::optional<Chart> mapConformal(const Mesh& mesh, const FaceGraph& graph, std::span<const std::uint32_t> faces,
                                  float scale);

}  // namespace relume
