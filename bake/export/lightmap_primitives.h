// SPDX-License-Identifier: MIT
// glTF primitives with light-map coordinates: one an instance, for each instance has charts of its own.
#pragma once

#include "bake/export/level_document.h"
#include "relume/bake/scene.h"
#include "relume/caches.h"
#include "relume/result.h"

#include <cstdint>
#include <map>
#include <vector>

namespace relume {

// TEXCOORD_<front> has the light map's coordinates, TEXCOORD_<front + 1> those of back sides that are on it, too.
struct TexcoordSets {
  int front = 1;
  int back() const { return front + 1; }
};

// The first set that no primitive of the document has, nor the next, and at least 1: the same for all, so that one
// shader serves.
TexcoordSets chooseSets(const nlohmann::json& root);

// Name the sets in the extras of a mesh or of a primitive, unless its author has something else there.
void nameSets(nlohmann::json& element, TexcoordSets sets, bool back);

struct LightmapPrimitives {
  std::map<std::uint32_t, nlohmann::json> ofInstance;  // by the scene's instance; those on the light map
  std::uint64_t vertices = 0;                          // of them, before
  std::uint64_t added = 0;                             // copies where charts end
  bool backs = false;                                  // one of them has coordinates of back sides
};

// Make the primitives of all instances on the light map, and append their accessors to the document: coordinates for
// each, and where vertices were split, all attributes, morph targets and indices. Their extras name the sets. Draco's
// come out decoded. The scene must come from loadScene() of the same file, and the map from a bake of it. Errors of the
// importer; failed: the file is not that of the scene, or cancelled.
Result<LightmapPrimitives> makeLightmapPrimitives(LevelDocument& document, const Scene& scene, const Lightmap& map,
                                                  TexcoordSets sets, Context& context);

// Decode what Draco still has once the meshes are placed, on the map or not: a host without a decoder refuses the whole
// level for one such primitive. Errors of the importer; failed: cancelled.
Status decodeRest(LevelDocument& document, Context& context);

}  // namespace relume
