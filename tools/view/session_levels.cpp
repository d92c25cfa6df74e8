// SPDX-License-Identifier: MIT
// The levels of a session: what is loaded or baked for it, dropped on it or changed on disk, and the reference that a
// view is held against. See session.h.
#include "tools/view/session.h"

#include "tools/view/light_set.h"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <utility>

namespace relume {
namespace {

// Objects of the level where they have been moved to, unless the level has them elsewhere now. Those of one name and
// home are told apart by their order.
std::vector<ViewedObject> keptObjects(std::vector<ViewedObject> before, std::vector<ViewedObject> now) {
  for (ViewedObject& object : now) {
    const auto same = std::find_if(before.begin(), before.end(), [&](const ViewedObject& b) {
      return b.name == object.name && b.home == object.home;
    });
    if (same == before.end()) continue;
    object.position = same->position;
    before.erase(same);
  }
  return now;
}

// Emitters of the level, as they have been changed where they are not as the level had them `before`.
std::vector<ViewedEmitter> keptEmitters(const std::vector<ViewedEmitter>& shown,
                                        const std::vector<ViewedEmitter>& before, std::vector<ViewedEmitter> now) {
  for (ViewedEmitter& emitter : now) {
    const auto is = std::ranges::find(shown, emitter.name, &ViewedEmitter::name);
    const auto was = std::ranges::find(before, emitter.name, &ViewedEmitter::name);
    if (is == shown.end() || was == before.end()) continue;
    if (is->isDriven != was->isDriven || is->radiance != was->radiance) emitter = *is;
  }
  return now;
}

bool isSameFile(const std::string& a, const std::string& b) { return a == b || fullPath(a) == fullPath(b); }

std::string whatCameOf(const LevelFiles& files) {
  const std::string scene = "\"" + files.scene + "\" ";
  if (!files.hasBake()) return scene + "is lit without a bake";
  if (!files.bakeBy) return "\"" + files.bake + "\" loaded";
  const bool isDraft = optionsToJson(*files.bakeBy) == optionsToJson(presetOptions(Preset::draft));
  const std::string by =
      isDraft ? "at preset draft" : "with " + std::string(linkKindName(files.bakeBy->links.kind)) + " links";
  return scene + "baked " + by + ", in memory alone; relume bake writes a bake";
}

}  // namespace

Status Session::show(LevelPtr next) {
  const bool isSame = level && isSameFile(level->sceneFile, next->sceneFile);
  // The level of the command line has the state that this began with.
  const bool isFirst = !level && isSameFile(next->sceneFile, options_.scene);
  ViewState wanted = state;
  ViewerOptions options = options_;  // with `next`, once it is shown
  FileParts before, now;             // of the level that is shown, where it has changed
  pick_.reset();
  if (isSame) {
    before = {lightsOf(level->scene, options_.lights), emittersOf(level->scene, options_.driven)};
    now = {lightsOf(next->scene, options_.lights), emittersOf(next->scene, options_.driven)};
    editor.giveIds(now.lights);
    wanted.lights = followFile(state.lights, before.lights, now.lights);
    wanted.objects = keptObjects(state.objects, objectsOf(next->scene, next->movable()));
    wanted.emitters = keptEmitters(state.emitters, before.emitters, now.emitters);
  } else if (!isFirst) {
    // Names of the first level's cameras and lights say nothing of this one.
    options.camera.clear();
    options.lights = {"all"};
    options.lightsFile.clear();
    options.driven.clear();
    options.bake.clear();
    options.draft = next->isBaked;
    auto fresh = initialState(next->scene, options);
    if (!fresh) return fresh.error();
    wanted = std::move(*fresh);
    editor.giveIds(wanted.lights);
  }
  auto made = Viewer::create(*next, options_.shadowSize, wanted, getProcAddress_, isSame ? &*viewer : nullptr);
  if (!made) return made.error();
  options_ = std::move(options);
  viewer.emplace(std::move(*made));
  editor.keepSelectionWithin(wanted.lights);
  if (!isSame && !isFirst) {
    lightsFile = kLightsFile;
    ownLights_.clear();
  }
  level = std::move(next);
  watch_ = FileWatch(level->bakeFile, level->bakeStamp);
  state = std::move(wanted);
  if (!isSame) flySpeed.fit(viewer->levelSize());
  if (const auto warning = isSame ? std::nullopt : cameraWarning(level->scene, options_))
    say(Severity::warning, *warning);
  tellSwitchedOff(limitLightsOn(state.lights));
  objects.select({});
  if (isSame) {
    edits.replace(state, before, now);
  } else {
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
          isSameFile(scene, options_.scene) ? options_.driven : std::vector<DrivenMaterial>(),
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

void Session::begin(LevelFiles files, std::optional<Scene> scene) {
  draftNext_ = false;
  job.reset();
  job.emplace(std::move(files), std::move(scene));
}

void Session::drop(const std::vector<std::string>& paths) {
  std::string scene, bake;
  for (const std::string& path : paths) {
    std::string extension = std::filesystem::path(path).extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    if (extension == ".glb" || extension == ".gltf") {
      scene = path;
    } else if (extension == ".relume") {
      bake = path;
    } else if (extension == ".json") {
      loadLights(path);
    } else {
      say(Severity::error, "\"" + path +
                               "\": a level (.glb, .gltf), a bake of it or of the level that is shown (.relume) or a "
                               "list of lights (.json) expected");
    }
  }
  if (!bake.empty()) {
    if (scene.empty() && job && !job->isCancelled()) scene = job->files().scene;
    if (scene.empty() && level) scene = level->sceneFile;
    if (scene.empty()) return say(Severity::error, "\"" + bake + "\": no level is shown that it could be a bake of");
    return begin(filesOf(scene, bake));
  }
  if (scene.empty()) return;
  LevelFiles files = filesOf(scene, "");
  if (bakesAtOnce_) files.bakeBy = presetOptions(Preset::draft);
  begin(std::move(files));
  draftNext_ = !bakesAtOnce_;
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
  if (state.bounceScale != 1.0f) {
    return say(Severity::warning,
               "not compared: paths keep all that surfaces reflect; set \"of each\", the share of each bounce, to 1");
  }
  reference.reset();
  heat.reset();
  const float aspect = pixels_.size.x / pixels_.size.y;
  const auto height =
      static_cast<std::uint32_t>(std::clamp(static_cast<float>(ReferenceJob::kWidth) / aspect, 1.0f, 1024.0f));
  // Paths have direct and indirect light, whatever is shown of it.
  ViewState whole = state;
  whole.direct = whole.indirect = true;
  auto shown = viewer->irradiance(whole, ReferenceJob::kWidth, height);
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

}  // namespace relume
