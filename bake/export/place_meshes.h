// SPDX-License-Identifier: MIT
// Meshes for the instances on the light map, and nodes that draw them.
#pragma once

#include "bake/export/level_document.h"
#include "bake/export/lightmap_primitives.h"
#include "relume/bake/scene.h"
#include "relume/result.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <string>

namespace relume {

struct PlacedMeshes {
  std::uint32_t meshesAdded = 0;  // copies of meshes that several instances draw
  std::uint32_t nodesAdded = 0;   // one a GPU instance of what is on the light map
};

// Give each node whose instances are on the light map a mesh with the made primitives: the first to need a mesh that no
// other node draws as it was takes its place, the others get copies behind the last. A node of GPU instances becomes
// the parent of a node each, before its other children, in their order: the importer meets all instances in the order
// it did. The extras of each mesh name the sets of its primitives.
// Animations of a copied mesh move the copies too. Errors of the importer.
Result<PlacedMeshes> placeMeshes(LevelDocument& document, const Scene& scene, const LightmapPrimitives& primitives,
                                 TexcoordSets sets);

// Take an extension that nothing has any more from the lists of those that are used and required.
void forgetExtension(nlohmann::json& root, const std::string& name);

}  // namespace relume
