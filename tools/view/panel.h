// SPDX-License-Identifier: MIT
// The panel that changes a ViewState: lights, sky, views, overlays, pass times.
#pragma once

#include "relume/bake/scene.h"
#include "tools/view/viewer.h"

namespace relume {

// Draw the panel of this ImGui frame.
void drawPanel(const Scene& scene, const Bake& bake, Viewer& viewer, ViewState& state);

}  // namespace relume
