// SPDX-License-Identifier: MIT
// Step 3 on the CPU: radiosity averaged up the hierarchy (PIC 4.1, 4.3).
#pragma once

#include "formats/hierarchy.h"
#include "runtime/relighter.h"

#include <glm/vec4.hpp>

#include <span>

namespace relume::cpu {

// Fills the inner nodes from the leaves, deepest level first. Any linear colour space; w is carried along.
// [Size node >= hierarchy.nodeCount()]
void pull(const Hierarchy& hierarchy, std::span<glm::vec4> node, const ParallelFor& parallelFor);

}  // namespace relume::cpu
