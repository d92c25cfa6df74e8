// SPDX-License-Identifier: MIT
// A bake read to draw its scene with.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/result.h"

#include <string>

namespace relume {

// Whether the bake has a light map without coordinates, as `relume pack --profile web` leaves it: without a level that
// has them, nobody knows which surface reads which texel.
bool lacksCoordinates(const Bake& bake);

// usage: it does.
Status checkCoordinates(const Bake& bake, const std::string& bakeFile);

// Errors of readBake(), checkCoordinates() and checkSameScene() (staleness.h); with allowStale, a bake of another state
// of the scene is made readable by fitToScene(), and a warning says so.
Result<Bake> readBakeOf(const Scene& scene, const std::string& bakeFile, const std::string& sceneFile, bool allowStale,
                        Context& context);

}  // namespace relume
