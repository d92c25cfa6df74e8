// SPDX-License-Identifier: MIT
// See session.h.
#include "tools/view/session.h"

#include "tools/view/light_set.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

namespace relume {

Session::Session(ViewState first, const ViewerOptions& options, GetProcAddress getProcAddress)
    : state(std::move(first)),
      lightsFile(options.lightsFile.empty() ? kLightsFile : options.lightsFile),
      options_(options),
      bakesAtOnce_(options.draft),
      getProcAddress_(std::move(getProcAddress)),
      capture_(options.output.empty() ? "." : options.output) {
  if (!options.lightsFile.empty()) ownLights_.insert(fullPath(options.lightsFile));
  editor.giveIds(state.lights);
  edits.begin(state);
}

// Make the relighter that the state asks for; one that cannot be had is told, and the choice taken back.
void Session::relightAsChosen() {
  if (viewer->relightBy() == state.relightBy) return;
  if (!messages.check(viewer->choose(state.relightBy), now_)) state.relightBy = viewer->relightBy();
}

void Session::recordsAsChosen() {
  if (state.records && !messages.check(viewer->makeRecords(), now_)) state.records = false;
}

void Session::run(Command command) {
  switch (command) {
    case Command::undo:
    case Command::redo:
      cancelDrags();
      tellSwitchedOff(command == Command::undo ? edits.undo(state) : edits.redo(state));
      return editor.keepSelectionWithin(state.lights);
    case Command::saveLights:
      return saveLights();
    case Command::loadLights:
      return loadLights(lightsFile);
    case Command::removeLight:
      edits.commit(state);
      editor.removeSelected(state.lights);
      return edits.commit(state);
    case Command::duplicateLight:
      return duplicateLight();
    case Command::cancel:
      if (objects.isDragging()) return objects.cancelDrag(state.objects);
      if (editor.isDragging()) return editor.cancelDrag(state.lights);
      objects.select({});
      return editor.select({});
    case Command::togglePanel:
      state.panel = !state.panel;
      return;
    case Command::toggleHandles:
      state.handles = !state.handles;
      return;
    case Command::screenshot:
      screenshotWanted_ = true;
      return;
    case Command::film:
      return toggleFilm();
  }
}

void Session::addLight(LightKind kind) {
  if (!viewer) return;
  ViewedLight light = newLight(kind, state.camera, state.lights, {viewer->levelSize(), viewer->distanceAhead(state)});
  if (!light.on)
    say(Severity::warning, "the new light is off: " + std::to_string(kMaxLightsOn) + " are on, and no more can be");
  edits.commit(state);
  editor.add(state.lights, std::move(light));
  edits.commit(state);
}

void Session::cancelDrags() {
  objects.cancelDrag(state.objects);
  editor.cancelDrag(state.lights);
}

// Lights that were on, and are not because too many would be.
void Session::tellSwitchedOff(std::size_t lights) {
  if (lights > 0) say(Severity::warning, switchedOffText(lights));
}

// Note what controls or a drag have changed, once it is over.
void Session::commit() {
  if (!editor.isDragging() && !objects.isDragging()) edits.commit(state);
}

void Session::duplicateLight() {
  const auto index = editor.indexIn(state.lights);
  if (!index) return;
  ViewedLight light = state.lights[*index];
  light.name = freeName(light.name, state.lights);
  light.on = light.on && lightsOn(state.lights) < kMaxLightsOn;
  edits.commit(state);
  editor.add(state.lights, std::move(light));
  edits.commit(state);
}

void Session::saveLights() {
  const std::filesystem::path path = fullPath(lightsFile);
  std::error_code failed;
  const bool isReplaced = std::filesystem::is_regular_file(path, failed) && !std::filesystem::is_empty(path, failed);
  if (isReplaced && !ownLights_.contains(path)) {
    return say(Severity::error, "\"" + lightsFile +
                                    "\": not replaced, for it was neither loaded nor saved with this level; save "
                                    "under another name, or load it first");
  }
  if (!messages.check(saveLightSet(lightsFile, state.lights), now_)) return;
  ownLights_.insert(path);
  say(Severity::info, countOfLights(lightsOn(state.lights)) + " saved to \"" + lightsFile + "\"");
}

// The file is then the one that lights are saved to.
void Session::loadLights(const std::string& path) {
  auto lights = loadLightSet(path);
  if (!lights) return say(Severity::error, lights.error().message + "; the lights stay as they are");
  lightsFile = path;
  ownLights_.insert(fullPath(path));
  say(Severity::info, countOfLights(lights->size()) + " loaded from \"" + lightsFile + "\"");
  edits.commit(state);
  editor.replace(state.lights, std::move(*lights));
  edits.commit(state);
}

bool Session::isCovered(const glm::vec2& pixel) const {
  return std::any_of(covered.begin(), covered.end(), [&](const PixelBox& box) { return box.holds(pixel); });
}

void Session::press(const glm::vec2& pixel) {
  mouse = pixel;
  commit();
  if (isCovered(pixel)) return;
  if (state.handles && objects.press(state.objects, pixels_, pixel)) return;
  const bool isLight = state.handles && editor.press(state.lights, pixels_, pixel);
  if (isLight) objects.select({});
  const bool picks = state.shows(Overlay::links) || (state.handles && level && level->movable() == Movable::all);
  if (!isLight && picks) pick_ = pixel;
}

void Session::move(const glm::vec2& pixel) {
  mouse = pixel;
  editor.move(state.lights, pixels_, pixel);
  objects.move(state.objects, pixels_, pixel);
}

void Session::release() {
  editor.release();
  objects.release();
  commit();
}

void Session::scroll(const glm::vec2& pixel, float notches) {
  if (isCovered(pixel)) return;
  flySpeed.scroll(notches);
  messages.update("fly speed", "flies at " + flySpeed.text(), now_);
}

void Session::beginFrame(double now, const glm::vec2& windowSize) {
  animation_ += frameSeconds(now - now_);
  now_ = now;
  messages.forgetOld(now);
  finishJob();
  finishReference();
  watchBake();
  const glm::vec2 size = glm::max(windowSize, glm::vec2(1.0f));
  const float aspect = size.x / size.y;
  pixels_ = {
      viewer ? viewer->viewOf(state.camera, aspect).clipFromWorld() : state.camera.clipFromWorld(aspect, 0.1f, 100.0f),
      state.camera.position, size};
}

bool Session::isMoving() const {
  if (capture_.isFilming()) return true;
  if (!viewer) return false;
  const LiveShading* const live = viewer->live();
  if (live && state.relight && !live->last().isSettled) return true;
  if (viewer->awaitsVoxels(state) || (state.relight && viewer->awaitsEdits())) return true;
  if (viewer->showsRecords(state) && !viewer->records()->isComplete()) return true;
  return std::any_of(state.lights.begin(), state.lights.end(), [](const ViewedLight& l) { return l.on && l.orbits; });
}

void Session::toggleFilm() {
  if (!capture_.isFilming()) {
    if (messages.check(capture_.beginFilm(), now_)) say(Severity::info, "filming; F11 ends the film");
    return;
  }
  const std::string frames = std::to_string(capture_.frames());
  say(Severity::info, frames + " frames in \"" + capture_.endFilm().string() + "\"");
}

// Of the level as it has just been drawn.
void Session::takePictures(std::uint32_t width, std::uint32_t height) {
  messages.check(capture_.frame(width, height), now_);
  if (!std::exchange(screenshotWanted_, false)) return;
  const auto path = capture_.screenshot(width, height);
  if (!path) return say(Severity::error, path.error().message);
  say(Severity::info, "\"" + path->string() + "\" written");
}

// A view that could not be drawn, or lit, as it is now is no picture: the framebuffer has an older one.
void Session::refusePictures() {
  if (std::exchange(screenshotWanted_, false)) say(Severity::error, "no picture: the view could not be drawn");
  if (!capture_.isFilming()) return;
  const std::string frames = std::to_string(capture_.frames()), folder = capture_.endFilm().string();
  say(Severity::error, "the view could not be drawn, which ends the film: " + frames + " frames in \"" + folder + "\"");
}

// The point of the links, or the object that is there.
void Session::pick(const glm::vec3& pointWorld) {
  if (state.shows(Overlay::links)) state.picked = pointWorld;
  if (level->movable() != Movable::all) return;
  const std::vector<MovingNode> nodes = movingNodes(level->scene, level->movable());
  objects.select(objectAt(level->scene, nodes, state.objects, pointWorld));
}

void Session::endControls(bool isHeld) {
  if (isHeld) return;
  commit();
  LiveShading* const live = viewer ? viewer->live() : nullptr;
  if (!live || live->options() == state.live) return;
  const Status chosen = live->choose(state.live);
  if (!chosen) state.live = live->options();
  messages.check(chosen, now_);
}

// What is looked into, or kept, is drawn whole. Whether it could be drawn, in its own light.
bool Session::drawView(GLuint framebuffer, std::uint32_t width, std::uint32_t height) {
  const bool isWanted = coarse.isWanted(state) && !pick_ && !capture_.isFilming() && !screenshotWanted_;
  const auto target = isWanted ? coarse.begin(width, height) : std::nullopt;
  // A frame of a film waits for light of its own, by the film's time.
  const double liveStep = state.liveStep;
  if (capture_.isFilming()) state.liveStep = Capture::kFrameSeconds;
  Status drawn = done();
  if (target) {
    drawn = viewer->draw(state, target->framebuffer, target->width, target->height, true);
    coarse.end(framebuffer, width, height);
  } else {
    drawn = viewer->draw(state, framebuffer, width, height, true);
  }
  state.liveStep = liveStep;
  if (!viewer->times().empty()) coarse.tell(viewer->times().back().second, target.has_value());
  return messages.check(drawn, now_);
}

void Session::draw(GLuint framebuffer, std::uint32_t width, std::uint32_t height) {
  if (viewer) {
    relightAsChosen();
    recordsAsChosen();
    const bool isDrawn = drawView(framebuffer, width, height);
    if (pick_) {
      const glm::vec2 scale = glm::vec2(width, height) / pixels_.size;
      if (const auto point = viewer->surfaceAt(state, scale * *pick_, width, height)) {
        pick(*point);
      } else {
        objects.select({});
      }
    }
    pick_.reset();
    times.add(viewer->times());
    if (isDrawn) {
      takePictures(width, height);
    } else {
      refusePictures();
    }
    return;
  }
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glClearColor(0.08f, 0.08f, 0.08f, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

}  // namespace relume
