// SPDX-License-Identifier: MIT
// A level's scene with materials that emit what a state has them emit, for what is voxelised.
//
// Voxels have one factor for all that emits, which costs nothing to change. It does not scale driven emitters: where
// there is one, the materials emit what is shown, and what is made of the scene is to be made anew with a change of it.
#pragma once

#include "relume/bake/scene.h"
#include "tools/view/loaded_level.h"
#include "tools/view/view_state.h"

#include <glm/vec3.hpp>

#include <memory>
#include <utility>
#include <vector>

namespace relume {

class DrivenScene {
 public:
  // The level must outlive it.
  explicit DrivenScene(const LoadedLevel& level) : level_(&level) {}

  // The level's own at first.
  const Scene& scene() const { return driven_ ? *driven_ : level_->scene; }
  // Whether its materials, times factorOf(), emit what the state has.
  bool isOf(const ViewState& state);
  // Let them. [nobody reads scene()]
  void drive(const ViewState& state);
  // [nobody reads scene()]
  void reset() { driven_.reset(); }

  // On what they emit: the state's, or 1 where an emitter is driven.
  static float factorOf(const ViewState& state);

 private:
  // All of a state that emission depends on: of its emitters whether each is driven, and how.
  struct Key {
    float emission = 1.0f;
    std::vector<std::pair<bool, glm::vec3>> emitters;
    bool operator==(const Key&) const = default;
  };
  const std::vector<ShownEmission>& emissionsOf(const ViewState& state);

  const LoadedLevel* level_;
  std::unique_ptr<Scene> driven_;         // null = the level's own
  Key key_;                               // that emissions_ are of
  std::vector<ShownEmission> emissions_;  // [Size 0 = none yet, or materials]
};

}  // namespace relume
