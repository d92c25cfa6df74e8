// SPDX-License-Identifier: MIT
// See export_level.h.
#include "bake/export/export_level.h"

#include "bake/export/lightmap_primitives.h"
#include "bake/export/place_meshes.h"
#include "bake/export/prune.h"
#include "bake/scene/surface_hash.h"
#include "formats/decimal.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <exception>
#include <map>
#include <new>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

using nlohmann::json;

const json::json_pointer kIdentity("/extras/relume/lightmap");

// Room for what is said of the bake; an author's extras stay.
Status checkAsset(const LevelDocument& document) {
  const json& asset = document.root.at("asset");
  const GltfDocument& source = document.source();
  if (asset.contains(kIdentity))
    return Error{ErrorCode::usage, source.at("has light-map coordinates of relume export already; export the level "
                                             "that it was made from")};
  for (const char* path : {"/extras", "/extras/relume"}) {
    const json::json_pointer pointer(path);
    if (asset.contains(pointer) && !asset[pointer].is_object())
      return Error{ErrorCode::unsupported, source.at(std::string("asset") + path +
                                                     " is no object, so that the bake cannot be named in it; make it "
                                                     "one")};
  }
  return done();
}

// The hash of each baked surface as it is exported, by the bake's hash of its geometry.
json describeSurfaces(const Scene& scene, const Bake& bake) {
  std::vector<std::optional<std::uint64_t>> hashOfMesh(scene.meshes.size());
  std::map<std::string, std::string> surfaces;
  std::set<std::string> ambiguous;  // one geometry when they were baked, and since then two that differ by noise
  for (std::size_t i = 0; i < std::min(scene.instances.size(), bake.instances.size()); ++i) {
    const std::uint32_t mesh = scene.instances[i].mesh;
    if (!hashOfMesh[mesh]) hashOfMesh[mesh] = hashSurface(scene.meshes[mesh]);
    const std::string surface = hexadecimal(*hashOfMesh[mesh]);
    const auto [known, fresh] = surfaces.emplace(hexadecimal(bake.instances[i].geometryHash), surface);
    if (!fresh && known->second != surface) ambiguous.insert(known->first);
  }
  for (const std::string& geometry : ambiguous) surfaces.erase(geometry);
  return surfaces;
}

void writeIdentity(json& asset, const Scene& scene, const Bake& bake, std::uint64_t bakeFileHash,
                   const ExportedLevel& level) {
  json lightmap = {{"bake", hexadecimal(bakeFileHash)},   {"sceneHash", hexadecimal(bake.provenance.sceneHash)},
                   {"width", bake.caches.lightmap.width}, {"height", bake.caches.lightmap.height},
                   {"texcoord", level.texcoord},          {"surfaces", describeSurfaces(scene, bake)}};
  if (level.backTexcoord >= 0) lightmap["backTexcoord"] = level.backTexcoord;
  asset["extras"]["relume"]["lightmap"] = std::move(lightmap);
}

Result<ExportedLevel> makeLevel(const std::filesystem::path& path, const Scene& scene, const Bake& bake,
                                std::uint64_t bakeFileHash, Context& context) {
  // 1. The document
  Result<LevelDocument> document = LevelDocument::read(path, context);
  if (!document) return document.error();
  ExportedLevel out;
  out.document = std::move(*document);
  json& root = out.document.root;
  if (const Status status = checkAsset(out.document); !status) return status.error();
  // 2. Primitives
  const TexcoordSets sets = chooseSets(root);
  const Result<LightmapPrimitives> primitives =
      makeLightmapPrimitives(out.document, scene, bake.caches.lightmap, sets, context);
  if (!primitives) return primitives.error();
  if (primitives->ofInstance.empty())
    context.message(Severity::warning, out.document.source().at("nothing of it is on the bake's light map, so that it "
                                                                "gets no coordinates; all of it reads the grid"));
  // 3. Meshes and nodes
  const Result<PlacedMeshes> placed = placeMeshes(out.document, scene, *primitives, sets);
  if (!placed) return placed.error();
  if (const Status status = decodeRest(out.document, context); !status) return status.error();
  forgetExtension(root, kDracoExtension);
  // 4. Bytes that only the replaced primitives had
  out.bytesPruned = pruneDocument(out.document);
  // 5. Identity
  out.texcoord = sets.front;
  if (primitives->backs) out.backTexcoord = sets.back();
  out.vertices = primitives->vertices;
  out.verticesAdded = primitives->added;
  out.instances = static_cast<std::uint32_t>(primitives->ofInstance.size());
  out.meshesAdded = placed->meshesAdded;
  out.nodesAdded = placed->nodesAdded;
  writeIdentity(root["asset"], scene, bake, bakeFileHash, out);
  return out;
}

}  // namespace

Result<ExportedLevel> exportLevel(const std::filesystem::path& path, const Scene& scene, const Bake& bake,
                                  std::uint64_t bakeFileHash, Context& context) {
  const Context::Stage stage(context, "export");
  try {
    Result<ExportedLevel> level = makeLevel(path, scene, bake, bakeFileHash, context);
    if (level && !context.progress("export", 1.0)) return cancelledError();
    return level;
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::failed, path.filename().string() + ": out of memory"};
  } catch (const std::exception& e) {
    return Error{ErrorCode::invalidFile, path.filename().string() + ": " + e.what()};
  }
}

Status checkExportable(const std::filesystem::path& path) {
  try {
    Context silent;
    const Result<LevelDocument> document = LevelDocument::read(path, silent);
    return document ? checkAsset(*document) : document.error();
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::failed, path.filename().string() + ": out of memory"};
  } catch (const std::exception& e) {
    return Error{ErrorCode::invalidFile, path.filename().string() + ": " + e.what()};
  }
}

}  // namespace relume
