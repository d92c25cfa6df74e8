// SPDX-License-Identifier: MIT
// Tells whether receivers see a place on a surface, or in the air. The play space knows that by voxels, which cannot
// tell the back of a plate's top from the front of its bottom, nor the two sides of a post: within one voxel both look
// the same way. And a play volume holds its furniture: walks that start in a sofa without a bottom see the floor first,
// and stay inside.
#pragma once

#include "bake/caches/charts/patches.h"
#include "bake/caches/grid/relocate.h"
#include "relume/bake/context.h"

#include <glm/vec3.hpp>

#include <vector>

namespace relume {

class ReceiverSight {
 public:
  // The prober must outlive this.
  ReceiverSight(const PlaySpace& playSpace, const Prober& prober, Context& context);

  // Whether a receiver in free space looks at a spot, which is lifted off its surface, from the side of its normal;
  // from any side for normal 0. True without any receivers, as nothing is known then. Thread-safe.
  bool sees(const SurfaceSpot& spot) const;

 private:
  // Keep the receivers who stand in free space.
  void keepFree(Context& context);

  const Prober& prober_;
  std::vector<glm::vec3> receivers_;  // [m]
};

}  // namespace relume
