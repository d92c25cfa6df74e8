// SPDX-License-Identifier: MIT
// See session.h.
#include "tools/view/session.h"

#include "tools/view/light_set.h"

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <utility>

namespace relume {
namespace {

// Objects of the level where they have been moved to, unless the level has them elsewhere now.
std::vector<ViewedObject> keptObjects(const std::vector<ViewedObject>& before, std::vector<ViewedObject> now) {
  for (ViewedObject& object : now) {
    const auto same = std::find_if(before.begin(), before.end(), [&](const ViewedObject& b) {
      return b.name == object.name && b.home == object.home;
    });
    if (same != before.end()) object.position = same->position;
  }
  return now;
}

std::string whatCameOf(const LevelFiles& files) {
  const std::string scene = "\"" + files.scene + "\" ";
  if (!files.hasBake()) return scene + "is lit without a bake";
  if (!files.bakeBy) return "\"" + files.bake + "\" loaded";
  const bool isDraft = optionsToJson(*files.bakeBy) == optionsToJson(presetOptions(Preset::draft));
  const std::string by =
      isDraft ? "at preset draft" : "with " + std::string(linkKindName(files.bakeBy->links.kind)) + " links";
  return scene + "baked " + by + ", in memory alone; relume bake writes a bake";
}

std::string counted(std::size_t lights) { return std::to_string(lights) + (lights == 1 ? " light" : " lights"); }

}  // namespace

Session::Session(ViewState first, const ViewerOptions& options, GetProcAddress getProcAddress)
    : state(std::move(first)),
      lightsFile(options.lightsFile.empty() ? "lights.json" : options.lightsFile),
      options_(options),
      bakesAtOnce_(options.draft),
      getProcAddress_(std::move(getProcAddress)),
      capture_(options.output.empty() ? "." : options.output) {
  edits.begin(state);
}

Status Session::show(LevelPtr next) {
  const bool isSame = level && level->sceneFile == next->sceneFile;
  // The level of the command line has the state that this began with.
  const bool isFirst = !level && next->sceneFile == options_.scene;
  ViewState wanted = state;
  pick_.reset();
  if (isSame) {
    wanted.objects = keptObjects(state.objects, objectsOf(next->scene, next->movable()));
  } else if (!isFirst) {
    // Names of the first level's cameras and lights say nothing of this one.
    options_.camera.clear();
    options_.lights = {"all"};
    options_.lightsFile.clear();
    options_.driven.clear();
    options_.bake.clear();
    options_.draft = next->isBaked;
    auto fresh = initialState(next->scene, options_);
    if (!fresh) return fresh.error();
    wanted = std::move(*fresh);
  }
  auto made = Viewer::create(*next, options_.shadowSize, wanted, getProcAddress_, isSame ? &*viewer : nullptr);
  if (!made) return made.error();
  viewer.emplace(std::move(*made));
  level = std::move(next);
  watch_ = FileWatch(level->bakeFile, level->bakeStamp);
  state = std::move(wanted);
  if (const std::size_t off = limitLightsOn(state.lights); off > 0) {
    say(Severity::warning,
        counted(off) + " switched off: " + std::to_string(kMaxLightsOn) + " are on, and no more can be");
  }
  objects.select({});
  if (isSame) {
    edits.replace(state);
  } else {
    editor.cancelDrag(state.lights);
    editor.select({});
    edits.begin(state);
  }
  if (state.sky.map && level->isBaked && level->bake.hierarchy.skyDirection.empty())
    say(Severity::warning, "the bake has no patches of sky, so the sky map lights nothing; bake with --sky-patches 64");
  return done();
}

LevelFiles Session::filesOf(const std::string& scene, const std::string& bake) const {
  // --emission names materials of the level of the command line.
  return {scene,
          bake,
          options_.sceneOptions,
          options_.allowStale,
          scene == options_.scene ? options_.driven : std::vector<DrivenMaterial>(),
          {},
          options_.edit};
}

void Session::bakeDraft() {
  if (!level || job) return;
  LevelFiles files = filesOf(level->sceneFile, "");
  files.bakeBy = presetOptions(Preset::draft);
  begin(std::move(files));
}

void Session::bakeLinks(LinkKind kind) {
  if (!level || !level->isBaked || job) return;
  auto options = optionsFromJson(level->bake.provenance.optionsJson, BakeOptions());
  if (!options) return say(Severity::error, options.error().message);
  options->links.kind = kind;
  LevelFiles files = filesOf(level->sceneFile, level->bakeFile);
  files.bakeBy = std::move(*options);
  begin(std::move(files));
}

// Make the relighter that the state asks for; one that cannot be had is told, and the choice taken back.
void Session::relightAsChosen() {
  if (viewer->relightBy() == state.relightBy) return;
  if (!messages.check(viewer->choose(state.relightBy), now_)) state.relightBy = viewer->relightBy();
}

void Session::recordsAsChosen() {
  if (state.records && !messages.check(viewer->makeRecords(), now_)) state.records = false;
}

void Session::begin(LevelFiles files, std::optional<Scene> scene) {
  draftNext_ = false;
  job.reset();
  job.emplace(std::move(files), std::move(scene));
}

void Session::drop(const std::string& path) {
  std::string extension = std::filesystem::path(path).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".glb" || extension == ".gltf") {
    LevelFiles files = filesOf(path, "");
    if (bakesAtOnce_) files.bakeBy = presetOptions(Preset::draft);
    begin(std::move(files));
    draftNext_ = !bakesAtOnce_;
    return;
  }
  if (extension == ".json") {
    lightsFile = path;
    return loadLights();
  }
  if (extension == ".relume" && level) return begin(filesOf(level->sceneFile, path));
  say(Severity::error, "\"" + path +
                           "\": a level (.glb, .gltf), a bake of the level that is shown (.relume) or a list of "
                           "lights (.json) expected");
}

