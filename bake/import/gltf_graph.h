// SPDX-License-Identifier: MIT
// The graph of a glTF's nodes before it is walked: the forest that it must be, and where the walk begins.
#pragma once

#include "bake/import/gltf_document.h"
#include "relume/bake/scene.h"
#include "relume/result.h"

#include <string>
#include <vector>

namespace relume {

// A node's name, "node3" where it has none, and its path with that for messages: "nodes[3] 'hall'".
std::string nodeName(const GltfDocument& document, int node);
std::string nodePath(const GltfDocument& document, int node);

// Whether KHR_node_visibility hides the node, and with it all below.
bool hidesNode(const tinygltf::Node& node);

// Names and parents. invalidFile: a node that does not exist, has two parents, or is its own ancestor.
Result<std::vector<SceneNode>> readForest(const GltfDocument& document);

// The default scene's nodes, the first scene's, or every node without a parent. invalidFile: a scene or node that does
// not exist, or a node that is listed twice.
Result<std::vector<int>> findRoots(const GltfDocument& document);

// Says which of several scenes those are of, after findRoots() has found them.
void tellScene(const GltfDocument& document, Context& context);

}  // namespace relume
