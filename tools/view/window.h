// SPDX-License-Identifier: MIT
// The viewer's window (GLFW) and its panel (Dear ImGui).
#pragma once

#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/result.h"
#include "tools/view/options.h"

namespace relume {

// Runs until the window is closed. unsupported: no display or no OpenGL 4.3; else as Viewer.
Status runWindow(const Scene& scene, const Bake& bake, const ViewerOptions& options);

}  // namespace relume
