// SPDX-License-Identifier: MIT
// Charts from the light-map coordinates a level brings along.
#pragma once

#include "bake/caches/caches.h"

#include <vector>

namespace relume {

// The islands of TEXCOORD_1, each scaled to metres; empty when the mesh has none, or they cannot serve: outside [0,1]²,
// overlapping, or without area on a part of the surface. Islands are packed anew: the level's own layout knows nothing
// of the texel size chosen here.
std::vector<Chart> chartsFromTexcoord1(const Mesh& mesh, float scale);

}  // namespace relume
