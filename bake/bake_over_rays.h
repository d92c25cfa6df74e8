// SPDX-License-Identifier: MIT
// A bake for a caller who traces the level's rays as well: one ray tracer does for both.
#pragma once

#include "bake/rays/ray_tracer.h"
#include "relume/bake/bake.h"

#include <optional>

namespace relume {

// bake() over `rays`, of RayGeometry::fixed and of any structure; built here where there are none. They are left for
// the caller, but where the bake fails. Of another structure than bake() builds, bytes may differ where triangles
// overlap (ray_tracer.h), and where a ray ends on the border of what two surfels stand for (ray_bundle.h).
Result<Bake> bakeOverRays(const Scene& scene, const BakeOptions& options, std::optional<RayTracer>& rays,
                          Context& context);

}  // namespace relume