void Session::finishJob() {
  if (!job) return;
  for (std::string& warning : job->takeWarnings()) warnings.push_back(std::move(warning));
  auto result = job->takeResult();
  if (!result) return;
  const bool isCancelled = job->isCancelled();
  const LevelFiles files = job->files();
  const bool isDraftNext = std::exchange(draftNext_, false);
  job.reset();
  const std::string kept = level ? "; what is shown stays" : "";
  if (isCancelled) return say(Severity::info, "cancelled" + kept);
  if (!*result) return say(Severity::error, result->error().message + kept);
  if (const Status shown = show(std::move(**result)); !shown) return say(Severity::error, shown.error().message + kept);
  const std::string noted =
      warnings.empty() ? "" : "; " + std::to_string(warnings.size()) + " warnings about the level are in the terminal";
  say(Severity::info, whatCameOf(files) + noted);
  if (isDraftNext) bakeDraft();
}

void Session::compareWithReference() {
  if (!viewer) return;
  reference.reset();
  heat.reset();
  const float aspect = pixels_.size.x / pixels_.size.y;
  const auto height =
      static_cast<std::uint32_t>(std::clamp(static_cast<float>(ReferenceJob::kWidth) / aspect, 1.0f, 1024.0f));
  auto shown = viewer->irradiance(state, ReferenceJob::kWidth, height);
  if (!shown) return say(Severity::error, shown.error().message);
  reference.emplace(level, state, height, std::move(*shown));
}

void Session::finishReference() {
  if (!reference) return;
  auto result = reference->takeResult();
  if (!result) return;
  const bool isCancelled = reference->isCancelled();
  reference.reset();
  if (isCancelled) return;
  if (!*result) return say(Severity::error, result->error().message);
  heat = std::move(**result);
  heatTexture = GlTexture::make();
  glBindTexture(GL_TEXTURE_2D, heatTexture.name());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, static_cast<GLsizei>(heat->width), static_cast<GLsizei>(heat->height), 0,
               GL_RGB, GL_UNSIGNED_BYTE, heat->rgb.data());
  glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glBindTexture(GL_TEXTURE_2D, 0);
}

