// SPDX-License-Identifier: MIT
// See loaded_level.h.
#include "tools/view/loaded_level.h"

#include "bake/rays/far_level.h"
#include "bake/scene/check_triangles.h"
#include "relume/bake/bake.h"
#include "relume/bake/load_scene.h"
#include "tools/base/printable.h"
#include "tools/compare/fit_bake.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

namespace relume {

std::string titleOf(const LoadedLevel& level) {
  const auto nameOf = [](const std::string& path) {
    return printable(std::filesystem::path(path).filename().string());
  };
  const std::string light = !level.isBaked      ? "without a bake"
                            : level.isBakedHere ? "baked in memory"
                                                : nameOf(level.bakeFile);
  return nameOf(level.sceneFile) + ", " + light + " - Relume";
}

std::filesystem::path fullPath(const std::string& path) {
  std::error_code failed;
  const std::filesystem::path full = std::filesystem::weakly_canonical(std::filesystem::absolute(path, failed), failed);
  return failed ? std::filesystem::path(path) : full;
}

ShownEmission shownEmission(const LoadedLevel& level, const ViewState& state, std::uint32_t material) {
  const Material &baked = level.materials[material], &driven = level.scene.materials[material];
  const auto emitter = std::find_if(state.emitters.begin(), state.emitters.end(),
                                    [&](const ViewedEmitter& e) { return e.isDriven && e.name == baked.name; });
  if (emitter == state.emitters.end()) return {state.emission * baked.emission, baked.emissionTexture};
  // Voxels have one factor for all that emits.
  const float factor = level.isBaked ? 1.0f : state.emission;
  if (emitter->image.empty()) return {factor * emitter->radiance, {}};
  return {factor * emitter->radiance * driven.emission, driven.emissionTexture};
}

Result<LevelPtr> loadBake(Scene scene, const LevelFiles& files, Context& context) {
  if (Status ok = checkDrawnTriangles(scene); !ok) return ok.error();
  if (!files.bakeBy) warnOfFarLevel(scene, context);  // else bake() does
  auto level = std::make_shared<LoadedLevel>();
  level->scene = std::move(scene);
  level->sceneFile = files.scene;
  level->bakeFile = files.bake;
  level->hasGloss = files.sceneOptions.gloss;
  if (!files.bake.empty()) level->bakeStamp = stampOf(files.bake);
  level->isBaked = files.hasBake();
  level->isBakedHere = files.bakeBy.has_value();
  level->isEditable = files.isEditable;
  if (level->isBaked) {
    auto baked = files.bakeBy ? bake(level->scene, *files.bakeBy, context)
                              : readBakeOf(level->scene, files.bake, files.scene, files.allowStale, context);
    if (!baked) return baked.error();
    level->bake = std::move(*baked);
  }
  level->materials = level->scene.materials;
  if (Status ok = driveScene(level->scene, files.driven, true); !ok) return ok.error();
  return LevelPtr(std::move(level));
}

Result<LevelPtr> loadLevel(const LevelFiles& files, Context& context) {
  auto scene = loadScene(files.scene, context, toImportOptions(files.sceneOptions));
  if (!scene) return scene.error();
  return loadBake(std::move(*scene), files, context);
}

}  // namespace relume
