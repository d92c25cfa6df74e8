// SPDX-License-Identifier: MIT
// See gltf_graph.h.
#include "bake/import/gltf_graph.h"

#include "relume/bake/context.h"

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

Result<std::vector<SceneNode>> readForest(const GltfDocument& document) {
  const auto& nodes = document.model.nodes;
  std::vector<SceneNode> forest(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    forest[i].name = nodes[i].name;
    for (const int child : nodes[i].children) {
      if (child < 0 || static_cast<std::size_t>(child) >= nodes.size())
        return document.invalid(
            nodePath(document, static_cast<int>(i)),
            "child " + jsonPath("nodes", child) + " does not exist, there are " + std::to_string(nodes.size()));
      std::uint32_t& parent = forest[static_cast<std::size_t>(child)].parent;
      if (parent != kNone)
        return document.invalid(nodePath(document, child), "has two parents, " +
                                                               nodePath(document, static_cast<int>(parent)) + " and " +
                                                               nodePath(document, static_cast<int>(i)));
      parent = static_cast<std::uint32_t>(i);
    }
  }
  enum : std::uint8_t { unknown, onPath, endsAtRoot };
  std::vector<std::uint8_t> seen(nodes.size(), unknown);
  for (std::uint32_t start = 0; start < nodes.size(); ++start) {
    std::uint32_t at = start;
    for (; at != kNone && seen[at] == unknown; at = forest[at].parent) seen[at] = onPath;
    if (at != kNone && seen[at] == onPath)
      return document.invalid(nodePath(document, static_cast<int>(at)), "is its own ancestor: the nodes form a cycle");
    for (at = start; at != kNone && seen[at] == onPath; at = forest[at].parent) seen[at] = endsAtRoot;
  }
  return forest;
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

void tellScene(const GltfDocument& document, Context& context) {
  const auto& scenes = document.model.scenes;
  if (scenes.size() < 2) return;
  const int read = std::max(document.model.defaultScene, 0);
  const std::string& name = scenes[static_cast<std::size_t>(read)].name;
  context.message(Severity::info,
                  document.at(jsonPath("scenes", read) + (name.empty() ? "" : " '" + name + "'") +
                              " is read, and the others are left out: " + std::to_string(scenes.size() - 1) +
                              "; the file's \"scene\" says which it is"));
}

}  // namespace relume
