// SPDX-License-Identifier: MIT
// Tells two-sided surfaces that enclose matter from two-sided sheets. Many exporters mark every material as two-sided;
// the inside of a closed piece is nevertheless seen by nobody, and what looks into it is inside of something.
//
// A shell is a set of triangles joined over edges, corners welded by exact position over all primitives of a node. It
// is closed if each edge is walked as often one way as the other (its boundary as a chain is zero). It is solid if
// moreover it encloses a positive volume (its fronts face outward), no alpha mask cuts holes into it, and it is no
// room: no camera of the play space and no half of a play volume lies in it; in a level that has neither, no light and
// no other node.
#pragma once

#include "relume/bake/scene.h"

namespace relume {

// Sets scene.solid. importGltf() ends with it; scenes made or changed by hand call it themselves.
void findSolids(Scene& scene, Context& context);

}  // namespace relume
