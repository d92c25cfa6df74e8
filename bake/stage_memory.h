// SPDX-License-Identifier: MIT
// What each stage of a bake is about to hold, estimated from counts before it begins: fails by name where that is
// beyond the budget (memory_budget.h). The light map and the grid ask for themselves, once they know their texels.
#pragma once

#include "bake/caches/caches.h"
#include "bake/rays/ray_tracer.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/bake_data.h"
#include "relume/caches.h"
#include "relume/hierarchy.h"
#include "relume/result.h"
#include "relume/surfels.h"

namespace relume {

Status reserveRays(const Scene& scene, RayStructure structure, Context& context,
                   RayGeometry geometry = RayGeometry::fixed);
Status reservePlaySpace(const Scene& scene, const PlaySpaceOptions& options, Context& context);
Status reserveSurfels(const Scene& scene, const PlaySpace& space, const SurfelOptions& options, Context& context);
Status reserveHierarchy(const Surfels& surfels, const BakeOptions& options, Context& context);
// share [0..1]: of the caches, that are traced here.
Status reserveLinks(const Hierarchy& hierarchy, const Caches& caches, const LinkOptions& options, Context& context,
                    double share = 1.0);

// Where triangles read the light map, written out.
Status reserveCorners(const PlacedCaches& caches, Context& context);

// The lights of the test rays; what reads the bake for its certificate.
Status reserveTestRays(const Surfels& surfels, Context& context);
Status reserveCertificate(const Bake& bake, Context& context);

}  // namespace relume
