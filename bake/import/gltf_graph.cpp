// SPDX-License-Identifier: MIT
// See gltf_graph.h.
#include "bake/import/gltf_graph.h"

#include <algorithm>
#include <cstdint>

namespace relume {

std::string nodeName(const GltfDocument& document, int node) {
  const std::string& name = document.model.nodes[static_cast<std::size_t>(node)].name;
  return name.empty() ? "node" + std::to_string(node) : name;
}

std::string nodePath(const GltfDocument& document, int node) {
  return jsonPath("nodes", node) + " '" + nodeName(document, node) + "'";
}

bool hidesNode(const tinygltf::Node& node) {
  const auto extension = node.extensions.find("KHR_node_visibility");
  return extension != node.extensions.end() && extension->second.Has("visible") &&
         !extension->second.Get("visible").Get<bool>();
}

Status checkForest(const GltfDocument& document) {
  const auto& nodes = document.model.nodes;
  std::vector<int> parent(nodes.size(), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    for (const int child : nodes[i].children) {
      if (child < 0 || static_cast<std::size_t>(child) >= nodes.size())
        return document.invalid(
            nodePath(document, static_cast<int>(i)),
            "child " + jsonPath("nodes", child) + " does not exist, there are " + std::to_string(nodes.size()));
      int& up = parent[static_cast<std::size_t>(child)];
      if (up >= 0)
        return document.invalid(nodePath(document, child), "has two parents, " + nodePath(document, up) + " and " +
                                                               nodePath(document, static_cast<int>(i)));
      up = static_cast<int>(i);
    }
  }
  std::vector<std::uint8_t> seen(nodes.size(), 0);  // 1 = on the path now, 2 = known to end at a root
  for (std::size_t start = 0; start < nodes.size(); ++start) {
    int at = static_cast<int>(start);
    for (; at >= 0 && seen[static_cast<std::size_t>(at)] == 0; at = parent[static_cast<std::size_t>(at)])
      seen[static_cast<std::size_t>(at)] = 1;
    if (at >= 0 && seen[static_cast<std::size_t>(at)] == 1)
      return document.invalid(nodePath(document, at), "is its own ancestor: the nodes form a cycle");
    for (at = static_cast<int>(start); at >= 0 && seen[static_cast<std::size_t>(at)] == 1;
         at = parent[static_cast<std::size_t>(at)])
      seen[static_cast<std::size_t>(at)] = 2;
  }
  return done();
}

Result<std::vector<int>> findRoots(const GltfDocument& document) {
  const auto& model = document.model;
  if (model.defaultScene >= 0 && static_cast<std::size_t>(model.defaultScene) >= model.scenes.size())
    return document.invalid("scene", jsonPath("scenes", model.defaultScene) + " does not exist, there are " +
                                         std::to_string(model.scenes.size()));
  if (model.scenes.empty()) {
    std::vector<std::uint8_t> isChild(model.nodes.size(), 0);
    for (const tinygltf::Node& node : model.nodes) {
      for (const int child : node.children) isChild[static_cast<std::size_t>(child)] = 1;
    }
    std::vector<int> out;
    for (std::size_t i = 0; i < isChild.size(); ++i) {
      if (!isChild[i]) out.push_back(static_cast<int>(i));
    }
    return out;
  }
  const int index = std::max(model.defaultScene, 0);
  std::vector<int> out = model.scenes[static_cast<std::size_t>(index)].nodes;
  std::vector<std::uint8_t> listed(model.nodes.size(), 0);
  for (const int node : out) {
    if (node < 0 || static_cast<std::size_t>(node) >= model.nodes.size())
      return document.invalid(jsonPath("scenes", index), jsonPath("nodes", node) + " does not exist, there are " +
                                                             std::to_string(model.nodes.size()));
    if (listed[static_cast<std::size_t>(node)]++)
      return document.invalid(jsonPath("scenes", index), nodePath(document, node) + " is listed twice");
  }
  return out;
}

}  // namespace relume
