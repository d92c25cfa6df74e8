// SPDX-License-Identifier: MIT
// What a preview's rays find in a level whose bake has been relit: all bounces, emitters and sky.
#pragma once

#include "bake/preview/hit_radiance.h"
#include "bake/preview/leaf_records.h"
#include "bake/preview/surface_cells.h"
#include "bake/rays/ray_tracer.h"
#include "bake/reference/emitters.h"
#include "bake/surfels/surfels_on_demand.h"
#include "relume/bake_data.h"
#include "relume/relighter.h"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace relume {

// Light of emitters by points drawn on them, in place of what links have of it. All are kept by reference.
struct DrawnEmitters {
  const RayTracer& transport;         // that shadows them
  const EmittingTriangles& emitters;  // not empty
  const Relighter& overLinks;         // relit by them alone, nothing reflected
  std::uint64_t seed = 1;
};

// Reflected radiance albedo / pi (E_direct + E_links) of hits: direct light by a shadow ray for each punctual light,
// all other light from the relit light map or grid, but for that of emitters where they are drawn. `drawn` casts the
// shadows. emitters: may be null. All are kept by reference.
HitRadiance linkRadiance(const RayTracer& drawn, std::span<const SceneLight> lights, const Bake& bake,
                         const Relighter& relighter, const DrawnEmitters* emitters);

// The same of patches: direct light at each of their points, all else at one of them.
PatchRadiance linkPatchRadiance(const RayTracer& drawn, std::span<const SceneLight> lights, const Bake& bake,
                                const Relighter& relighter, const DrawnEmitters* emitters);

// Which surfel of a bake stands for a hit: what the baker's map, which a bake does not keep, says if all sides of all
// surfaces are seen. It refers to the scene alone.
std::unique_ptr<const SurfelsOnDemand> mapSurfels(const Scene& scene, const Bake& bake, Context& context);

// Radiosity / pi of the surfels that hits lie on: the fastest, and as coarse as the surfels. Hits on surfels that emit,
// and where there is no surfel, have `other`.
HitRadiance surfelRadiance(const Bake& bake, const Relighter& relighter, const SurfelsOnDemand& map, HitRadiance other);

// The surfels of a bake as the leaves that hits lie on; kNone where there is no surfel. All are kept by reference.
HitLeaf surfelLeaves(const SurfelsOnDemand& map);
// Radiance [W/m²/sr] that they send out, emission included, by the light that the relighter has. [Size surfels]
std::vector<glm::vec3> surfelRadiances(const Bake& bake, const Relighter& relighter);

}  // namespace relume
