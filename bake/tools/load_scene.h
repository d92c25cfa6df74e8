// SPDX-License-Identifier: MIT
// How every command that needs surfaces reads a level: import, then repair what is safe to repair. The same steps
// everywhere, so that hashes, triangle numbers and rays agree between bake, render, reference and status.
#pragma once

#include "bake/context.h"
#include "bake/scene/scene.h"
#include "formats/result.h"

#include <string>

namespace CLI {
class App;
}

namespace relume {

// Whether the meshes' findings go to the log, a line a kind, before the repair.
enum class MeshReport { none, log };

// How a level is read, as the command line has it.
struct SceneOptions {
  std::string lightUnit;  // empty: as the file says
};
void addSceneOptions(CLI::App& command, SceneOptions& options);
ImportOptions toImportOptions(const SceneOptions& options);

// Errors of importGltf(); failed when cancelled. A line of the log says what was repaired.
Result<Scene> loadScene(const std::string& path, Context& context, const SceneOptions& options,
                        MeshReport report = MeshReport::none);

}  // namespace relume
