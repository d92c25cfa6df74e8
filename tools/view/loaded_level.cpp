// SPDX-License-Identifier: MIT
// See loaded_level.h.
#include "tools/view/loaded_level.h"

#include "relume/bake/bake.h"
#include "relume/bake/load_scene.h"
#include "tools/compare/fit_bake.h"

#include <utility>

namespace relume {

Result<LevelPtr> loadBake(Scene scene, const LevelFiles& files, Context& context) {
  auto level = std::make_shared<LoadedLevel>();
  level->scene = std::move(scene);
  level->sceneFile = files.scene;
  level->bakeFile = files.bake;
  if (!files.bake.empty()) level->bakeStamp = stampOf(files.bake);
  auto baked = files.bake.empty() ? bake(level->scene, presetOptions(Preset::draft), context)
                                  : readBakeOf(level->scene, files.bake, files.scene, files.allowStale, context);
  if (!baked) return baked.error();
  level->bake = std::move(*baked);
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
