// SPDX-License-Identifier: MIT
// Chooses the nodes a cache is linked to (PIC 4.5): starting from the groups' roots, the node with the largest key is
// replaced by its visible children until there are n_L.
#pragma once

#include "bake/hierarchy/hierarchy.h"
#include "bake/links/touched_tree.h"
#include "bake/options.h"

#include <cstdint>
#include <span>
#include <vector>

namespace relume {

// How far, at the least, a node's radiosity is likely to be from its visible leaves': its extent. [Size nodes] [m]
// transferRadius: RMS radius; the angular radius of a sky node times the radius of the whole level; emitters count
// kEmitterWeight times, for their light is that much stronger. transfer: 1 everywhere.
std::vector<float> nodeExtents(const Hierarchy& hierarchy, const NodeGeometry& geometry, LinkOptions::CutKey key,
                               std::span<const glm::vec3> emission);
inline constexpr float kEmitterWeight = 8.0f;

struct CutCandidate {
  float key;
  std::uint32_t slot;
};

// The cut as slots of the touched tree, their nodes ascending. It has at most maxNodes nodes (but never fewer than
// the touched groups), and every touched leaf lies under exactly one of them. Children no ray reached are in no cut; a
// node with a single touched child is replaced by it, for that costs no link. `queue` is scratch.
void selectCut(const TouchedTree& tree, const Hierarchy& hierarchy, std::span<const float> extent,
               LinkOptions::CutKey key, std::uint32_t maxNodes, std::vector<CutCandidate>& queue,
               std::vector<std::uint32_t>& cut);

}  // namespace relume
