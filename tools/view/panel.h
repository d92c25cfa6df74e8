// SPDX-License-Identifier: MIT
// The panel: controls for what a session shows, its lights, and what it costs; and what the window has to say.
#pragma once

#include "tools/view/session.h"

namespace relume {

// Draw the panel and the messages of this ImGui frame.
void drawPanel(Session& session);

// What frames cost: a plot of the passes' times, the memory of what is kept. Within the panel's window.
void drawCosts(Session& session);

// Controls of the lights, within the panel's window.
void drawLightControls(Session& session);

}  // namespace relume
