// SPDX-License-Identifier: MIT
// What a preview's rays find in a level whose bake has been relit: all bounces, emitters and sky.
#pragma once

#include "bake/base/point_grid.h"
#include "bake/preview/hit_radiance.h"
#include "bake/rays/ray_tracer.h"
#include "relume/bake_data.h"
#include "relume/relighter.h"

#include <glm/vec3.hpp>

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// Reflected radiance albedo / pi (E_direct + E_links) of hits: direct light by a shadow ray for each punctual light,
// all other light from the relit light map or grid. `drawn` casts the shadows. All are kept by reference.
HitRadiance linkRadiance(const RayTracer& drawn, std::span<const SceneLight> lights, const Bake& bake,
                         const Relighter& relighter);

// Which surfel of a bake stands for a point: the one of least mapCost(), as the baker's map has it, but found by
// position, since a bake does not keep that map. Immutable, thread-safe. The bake must outlive it.
class SurfelFinder {
 public:
  SurfelFinder(const Bake& bake, Context& context);
  // kNone where none is near.
  std::uint32_t find(const glm::vec3& positionWorld, const glm::vec3& normal, std::uint32_t instance) const;

 private:
  const Surfels& surfels_;
  float spacing_;  // [m]
  PointGrid grid_;
};

// Radiosity / pi of the surfels that hits lie on: the fastest, and as coarse as the surfels. Hits on surfels that emit,
// and where there is no surfel, have `other`.
HitRadiance surfelRadiance(const Scene& scene, const Bake& bake, const Relighter& relighter, const SurfelFinder& finder,
                           HitRadiance other);

}  // namespace relume
