// SPDX-License-Identifier: MIT
// --move-node: nodes of a level that stand elsewhere in a picture than in the file.
#pragma once

#include "relume/bake/scene.h"
#include "relume/result.h"

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace relume {

void addMoveOption(CLI::App& command, std::vector<std::string>& moves);

// Which parts may move: all, or those that no bake knows.
enum class MovedParts { all, dynamic };

// Move the nodes of "NODE=X,Y,Z" by so many metres, all that have the name, with all that is below them by
// Scene::nodes: instances, lights, cameras and play volumes. Of a scene without nodes, the instances that have the
// name. usage: another text, a node that has none of these or that the level does not have, one with a part of the
// bake, a place that no level may have.
Status moveNodes(const std::vector<std::string>& moves, MovedParts parts, Scene& scene);

}  // namespace relume
