// SPDX-License-Identifier: MIT
// Which node of a level's file is below which, for those who move nodes with all that is below them: a Scene knows of
// each thing's place alone.
#pragma once

#include "relume/bake/context.h"
#include "relume/result.h"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace relume {

struct NodeTree {
  std::vector<std::string> name;      // [Size nodes] empty = none
  std::vector<std::uint32_t> parent;  // [Size nodes] kNone = a root
  std::vector<std::uint32_t> order;   // nodes of the scene that is read, each after its parent
  // Nodes of Scene::lights, ::cameras and ::volumes, in the order that those have.
  std::vector<std::uint32_t> lights, cameras, volumes;
};

// Of the file that a Scene was imported from. Errors of importGltf() that come of the document and its graph.
Result<NodeTree> readNodeTree(const std::filesystem::path& path, Context& context);

}  // namespace relume
