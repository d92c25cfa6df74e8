// SPDX-License-Identifier: MIT
// How everything that needs surfaces reads a level: import, then repair what is safe to repair. The same steps
// everywhere, so that hashes, triangle numbers and rays agree between bake, render, reference and status.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/result.h"

#include <string>

namespace relume {

// Whether the meshes' findings go to the log, a line a kind, before the repair.
enum class MeshReport { none, log };

// Errors of importGltf() (scene.h); failed when cancelled. A line of the log says what was repaired. Any thread; loads
// that run at once need a context each.
Result<Scene> loadScene(const std::string& path, Context& context, const ImportOptions& options = {},
                        MeshReport report = MeshReport::none);

}  // namespace relume
