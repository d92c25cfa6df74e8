// SPDX-License-Identifier: MIT
// Draws the lights' icons and the gizmo of the one that is selected over the level, in the current ImGui frame.
#pragma once

#include "tools/view/light_editor.h"

#include <glm/vec2.hpp>

namespace relume {

// mouse: the handle under it is drawn bright.
void drawLightHandles(const LightEditor& editor, const LightEditor::Lights& lights, const PixelView& view,
                      const glm::vec2& mouse);

// Draw a gizmo, one of its handles bright.
void drawGizmo(const Gizmo& gizmo, Handle bright, const PixelView& view);

}  // namespace relume
