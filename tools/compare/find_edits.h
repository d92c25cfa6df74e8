// SPDX-License-Identifier: MIT
// What was edited in a level: its parts held against those of the level as it was baked.
#pragma once

#include "relume/bake/scene.h"
#include "tools/compare/compare_scene.h"
#include "tools/render/edited_light.h"

#include <vector>

namespace relume {

struct FoundEdits {
  bool none() const { return level.bounds.empty(); }

  EditedLevel level;
  std::vector<PartChange> changes;  // in words: toString()
};

// Parts answer to each other by partKeys(); of what moves (BakeMode::dynamic) nothing counts as an edit. Both scenes
// come from loadScene().
FoundEdits findEdits(const Scene& before, const Scene& now);

}  // namespace relume
