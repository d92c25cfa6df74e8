// SPDX-License-Identifier: MIT
// See move_nodes.h.
#include "tools/render/move_nodes.h"

#include "bake/import/node_tree.h"
#include "bake/scene/check_limits.h"
#include "formats/limits.h"
#include "tools/base/parse_numbers.h"

#include <CLI/CLI.hpp>

#include <glm/vec4.hpp>

#include <algorithm>
#include <cstdint>
#include <set>

namespace relume {
namespace {

Error moveNodeError(std::string message) { return {ErrorCode::usage, "--move-node: " + std::move(message)}; }

// The nodes of the scene's file; none where it has no file.
Result<NodeTree> treeOf(const Scene& scene, Context& context) {
  if (scene.files.empty()) {
    NodeTree none;
    none.lights.resize(scene.lights.size(), kNone);
    none.cameras.resize(scene.cameras.size(), kNone);
    none.volumes.resize(scene.volumes.size(), kNone);
    return none;
  }
  auto tree = readNodeTree(scene.files.front(), context);
  if (!tree) return tree;
  const bool isOfScene = tree->lights.size() == scene.lights.size() && tree->cameras.size() == scene.cameras.size() &&
                         tree->volumes.size() == scene.volumes.size() &&
                         std::all_of(scene.instances.begin(), scene.instances.end(),
                                     [&](const Instance& instance) { return instance.nodeIndex < tree->name.size(); });
  if (!isOfScene)
    return Error{ErrorCode::io, scene.name + ": was changed while it was read; run again once it is whole"};
  return tree;
}

// A few of the names that something would move by.
std::string namesOf(const Scene& scene, const NodeTree& tree) {
  constexpr std::size_t kMost = 12;
  std::vector<std::uint8_t> holds(tree.name.size(), 0);
  const auto mark = [&](std::uint32_t node) {
    for (; node < holds.size() && holds[node] == 0; node = tree.parent[node]) holds[node] = 1;
  };
  for (const auto* nodes : {&tree.lights, &tree.cameras, &tree.volumes}) {
    for (const std::uint32_t node : *nodes) mark(node);
  }
  std::set<std::string> names;
  for (const Instance& instance : scene.instances) {
    mark(instance.nodeIndex);
    names.insert(instance.node);
  }
  for (std::size_t i = 0; i < holds.size(); ++i) {
    if (holds[i] != 0 && !tree.name[i].empty()) names.insert(tree.name[i]);
  }
  std::string text;
  std::size_t told = 0;
  for (const std::string& name : names) {
    if (told++ == kMost) return text + " and " + std::to_string(names.size() - kMost) + " more";
    text += (text.empty() ? "\"" : ", \"") + name + "\"";
  }
  return text.empty() ? "none" : text;
}

// Of each node whether it has the name, or one above it does.
std::vector<std::uint8_t> nodesWith(const std::string& name, const Scene& scene, const NodeTree& tree) {
  std::vector<std::uint8_t> has(tree.name.size(), 0);
  for (std::size_t i = 0; i < has.size(); ++i) has[i] = tree.name[i] == name ? 1 : 0;
  for (const Instance& instance : scene.instances) {  // "unnamed node 3" is a Scene's name for it
    if (instance.nodeIndex < has.size() && instance.node == name) has[instance.nodeIndex] = 1;
  }
  for (const std::uint32_t node : tree.order) {
    if (tree.parent[node] != kNone && has[tree.parent[node]] != 0) has[node] = 1;
  }
  return has;
}

Status moveNode(const std::string& name, const glm::vec3& offset, MovedParts parts, const NodeTree& tree,
                Scene& scene) {
  const std::vector<std::uint8_t> has = nodesWith(name, scene, tree);
  const auto moves = [&](std::uint32_t node) { return node < has.size() && has[node] != 0; };
  bool isKnown = false;
  const auto move = [&](glm::mat4& toWorld) {
    isKnown = true;
    toWorld[3] += glm::vec4(offset, 0.0f);
  };
  for (Instance& instance : scene.instances) {
    if (instance.node != name && !moves(instance.nodeIndex)) continue;
    if (parts == MovedParts::dynamic && instance.baked())
      return moveNodeError("\"" + instance.node + "\"" + (instance.node == name ? "" : ", below \"" + name + "\",") +
                           " is part of the bake; give --edited-from, leave out --bake, or make it dynamic and bake "
                           "again");
    move(instance.toWorld);
  }
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    if (!moves(tree.lights[i])) continue;
    isKnown = true;
    scene.lights[i].positionWorld += offset;
  }
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    if (moves(tree.cameras[i])) move(scene.cameras[i].toWorld);
  }
  for (std::size_t i = 0; i < scene.volumes.size(); ++i) {
    if (moves(tree.volumes[i])) move(scene.volumes[i].toWorld);
  }
  if (isKnown) return done();
  return moveNodeError(
      "no node \"" + name +
      "\" with something that is drawn, a light, a camera or a play volume; there are: " + namesOf(scene, tree));
}

}  // namespace

void addMoveOption(CLI::App& command, std::vector<std::string>& moves) {
  command
      .add_option(
          "--move-node", moves,
          "move a node by X,Y,Z metres, with all that is below it in the level, lights and cameras too; several "
          "times for several nodes. With a bake only dynamic nodes move, unless --edited-from is given")
      ->type_name("NODE=X,Y,Z")
      ->allow_extra_args(false);
}

Status moveNodes(const std::vector<std::string>& moves, MovedParts parts, Scene& scene, Context& context) {
  if (moves.empty()) return done();
  const Result<NodeTree> tree = treeOf(scene, context);
  if (!tree) return tree.error();
  for (const std::string& move : moves) {
    const std::size_t equals = move.rfind('=');
    const auto offset = equals == std::string::npos ? std::nullopt : threeNumbers(move.substr(equals + 1));
    if (!offset || equals == 0 || !isWithin(*offset, kMaxLevelCoordinate))
      return moveNodeError("NODE=X,Y,Z, in metres within 1e8, expected, \"" + move + "\" found");
    if (Status ok = moveNode(move.substr(0, equals), *offset, parts, *tree, scene); !ok) return ok;
  }
  if (const Status within = checkLimits(scene); !within) return moveNodeError(within.error().message);
  return done();
}

}  // namespace relume
