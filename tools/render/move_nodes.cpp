// SPDX-License-Identifier: MIT
// See move_nodes.h.
#include "tools/render/move_nodes.h"

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

// A few of the names that something would move by.
std::string namesOf(const Scene& scene) {
  constexpr std::size_t kMost = 12;
  std::vector<std::uint8_t> holds(scene.nodes.size(), 0);
  const auto mark = [&](std::uint32_t node) {
    for (; node < holds.size() && holds[node] == 0; node = scene.nodes[node].parent) holds[node] = 1;
  };
  for (const SceneLight& light : scene.lights) mark(light.nodeIndex);
  for (const Camera& camera : scene.cameras) mark(camera.nodeIndex);
  for (const PlayVolume& volume : scene.volumes) mark(volume.nodeIndex);
  std::set<std::string> names;
  for (const Instance& instance : scene.instances) {
    mark(instance.nodeIndex);
    names.insert(instance.node);
  }
  for (std::size_t i = 0; i < holds.size(); ++i) {
    if (holds[i] != 0 && !scene.nodes[i].name.empty()) names.insert(scene.nodes[i].name);
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
std::vector<std::uint8_t> nodesWith(const std::string& name, const Scene& scene) {
  enum : std::uint8_t { no, yes, unknown };
  std::vector<std::uint8_t> has(scene.nodes.size(), unknown);
  for (std::size_t i = 0; i < has.size(); ++i) {
    if (scene.nodes[i].name == name) has[i] = yes;
  }
  for (const Instance& instance : scene.instances) {  // "unnamed node 3" is a Scene's name for it
    if (instance.nodeIndex < has.size() && instance.node == name) has[instance.nodeIndex] = yes;
  }
  for (std::uint32_t start = 0; start < has.size(); ++start) {
    std::uint32_t at = start;
    while (at != kNone && has[at] == unknown) at = scene.nodes[at].parent;
    const std::uint8_t found = at == kNone ? std::uint8_t{no} : has[at];
    for (at = start; at != kNone && has[at] == unknown; at = scene.nodes[at].parent) has[at] = found;
  }
  return has;
}

Status moveNode(const std::string& name, const glm::vec3& offset, MovedParts parts, Scene& scene) {
  const std::vector<std::uint8_t> has = nodesWith(name, scene);
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
  for (SceneLight& light : scene.lights) {
    if (!moves(light.nodeIndex)) continue;
    isKnown = true;
    light.positionWorld += offset;
  }
  for (Camera& camera : scene.cameras) {
    if (moves(camera.nodeIndex)) move(camera.toWorld);
  }
  for (PlayVolume& volume : scene.volumes) {
    if (moves(volume.nodeIndex)) move(volume.toWorld);
  }
  if (isKnown) return done();
  return moveNodeError(
      "no node \"" + name +
      "\" with something that is drawn, a light, a camera or a play volume; there are: " + namesOf(scene));
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

Status moveNodes(const std::vector<std::string>& moves, MovedParts parts, Scene& scene) {
  if (moves.empty()) return done();
  for (const std::string& move : moves) {
    const std::size_t equals = move.rfind('=');
    const auto offset = equals == std::string::npos ? std::nullopt : threeNumbers(move.substr(equals + 1));
    if (!offset || equals == 0 || !isWithin(*offset, kMaxLevelCoordinate))
      return moveNodeError("NODE=X,Y,Z, in metres within 1e8, expected, \"" + move + "\" found");
    if (Status ok = moveNode(move.substr(0, equals), *offset, parts, scene); !ok) return ok;
  }
  if (const Status within = checkLimits(scene); !within) return moveNodeError(within.error().message);
  return done();
}

}  // namespace relume
