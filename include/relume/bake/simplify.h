// SPDX-License-Identifier: MIT
// A bake made smaller for hosts that download it: numbers rounded to what light needs, and left out what only tools
// read. Lossy; docs/notes/packing.md has what it costs. Meant to be written by writePackedBake() (bake_file.h).
#pragma once

#include "relume/bake_data.h"

namespace relume {

struct SimplifyOptions {
  bool keepCoordinates = false;  // Lightmap::cornerUv and backCornerUv, for hosts that do not have them in the level
                                 // (`relume export` puts them there)
};

// What changes:
//   positions                   to multiples of a power of two [m], at most 1/64 of a surfel's radius, never behind
//                               the surface they lie on
//   normals, sky directions     to 1/1024
//   albedo, emission            to 7 significant bits
//   weights of the hierarchy    to 1/512, but for those by area
//   transfer of links           to 7 significant bits; what one loses the next of its row gains; links of kinds sh and
//                               cone are kept
//   directions of grid links    of kind irradiance: 7 of 12 bits each, 5 of 8 of the cone
//   mesh shapes                 left out: a level's noise is told from its changes no more (`relume status`)
//   light-map coordinates       left out, unless they are kept: parts have no triangles, tools that draw refuse it
// A bake that checkStructure() takes stays one, and a valid one stays valid. Simplifying again changes nothing but what
// is kept. Any thread; throws std::bad_alloc.
Bake simplifyForWeb(const Bake& bake, const SimplifyOptions& options = {});

}  // namespace relume
