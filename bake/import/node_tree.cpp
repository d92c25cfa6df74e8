// SPDX-License-Identifier: MIT
// See node_tree.h. Nodes are walked as importNodes() does, and what is on them is met in the order that it gives to a
// Scene.
#include "bake/import/node_tree.h"

#include "bake/import/gltf_document.h"
#include "bake/import/gltf_graph.h"
#include "relume/bake/scene.h"

namespace relume {
namespace {

struct TreeVisit {
  std::uint32_t node = 0;
  bool hidden = false;  // by KHR_node_visibility, of a node above
};

bool hasVolume(const tinygltf::Node& node) {
  return node.extras.IsObject() && node.extras.Has("relume") && node.extras.Get("relume").Has("volume");
}

}  // namespace

Result<NodeTree> readNodeTree(const std::filesystem::path& path, Context& context) {
  const Result<GltfDocument> document = loadGltfDocument(path, context);
  if (!document) return document.error();
  if (Status status = checkForest(*document); !status) return status.error();
  const Result<std::vector<int>> starts = findRoots(*document);
  if (!starts) return starts.error();

  const std::vector<tinygltf::Node>& nodes = document->model.nodes;
  NodeTree tree;
  tree.parent.assign(nodes.size(), kNone);
  for (const tinygltf::Node& node : nodes) tree.name.push_back(node.name);
  std::vector<TreeVisit> stack;
  for (auto start = starts->rbegin(); start != starts->rend(); ++start)
    stack.push_back({static_cast<std::uint32_t>(*start)});
  while (!stack.empty()) {
    const TreeVisit at = stack.back();
    stack.pop_back();
    const tinygltf::Node& node = nodes[at.node];
    const bool hidden = at.hidden || hidesNode(node);
    tree.order.push_back(at.node);
    if (hasVolume(node)) tree.volumes.push_back(at.node);
    if (node.camera >= 0) tree.cameras.push_back(at.node);
    if (!hidden && node.extensions.contains("KHR_lights_punctual")) tree.lights.push_back(at.node);
    for (auto child = node.children.rbegin(); child != node.children.rend(); ++child) {
      tree.parent[static_cast<std::size_t>(*child)] = at.node;
      stack.push_back({static_cast<std::uint32_t>(*child), hidden});
    }
  }
  return tree;
}

}  // namespace relume
