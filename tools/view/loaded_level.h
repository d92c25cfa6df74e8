// SPDX-License-Identifier: MIT
// A level as the viewer shows it: with a bake from a file or made here, or without one.
#pragma once

#include "relume/bake/context.h"
#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/result.h"
#include "tools/base/scene_options.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/render/drive_scene.h"
#include "tools/view/file_watch.h"
#include "tools/view/view_state.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace relume {

struct LoadedLevel {
  Scene scene;
  std::vector<Material> materials;  // of the scene, as they were before any was driven
  Bake bake;
  bool isBaked = true;       // else there is nothing in `bake`, and the level is lit by LiveJob
  bool isBakedHere = false;  // in memory, whatever the file has that is watched
  bool hasGloss = false;     // whether the scene has what its materials mirror: --gloss
  std::string sceneFile;
  std::string bakeFile;  // that is watched; empty: none
  FileStamp bakeStamp;   // of the file, from before it was read

  bool isEditable = false;  // --edit: static objects of a baked level can be moved

  // What can be moved.
  Movable movable() const { return isBaked && !isEditable ? Movable::dynamic : Movable::all; }
};
using LevelPtr = std::shared_ptr<const LoadedLevel>;

// The window's title, "level.glb, level.relume - Relume": what is shown, and what lights it.
std::string titleOf(const LoadedLevel& level);

// What a material of the scene emits, as a state has it.
struct ShownEmission {
  glm::vec3 radiance{0.0f};  // [W/m²/sr] times the texture, or evenly
  TextureRef texture;
};
ShownEmission shownEmission(const LoadedLevel& level, const ViewState& state, std::uint32_t material);

// A file by its one name, however it is spelled: absolute, links followed. It need not be there.
std::filesystem::path fullPath(const std::string& path);

// Where a level comes from.
struct LevelFiles {
  std::string scene;
  std::string bake;  // empty: none, or one made here
  SceneOptions sceneOptions;
  bool allowStale = false;               // take a bake of another state of the scene
  std::vector<DrivenMaterial> driven{};  // what its materials emit instead, once the bake is known to be of the level
  std::optional<BakeOptions> bakeBy{};   // bake it here, in memory, in place of what is in `bake`
  bool isEditable = false;               // LoadedLevel::isEditable
  bool hasBake() const { return bakeBy || !bake.empty(); }
};

// Errors of loadScene(), readBakeOf(), bake() and driveScene(); failed: no triangle to draw, or cancelled.
Result<LevelPtr> loadLevel(const LevelFiles& files, Context& context);
// The second half of it.
Result<LevelPtr> loadBake(Scene scene, const LevelFiles& files, Context& context);

}  // namespace relume
