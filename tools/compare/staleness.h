// SPDX-License-Identifier: MIT
// Whether a bake still is what its scene and options would give, and what changed if not. For `relume status` and for
// `relume bake`, which does nothing when nothing changed.
#pragma once

#include "relume/bake/options.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/result.h"
#include "tools/compare/compare_scene.h"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace relume {

struct Staleness {
  std::vector<PartChange> parts;    // of the scene, by name; empty when it is another level, which is one of the others
  std::vector<std::string> others;  // options, versions, cameras: one sentence each
  std::vector<std::string> notes;   // what changed and makes no difference to light
  bool upToDate() const { return parts.empty() && others.empty(); }
  std::vector<std::string> sentences() const;
};

// `options` null: the bake's own are taken as meant. The scene must come from loadScene(). Lights and the version
// number of the tool do not count: neither changes light's transport (kAlgorithmVersion does).
Staleness findStaleness(const Scene& scene, const BakeOptions* options, const Bake& bake);

// The same of a level that relume export made (Scene::exportedWith), of which vertices were split and meshes copied: it
// is up to date with the bake it was exported with, while its parts stand where they stood with the materials they had,
// and their triangles' corners have the positions and normals that they were exported with (Scene::exportedSurfaces).
// `bakeFileHash` is identifyBakeFile()'s.
Staleness findExportStaleness(const Scene& scene, const Bake& bake, std::uint64_t bakeFileHash);

// Why a scene is not the one that a bake is of, naming both files; and what to do about it.
struct SceneMismatch {
  std::string reason, advice;
};

// For commands that draw or compare a bake over its scene, which must come from loadScene(). Nothing when the parts are
// those that were baked, in their order.
std::optional<SceneMismatch> findMismatch(const Scene& scene, const Bake& bake, const std::string& bakeFile,
                                          const std::string& sceneFile);

// invalidFile: findMismatch() finds one; the message has its reason, its advice, and --allow-stale.
Status checkSameScene(const Scene& scene, const Bake& bake, const std::string& bakeFile, const std::string& sceneFile);

// For --allow-stale: let the scene's instance i find its coordinates on the light map in Lightmap::parts[i] again, by
// partKeys(). Instances that the bake does not know, and those with another number of triangles, have none there then
// and read the grid. Bake::instances holds the scene's instances first, then those that were baked, which surfels
// index. Returns how many instances found theirs.
std::uint32_t fitToScene(const Scene& scene, Bake& bake);

}  // namespace relume
