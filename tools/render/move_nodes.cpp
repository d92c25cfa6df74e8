// SPDX-License-Identifier: MIT
// See move_nodes.h.
#include "tools/render/move_nodes.h"

#include "formats/limits.h"
#include "tools/base/parse_numbers.h"

#include <CLI/CLI.hpp>

#include <glm/vec4.hpp>

#include <set>

namespace relume {
namespace {

Error moveNodeError(std::string message) { return {ErrorCode::usage, "--move-node: " + std::move(message)}; }

// A few of the names that there are.
std::string namesOf(const Scene& scene) {
  constexpr std::size_t kMost = 12;
  std::set<std::string> names;
  for (const Instance& instance : scene.instances) names.insert(instance.node);
  std::string text;
  std::size_t told = 0;
  for (const std::string& name : names) {
    if (told++ == kMost) return text + " and " + std::to_string(names.size() - kMost) + " more";
    text += (text.empty() ? "\"" : ", \"") + name + "\"";
  }
  return text.empty() ? "none" : text;
}

}  // namespace

void addMoveOption(CLI::App& command, std::vector<std::string>& moves) {
  command
      .add_option("--move-node", moves,
                  "move a node by X,Y,Z metres, with all it draws; several times for several nodes. With a bake only "
                  "dynamic nodes move, unless --edited-from is given")
      ->type_name("NODE=X,Y,Z")
      ->allow_extra_args(false);
}

Status moveNodes(const std::vector<std::string>& moves, MovedParts parts, Scene& scene) {
  for (const std::string& move : moves) {
    const std::size_t equals = move.rfind('=');
    const auto offset = equals == std::string::npos ? std::nullopt : threeNumbers(move.substr(equals + 1));
    if (!offset || equals == 0 || !isWithin(*offset, kMaxLevelCoordinate))
      return moveNodeError("NODE=X,Y,Z, in metres within 1e8, expected, \"" + move + "\" found");
    const std::string node = move.substr(0, equals);
    bool isKnown = false;
    for (Instance& instance : scene.instances) {
      if (instance.node != node) continue;
      isKnown = true;
      if (parts == MovedParts::dynamic && instance.baked())
        return moveNodeError(
            "\"" + node +
            "\" is part of the bake; give --edited-from, leave out --bake, or make it dynamic and bake again");
      instance.toWorld[3] += glm::vec4(*offset, 0.0f);
    }
    if (!isKnown) return moveNodeError("no node \"" + node + "\" that draws something; there are: " + namesOf(scene));
  }
  return done();
}

}  // namespace relume
