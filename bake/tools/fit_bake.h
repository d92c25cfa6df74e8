// SPDX-License-Identifier: MIT
// Whether a bake is of a scene, part by part, and what to read of it where it is not.
#pragma once

#include "bake/context.h"
#include "bake/scene/scene.h"
#include "formats/bake.h"
#include "formats/result.h"

#include <cstdint>
#include <string>

namespace relume {

// A bake fits a scene when its parts have the same names in the same order and the same content. invalidFile: says the
// first part that differs; `bakeFile` and `sceneFile` are for the message.
Status checkSameScene(const Scene& scene, const Bake& bake, const std::string& bakeFile, const std::string& sceneFile);

// Make a bake that does not fit readable: each instance of the scene gets the light-map part of the one that has its
// names (of node, mesh and material) and number of triangles in the bake, equal ones in their order; the rest reads the
// grid. Returns how many found theirs.
std::uint32_t matchParts(const Scene& scene, Bake& bake);

// Read a bake to draw the scene with. Errors of readBake() and checkSameScene(); with allowStale a bake that does not
// fit is matched, and a warning says so.
Result<Bake> readBakeOf(const Scene& scene, const std::string& bakeFile, const std::string& sceneFile, bool allowStale,
                        Context& context);

}  // namespace relume
