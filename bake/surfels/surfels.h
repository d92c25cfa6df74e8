// SPDX-License-Identifier: MIT
// From surfaces to surfels (PIC 4.2), and from a hit on a surface to its surfel.
#pragma once

#include "bake/context.h"
#include "bake/options.h"
#include "bake/scene/play_space.h"
#include "bake/scene/ray_tracer.h"
#include "formats/result.h"
#include "formats/surfels.h"

#include <cstdint>
#include <vector>

namespace relume {

// A surfel as it is placed, before its footprint is integrated.
struct SurfelSeed {
  glm::vec3 positionWorld{0.0f};
  glm::vec3 normal{0.0f};       // geometric, of the side it stands for
  SurfacePoint point;
  std::uint32_t side = 0;       // scene-wide 2 * triangle + back
};

// Answers which surfel stands for a point on a side of a triangle: per side a small uv grid of nearest surfels, where
// nearest means on the same plane or mesh first, then by distance. Immutable, thread-safe.
class SurfelMap {
 public:
  // The surfel of a hit, or kNone when the side has none near (never seen from the play space).
  std::uint32_t at(std::uint32_t side, const glm::vec2& barycentric) const;
  std::size_t sizeBytes() const;

  std::vector<std::uint32_t> cellBegin;  // [Size 2 * triangles + 1]
  std::vector<std::uint8_t> cellsAlong;  // [Size 2 * triangles] grid cells along an edge; 0 = no surfel
  std::vector<std::uint32_t> cell;       // surfel per cell
};

struct PlacedSurfels {
  Surfels surfels;              // receiver is kGridReceiver everywhere until caches are placed
  SurfelMap map;
  std::vector<SurfelSeed> seeds;  // [Size n_S]
  struct Statistics {
    double areaSeen = 0, areaTotal = 0;      // [m²]
    float spacingMin = 0, spacingMean = 0;   // [m] nearest-neighbour distance
    float spacingCv = 0;                     // coefficient of variation of that distance
    float spacingDensest = 0;                // [m] D: spacing of the densest packing of the same count on that area
    float areaError = 0;                     // |n_S areaEach - areaSeen| / areaSeen
  } statistics;
};

// n_S surfels of equal area over what the play space sees; each side of a two-sided surface that is seen has its own.
// failed: nothing to place on. The surfels' order is progressive for `eliminated`: any prefix is well spread.
Result<PlacedSurfels> placeSurfels(const RayTracer& tracer, const PlaySpace& playSpace, const SurfelOptions& options,
                                   std::uint64_t seed, Context& context);

}  // namespace relume
