// SPDX-License-Identifier: MIT
// The viewer's window (GLFW) and its panel (Dear ImGui).
#pragma once

#include "relume/bake/scene.h"
#include "relume/result.h"
#include "tools/view/loaded_level.h"
#include "tools/view/options.h"

namespace relume {

// Runs until the window is closed. level: what it shows; null: `scene` is baked at preset draft, while the window shows
// how far that is. unsupported: no display or no OpenGL 4.3; else as Viewer and initialState().
Status runWindow(Scene scene, LevelPtr level, const ViewerOptions& options);

}  // namespace relume
