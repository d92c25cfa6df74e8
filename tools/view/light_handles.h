// SPDX-License-Identifier: MIT
// Draws the lights' icons and the gizmo of the one that is selected over the level, in the current ImGui frame.
#pragma once

#include "tools/view/light_editor.h"
#include "tools/view/object_editor.h"

#include <glm/vec2.hpp>

namespace relume {

// mouse: the handle under it is drawn bright.
void drawLightHandles(const LightEditor& editor, const LightEditor::Lights& lights, const PixelView& view,
                      const glm::vec2& mouse);

// The gizmo and the name of the object that is selected.
void drawObjectHandles(const ObjectEditor& editor, const ObjectEditor::Objects& objects, const PixelView& view,
                       const glm::vec2& mouse);

}  // namespace relume
