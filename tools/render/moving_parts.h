// SPDX-License-Identifier: MIT
// The dynamic instances of a level as parts that move through its bake (relume/moving_shapes.h).
#pragma once

#include "relume/bake/scene.h"
#include "relume/moving_shapes.h"
#include "relume/result.h"

#include <vector>

namespace relume {

// A shape for each dynamic instance, in their order: albedo and emission of each triangle are those at its middle,
// filtered over the triangle. Errors of MovingShapes; usage: more than kMaxMovingParts.
Result<MovingShapes> movingShapes(const Scene& scene);
// The same instances where they stand.
std::vector<MovingPart> movingParts(const Scene& scene);

}  // namespace relume
