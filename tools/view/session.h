// SPDX-License-Identifier: MIT
// What the window is busy with: the level it shows, how it shows it, and the edits of its lights. Commands of keys, the
// panel and dropped files end here; window.h feeds it, the panel draws it.
#pragma once

#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "tools/view/gizmo.h"
#include "tools/view/light_editor.h"
#include "tools/view/messages.h"
#include "tools/view/options.h"
#include "tools/view/view_state.h"
#include "tools/view/viewer.h"

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace relume {

enum class Command {
  undo,
  redo,
  saveLights,
  loadLights,
  removeLight,
  duplicateLight,
  cancel,
  togglePanel,
  toggleHandles
};

// A rectangle of the window that the panel covers [pixel].
struct PixelBox {
  glm::vec2 low{0.0f}, high{0.0f};
  bool holds(const glm::vec2& p) const { return p.x >= low.x && p.y >= low.y && p.x < high.x && p.y < high.y; }
};

class Session {
 public:
  // What it is given must outlive it.
  Session(const Scene& scene, const Bake& bake, Viewer& viewer, ViewState first, const ViewerOptions& options);

  void run(Command command);
  void addLight(LightKind kind);
  // The left button at a pixel of the window.
  void press(const glm::vec2& pixel);
  void move(const glm::vec2& pixel);
  void release();

  // Once a frame: `now` [s], the window's size [pixel].
  void beginFrame(double now, const glm::vec2& windowSize);
  // Whether a control of the panel is held: what it changes is an edit once it is let go.
  void endControls(bool isHeld);

  const PixelView& pixels() const { return pixels_; }
  void say(Severity severity, std::string text) { messages.say(severity, std::move(text), now_); }

  const Scene& scene;
  const Bake& bake;
  Viewer& viewer;
  ViewState state;
  LightEditor editor;
  Messages messages;
  std::string lightsFile;         // that lights are saved to and loaded from
  std::vector<PixelBox> covered;  // by the panel, in the last frame
  glm::vec2 mouse{-1.0f};
  std::optional<std::size_t> shownLight;  // whose controls the panel had in the last frame

 private:
  void saveLights();
  void loadLights();
  void duplicateLight();

  PixelView pixels_;
  double now_ = 0.0;
};

}  // namespace relume
