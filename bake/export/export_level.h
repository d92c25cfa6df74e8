// SPDX-License-Identifier: MIT
// The level for the game: the glTF it was baked from with the light map's coordinates as further TEXCOORD sets, and
// everything else as it was. docs/EXPORT.md says what a game reads.
//
//   1. the document       JSON as it stands, buffers and images embedded
//   2. primitives         coordinates for each instance, vertices split where charts end
//   3. meshes and nodes   a mesh for each instance that needs its own, a node for each GPU instance
//   4. pruning            bytes that only the replaced primitives referred to
//   5. identity           which bake the coordinates belong to, and hashes of the surfaces as they are now:
//                         asset.extras.relume.lightmap
#pragma once

#include "bake/export/level_document.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"
#include "relume/bake_data.h"
#include "relume/result.h"

#include <cstdint>
#include <filesystem>
#include <vector>

namespace relume {

struct ExportedLevel {
  LevelDocument document;           // write() makes the .glb
  int texcoord = 0;                 // the light map's coordinates are TEXCOORD_<texcoord>
  int backTexcoord = -1;            // those of back sides; -1 = no back side is on the map
  std::uint64_t vertices = 0;       // of primitives on the light map, before
  std::uint64_t verticesAdded = 0;  // copies where charts end
  std::uint32_t instances = 0;      // on the light map
  std::uint32_t meshesAdded = 0, nodesAdded = 0;
  std::uint64_t bytesPruned = 0;  // of the source's buffers, which nothing refers to any more
};

// `scene` must come from loadScene(path), and `bake` be one of that scene as it is (checkSameScene()); bakeFileHash is
// identifyBakeFile()'s. Without a light map in the bake, or with nothing on it, the level comes out as it is, with a
// warning. Errors of importGltf(); usage: the level came out of here before; failed: the level changed since the scene
// was loaded, or cancelled. Any thread.
Result<ExportedLevel> exportLevel(const std::filesystem::path& path, const Scene& scene, const Bake& bake,
                                  std::uint64_t bakeFileHash, Context& context);

// What exportLevel() would refuse of the file alone, for commands that bake first.
Status checkExportable(const std::filesystem::path& path);

}  // namespace relume
