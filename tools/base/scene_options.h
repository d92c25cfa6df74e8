// SPDX-License-Identifier: MIT
// How a level is read, as the command line has it: one set of options for every command that takes a level.
#pragma once

#include "relume/bake/scene.h"

#include <string>

namespace CLI {
class App;
}

namespace relume {

struct SceneOptions {
  std::string lightUnit;  // empty: as the file says
  bool gloss = false;     // with what pictures of glossy surfaces need; an option of the commands that draw them
};
void addSceneOptions(CLI::App& command, SceneOptions& options);
ImportOptions toImportOptions(const SceneOptions& options);

}  // namespace relume
