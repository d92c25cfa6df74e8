// SPDX-License-Identifier: MIT
// Places the caches: the grid and the light map (PIC 4.4).
#pragma once

#include "bake/caches/map_corners.h"
#include "bake/rays/ray_tracer.h"
#include "bake/surfels/surfels.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/caches.h"
#include "relume/result.h"

namespace relume {

// A flat piece of a mesh's surface, before it is scaled to texels: object-space metres in the plane.
struct Chart {
  std::vector<std::uint32_t> triangle;       // of the mesh
  std::vector<std::array<glm::vec2, 3>> uv;  // [m] [Size triangle] corners in the chart's plane
  float areaUv = 0.0f, areaSurface = 0.0f;   // [m²]
};

// Charts of one mesh: CGAL segmentation, planar or least-squares conformal maps. Every triangle is in one chart, except
// degenerate ones, which are in none. `scale` carries the instance's typical size [m per object unit].
std::vector<Chart> unwrapMesh(const Mesh& mesh, float scale, Context& context);

// Caches whose light map has no corners yet: they are beside it, packed.
struct PlacedCaches : Caches {
  MapCorners corners;
};
// What a bake has of them.
Caches unpack(PlacedCaches placed);

// Grid, then light map; unique and valid caches only. failed: neither a grid nor a light map has a valid cache.
Result<PlacedCaches> placeCaches(const RayTracer& tracer, const PlaySpace& playSpace, const CacheOptions& options,
                                 std::uint64_t seed, Context& context);

// Where each surfel, or what a camera sees there, reads its irradiance (Surfels::receiver): a point of the light map,
// or the grid.
std::vector<std::uint32_t> findReceivers(const RayTracer& tracer, const PlacedCaches& caches,
                                         std::span<const SurfelSeed> seeds, Context& context);

}  // namespace relume
