// SPDX-License-Identifier: MIT
// What surfaces send out, kept by cells of them. A record's ray stands for a patch as wide as its cell of the
// hemisphere is where it ends: the mean light of a patch of the surface that is about as wide will do, and rays of many
// records end on one. Where a cell is wider than that, rays have the light of the very point.
//
// Each side of a triangle has grids of cells over two of its edges, from millimetres to the whole side, each half as
// fine as the one before. A cell's light is found when a ray first asks for it, and is a function of the cell alone:
// the same for any order of rays.
#pragma once

#include "bake/preview/hit_radiance.h"
#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"

#include <cstdint>
#include <functional>
#include <span>

namespace relume {

inline constexpr unsigned kPatchPoints = 4;

// Write the mean radiance [W/m²/sr] that patches reflect, 0 at first. Each patch is kPatchPoints points of one side of
// a triangle, spread over it, as rays from above that end on them; the distance of their hits is the patch's width [m].
// Called from many threads at once. [Size rays = hits = kPatchPoints radiance]
using PatchRadiance =
    std::function<void(std::span<const Ray> rays, std::span<const Hit> hits, std::span<glm::vec3> radiance)>;

// By cells what `patch` says of them, and `exact` where rays are too narrow or the level has too many triangles. Where
// something stands closer to a cell than the cell is wide, or on a part of it, finer cells are read, and `exact` where
// there are none: what is hidden is not what rays see. tracer: of the geometry that rays end on; kept by reference.
HitRadiance cellRadiance(const RayTracer& tracer, HitRadiance exact, PatchRadiance patch, std::uint64_t seed,
                         Context& context);

}  // namespace relume