// A bake that has changed on disk is loaded, unless something is on its way already.
void Session::watchBake() {
  if (job || !level || !watch_.hasChanged(now_)) return;
  begin(filesOf(level->sceneFile, level->bakeFile));
}

void Session::run(Command command) {
  switch (command) {
    case Command::undo:
    case Command::redo:
      cancelDrags();
      command == Command::undo ? edits.undo(state) : edits.redo(state);
      return editor.keepSelectionWithin(state.lights);
    case Command::saveLights:
      return saveLights();
    case Command::loadLights:
      return loadLights();
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
  ViewedLight light = newLight(kind, state.camera, state.lights);
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

// Note what controls or a drag have changed, once it is over.
void Session::commit() {
  if (!editor.isDragging() && !objects.isDragging()) edits.commit(state);
}

void Session::duplicateLight() {
  if (!editor.selected()) return;
  ViewedLight light = state.lights[*editor.selected()];
  light.name = freeName(light.name, state.lights);
  light.on = light.on && lightsOn(state.lights) < kMaxLightsOn;
  edits.commit(state);
  editor.add(state.lights, std::move(light));
  edits.commit(state);
}

void Session::saveLights() {
  if (!messages.check(saveLightSet(lightsFile, state.lights), now_)) return;
  say(Severity::info, counted(lightsOn(state.lights)) + " saved to \"" + lightsFile + "\"");
}

void Session::loadLights() {
  auto lights = loadLightSet(lightsFile);
  if (!lights) return say(Severity::error, lights.error().message + "; the lights stay as they are");
  say(Severity::info, counted(lights->size()) + " loaded from \"" + lightsFile + "\"");
  edits.commit(state);
  editor.replace(state.lights, std::move(*lights));
  edits.commit(state);
}

void Session::press(const glm::vec2& pixel) {
  mouse = pixel;
  commit();
  if (std::any_of(covered.begin(), covered.end(), [&](const PixelBox& box) { return box.holds(pixel); })) return;
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

void Session::beginFrame(double now, const glm::vec2& windowSize) {
  animation_ += capture_.isFilming() ? Capture::kFrameSeconds : now - now_;
  now_ = now;
  messages.forgetOld(now);
  finishJob();
  finishReference();
  watchBake();
  const glm::vec2 size = glm::max(windowSize, glm::vec2(1.0f));
  const float aspect = size.x / size.y;
  pixels_ = {viewer ? viewer->clipFromWorld(state.camera, aspect) : state.camera.clipFromWorld(aspect, 0.1f, 100.0f),
             state.camera.position, size};
}

bool Session::isMoving() const {
  if (capture_.isFilming()) return true;
  if (!viewer) return false;
  const LiveShading* const live = viewer->live();
  if (live && state.relight && !live->last().isSettled) return true;
  if (viewer->awaitsVoxels(state) || (state.relight && viewer->awaitsEdits())) return true;
  if (state.records && viewer->records() && !viewer->records()->isComplete()) return true;
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

// What is looked into, or kept, is drawn whole.
void Session::drawView(GLuint framebuffer, std::uint32_t width, std::uint32_t height) {
  const bool isWanted = coarse.isWanted(state) && !pick_ && !capture_.isFilming() && !screenshotWanted_;
  const auto target = isWanted ? coarse.begin(width, height) : std::nullopt;
  if (target) {
    messages.check(viewer->draw(state, target->framebuffer, target->width, target->height, true), now_);
    coarse.end(framebuffer, width, height);
  } else {
    messages.check(viewer->draw(state, framebuffer, width, height, true), now_);
  }
  if (!viewer->times().empty()) coarse.tell(viewer->times().back().second, target.has_value());
}

void Session::draw(GLuint framebuffer, std::uint32_t width, std::uint32_t height) {
  if (viewer) {
    relightAsChosen();
    recordsAsChosen();
    drawView(framebuffer, width, height);
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
    takePictures(width, height);
    return;
  }
  glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  glClearColor(0.08f, 0.08f, 0.08f, 1.0f);
  glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

}  // namespace relume
