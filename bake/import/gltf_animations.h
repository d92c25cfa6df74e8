// SPDX-License-Identifier: MIT
// What of a glTF its animations move, as far as a bake has to tell that it does not follow them.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <set>

namespace relume {

struct Animated {
  std::set<int> weightsOfNodes, weightsOfMeshes;  // morph weights
  std::set<int> visibilityOfNodes;                // KHR_node_visibility
  std::set<int> placesOfNodes;                    // translation, rotation or scale
};

// What is no animation is passed over.
Animated findAnimated(const nlohmann::json& root);

}  // namespace relume
