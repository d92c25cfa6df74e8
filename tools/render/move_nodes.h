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

// Move the nodes of "NODE=X,Y,Z" by so many metres, all that have the name. usage: another text, a node that draws
// nothing or that the level does not have, one that is part of the bake.
Status moveNodes(const std::vector<std::string>& moves, MovedParts parts, Scene& scene);

}  // namespace relume
