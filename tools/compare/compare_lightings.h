// SPDX-License-Identifier: MIT
// The fixed set of lightings that two bakes are compared under.
#pragma once

#include "relume/bake_data.h"
#include "relume/lights.h"

#include <string>
#include <vector>

namespace relume {

struct Lighting {
  std::string name, group;
  std::vector<Light> lights;                      // one punctual light, or none
  bool sky = false;                               // a constant sky of 1 W/m²/sr
  std::vector<std::string> emittersA, emittersB;  // nodes of either bake whose emission is on
  std::string was;                                // A's name of the emitting node that B names otherwise; else empty
};

// A sky when one of the bakes has sky patches, 8 suns of 1 W/m², 8 points of light spread over A's caches, away from
// surfaces where it can be, each of the 8 strongest emitting nodes alone and the others together. A function of the
// bakes alone, in this order. An emitting node of A is held against the one of B with its name; of those left over,
// nodes that emit as much from as large a surface at the same place are one node that was renamed.
std::vector<Lighting> makeLightings(const Bake& a, const Bake& b);

// Emission of a bake's surfels with only those nodes switched on. [Size n_S]
std::vector<glm::vec3> emissionOf(const Bake& bake, const std::vector<std::string>& nodes);

}  // namespace relume
