// SPDX-License-Identifier: MIT
// The one rule for how large the numbers of a level may be (formats/limits.h): beyond it, single precision overflows,
// and so does Embree.
#pragma once

#include "relume/bake/scene.h"
#include "relume/result.h"

namespace relume {

// Every position, size, transform, lens, light and material. invalidFile: the first that is not finite or beyond its
// bound, with the node, camera, volume, light or material, what was found and what is allowed.
Status checkLimits(const Scene& scene);

}  // namespace relume
