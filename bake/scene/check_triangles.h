// SPDX-License-Identifier: MIT
// Whether there is anything to bake or to draw: a level without triangles is a mistake of whoever exported it, and
// every command says so in the same words.
#pragma once

#include "relume/bake/scene.h"
#include "relume/result.h"

namespace relume {

// failed: no instance that is baked has a triangle.
Status checkBakedTriangles(const Scene& scene);
// failed: no instance at all has one, dynamic ones with them.
Status checkDrawnTriangles(const Scene& scene);

}  // namespace relume
