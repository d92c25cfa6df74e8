// SPDX-License-Identifier: MIT
// See scene_options.h.
#include "tools/base/scene_options.h"

#include <CLI/CLI.hpp>

namespace relume {

void addSceneOptions(CLI::App& command, SceneOptions& options) {
  command
      .add_option(
          "--light-unit", options.lightUnit,
          "what the numbers of the level's lights are: radiometric (W/sr, W/m^2) or photometric (cd, lx, as "
          "Blender exports by default; 683 lm/W); default: extras.relume.lightUnit of the level, or radiometric")
      ->check(CLI::IsMember({"radiometric", "photometric"}));
}

ImportOptions toImportOptions(const SceneOptions& options) {
  ImportOptions import;
  if (!options.lightUnit.empty())
    import.lightUnit = options.lightUnit == "photometric" ? LightUnit::photometric : LightUnit::radiometric;
  import.gloss = options.gloss;
  return import;
}

}  // namespace relume
