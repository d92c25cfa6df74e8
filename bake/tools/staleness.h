// SPDX-License-Identifier: MIT
// Whether a bake still is what its scene and options would give, and what changed if not. For `relume status` and for
// `relume bake`, which does nothing when nothing changed.
#pragma once

#include "bake/options.h"
#include "bake/scene/scene.h"
#include "bake/tools/compare_scene.h"
#include "formats/bake.h"

#include <string>
#include <vector>

namespace relume {

struct Staleness {
  std::vector<PartChange> parts;    // of the scene, by name
  std::vector<std::string> others;  // options, versions, cameras: one sentence each
  bool upToDate() const { return parts.empty() && others.empty(); }
  std::vector<std::string> sentences() const;
};

// `options` null: the bake's own are taken as meant. The scene must come from loadScene(). Lights and the version
// number of the tool do not count: neither changes light's transport (kAlgorithmVersion does).
Staleness findStaleness(const Scene& scene, const BakeOptions* options, const Bake& bake);

}  // namespace relume
