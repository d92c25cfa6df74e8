// SPDX-License-Identifier: MIT
// Does a bake keep the invariants that the headers of its parts promise? Numbered findings, validation_messages.h.
#pragma once

#include "formats/validation_messages.h"
#include "relume/bake_data.h"
#include "relume/result.h"

#include <cstdint>
#include <memory_resource>
#include <string>
#include <vector>

namespace relume {

// One finding per check: the first position at which it holds, and how many more there are.
struct Finding {
  Check check;
  FindingSeverity severity;
  std::string what;      // the sentence of validation_messages.h
  std::string where;     // "node.child[17]"
  std::string expected;  // "a node of level 3, 12..19"
  std::string found;     // "40"
  std::uint64_t count = 1;
};

// "E106 children do not lie in the level below their parent: node.child[17]: expected 12..19, found 40 (3 times)"
std::string toString(const Finding& finding);

// Everything, ordered by number. When a 1xx check fails the others are skipped: they would index by broken data.
// Time is linear in the bake, about 0.3 s for 2.7 million links.
std::vector<Finding> validateBake(const Bake& bake);

// The 1xx checks alone, which make a bake safe to index; invalidFile: the first finding. What every reader does; the
// runtime may rely on it. About 10 ms for 2.7 million links. Takes a bit per node of `memory` [not null]; throws
// std::bad_alloc.
Status checkStructure(const Bake& bake, std::pmr::memory_resource* memory = std::pmr::new_delete_resource());

// checkStructure(), then the numbers that light is computed with: area, normals, albedo, emission, directions of the
// sky, weights of the hierarchy, links. No frame lit with a bake that passes reads outside an array or computes with a
// NaN. invalidFile: the first finding. memory: as for checkStructure().
Status checkBake(const Bake& bake, std::pmr::memory_resource* memory = std::pmr::new_delete_resource());

// Whether a bake's options ask for weights of the hierarchy by area, which are then checked to be those.
inline bool pullsByArea(const Provenance& provenance) {
  return provenance.optionsJson.find("\"pull\":\"area\"") != std::string::npos;
}

}  // namespace relume
