// SPDX-License-Identifier: MIT
// See session.h.
#include "tools/view/session.h"

#include "tools/view/light_set.h"

#include <algorithm>
#include <utility>

namespace relume {

Session::Session(const Scene& theScene, const Bake& theBake, Viewer& theViewer, ViewState first,
                 const ViewerOptions& options)
    : scene(theScene),
      bake(theBake),
      viewer(theViewer),
      state(std::move(first)),
      lightsFile(options.lightsFile.empty() ? "lights.json" : options.lightsFile) {
  editor.begin(state.lights);
}

void Session::run(Command command) {
  switch (command) {
    case Command::undo:
      return editor.undo(state.lights);
    case Command::redo:
      return editor.redo(state.lights);
    case Command::saveLights:
      return saveLights();
    case Command::loadLights:
      return loadLights();
    case Command::removeLight:
      return editor.removeSelected(state.lights);
    case Command::duplicateLight:
      return duplicateLight();
    case Command::cancel:
      if (editor.isDragging()) return editor.cancelDrag(state.lights);
      return editor.select({});
    case Command::togglePanel:
      state.panel = !state.panel;
      return;
    case Command::toggleHandles:
      state.handles = !state.handles;
      return;
  }
}

void Session::addLight(LightKind kind) {
  ViewedLight light = newLight(kind, state.camera, state.lights);
  if (!light.on)
    say(Severity::warning, "the new light is off: " + std::to_string(kMaxLightsOn) + " are on, and no more can be");
  editor.add(state.lights, std::move(light));
}

void Session::duplicateLight() {
  if (!editor.selected()) return;
  ViewedLight light = state.lights[*editor.selected()];
  light.name = freeName(light.name, state.lights);
  light.on = light.on && lightsOn(state.lights) < kMaxLightsOn;
  editor.add(state.lights, std::move(light));
}

void Session::saveLights() {
  editor.commit(state.lights);
  if (!messages.check(saveLightSet(lightsFile, state.lights), now_)) return;
  say(Severity::info, std::to_string(lightsOn(state.lights)) + " lights saved to \"" + lightsFile + "\"");
}

void Session::loadLights() {
  auto lights = loadLightSet(lightsFile);
  if (!lights) return say(Severity::error, lights.error().message + "; the lights stay as they are");
  say(Severity::info, std::to_string(lights->size()) + " lights loaded from \"" + lightsFile + "\"");
  editor.replace(state.lights, std::move(*lights));
}

void Session::press(const glm::vec2& pixel) {
  mouse = pixel;
  if (std::any_of(covered.begin(), covered.end(), [&](const PixelBox& box) { return box.holds(pixel); })) return;
  if (state.handles) editor.press(state.lights, pixels_, pixel);
}

void Session::move(const glm::vec2& pixel) {
  mouse = pixel;
  editor.move(state.lights, pixels_, pixel);
}

void Session::release() { editor.release(state.lights); }

void Session::beginFrame(double now, const glm::vec2& windowSize) {
  now_ = now;
  messages.forgetOld(now);
  pixels_ = {viewer.clipFromWorld(state.camera, windowSize.x / std::max(windowSize.y, 1.0f)), state.camera.position,
             glm::max(windowSize, glm::vec2(1.0f))};
}

void Session::endControls(bool isHeld) {
  if (!isHeld) editor.commit(state.lights);
}

}  // namespace relume
