// SPDX-License-Identifier: MIT
// glTF 2.0 to a Scene. Each step checks what it reads: nothing in the file is trusted.
#include "bake/import/find_solids.h"
#include "bake/import/gltf_import.h"
#include "bake/import/gltf_textures.h"
#include "bake/scene/check_limits.h"
#include "relume/bake/context.h"
#include "relume/bake/scene.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
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

// What to do about a material that blocks all light here, while an extension says that some goes through; null for
// others.
const char* remedyOfBlocking(const tinygltf::Material& source, const Material& material) {
  const auto isAbove0 = [&](const char* extension, const char* factor) {
    const tinygltf::Value* found = extensionOf(source, extension);
    return found && numberOr(*found, factor, 0.0) > 0.0;
  };
  const bool isGlass = isAbove0("KHR_materials_transmission", "transmissionFactor");
  if (!isGlass && !isAbove0("KHR_materials_diffuse_transmission", "diffuseTransmissionFactor")) return nullptr;
  if (material.alphaMode != AlphaMode::opaque &&
      (material.albedoTexture.image != kNone || material.alpha < material.alphaCutoff))
    return nullptr;
  return isGlass ? "leave what is glass out of the bake by extras.relume.bake \"ignore\""
                 : "mark what has to let light through, as a lampshade or a blind, extras.relume.bake: \"dynamic\"";
}

// The nodes whose instances are baked with one material.
struct NodesOfMaterial {
  const Instance* first = nullptr;
  std::uint32_t last = kNone;  // in the file's nodes
  std::size_t count = 0;
};

std::vector<NodesOfMaterial> bakedNodes(const Scene& scene) {
  std::vector<NodesOfMaterial> all(scene.materials.size());
  for (const Instance& instance : scene.instances) {
    const std::uint32_t material = scene.meshes[instance.mesh].material;
    if (!instance.baked() || material == kNone) continue;
    NodesOfMaterial& nodes = all[material];
    if (nodes.last == instance.nodeIndex) continue;  // a node's instances follow each other
    if (nodes.first == nullptr) nodes.first = &instance;
    nodes.last = instance.nodeIndex;
    ++nodes.count;
  }
  return all;
}

// A pane that darkens a room looks like a bake gone wrong: say of each such material where it is baked first, and on
// how many nodes besides.
void warnOfGlass(const GltfDocument& document, const Scene& scene, Context& context) {
  const std::vector<NodesOfMaterial> nodes = bakedNodes(scene);
  for (std::size_t m = 0; m < nodes.size(); ++m) {
    if (nodes[m].count == 0) continue;
    const char* remedy = remedyOfBlocking(document.model.materials[m], scene.materials[m]);
    if (!remedy) continue;
    const std::string others = nodes[m].count > 1 ? " and " + std::to_string(nodes[m].count - 1) + " more" : "";
    context.message(
        Severity::warning,
        document.at("material \"" + scene.materials[m].name + "\" on node \"" + nodes[m].first->node + "\"" + others +
                    " transmits light, which bakes do not know: it blocks all of it; " + remedy));
  }
}

// What a game draws as it is painted is lit here like any other surface.
void tellUnlit(const GltfDocument& document, const Scene& scene, Context& context) {
  std::set<std::uint32_t> unlit;
  for (const Instance& instance : scene.instances) {
    const std::uint32_t material = scene.meshes[instance.mesh].material;
    if (instance.baked() && material != kNone && extensionOf(document.model.materials[material], "KHR_materials_unlit"))
      unlit.insert(material);
  }
  if (unlit.empty()) return;
  context.message(
      Severity::info,
      document.at("materials of KHR_materials_unlit are read as lit surfaces of their base colour that emit "
                  "nothing: " +
                  std::to_string(unlit.size()) + ", the first \"" + scene.materials[*unlit.begin()].name +
                  "\"; give them emission where they light the level, or mark their nodes "
                  "extras.relume.bake: \"dynamic\" where they take no part in it"));
}

// glTF's default material is white and absorbs nothing: light in a closed room of it goes on for ever.
void warnOfWhite(const Scene& scene, Context& context) {
  constexpr double kMost = 0.5;         // of the surface
  constexpr std::uint32_t kAsked = 64;  // of an instance's triangles: there may be 100,000 instances
  const auto isBare = [&](const Instance& instance) {
    const Mesh& mesh = scene.meshes[instance.mesh];
    return mesh.material == kNone && mesh.color.empty();
  };
  const auto isBakedBare = [&](const Instance& instance) { return instance.baked() && isBare(instance); };
  if (std::none_of(scene.instances.begin(), scene.instances.end(), isBakedBare)) return;
  double all = 0.0, bare = 0.0;
  for (const Instance& instance : scene.instances) {
    if (!instance.baked()) continue;
    double area = 0.0;
    const auto triangles = static_cast<std::uint32_t>(scene.meshes[instance.mesh].triangle.size());
    const std::uint32_t step = std::max(triangles / kAsked, 1u);
    for (std::uint32_t t = 0; t < triangles; t += step) {
      const auto corner = scene.corners(instance, t);
      area += 0.5 * step * static_cast<double>(glm::length(glm::cross(corner[1] - corner[0], corner[2] - corner[0])));
    }
    all += area;
    if (isBare(instance)) bare += area;
  }
  if (!(bare > kMost * all)) return;
  context.message(Severity::warning, scene.name + ": " + std::to_string(std::lround(100.0 * bare / all)) +
                                         " % of the surface has no material, which glTF takes for white that absorbs "
                                         "nothing: closed rooms come out far too bright; give it one (0.8 is usual)");
}

// Of many static instances of one mesh with the same transform, bake only the first: it hides the others, which have
// the same light. They are kept as dynamic instances. Fewer copies than kPile cost little and are baked as they are.
void setAsidePiles(Scene& scene, Context& context) {
  constexpr std::size_t kPile = 8;
  using Pose = std::pair<std::uint32_t, std::array<std::uint32_t, 16>>;  // mesh, bits of the transform
  std::map<Pose, std::vector<std::uint32_t>> copies;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    if (!scene.instances[i].baked()) continue;
    Pose pose{scene.instances[i].mesh, {}};
    std::memcpy(pose.second.data(), &scene.instances[i].toWorld, sizeof pose.second);
    copies[pose].push_back(i);
  }
  for (const auto& [pose, members] : copies) {
    if (members.size() < kPile) continue;
    for (std::size_t m = 1; m < members.size(); ++m) scene.instances[members[m]].mode = BakeMode::dynamic;
    const Instance& first = scene.instances[members.front()];
    context.message(Severity::warning, "node \"" + first.node + "\": " + std::to_string(members.size()) +
                                           " copies of mesh \"" + scene.meshes[pose.first].name +
                                           "\" in one place; the first is baked, remove the others");
  }
}

// A hash of 16 hex digits; nothing when the text is something else.
std::optional<std::uint64_t> parseHash(const std::string& hex) {
  std::uint64_t number = 0;
  const auto read = std::from_chars(hex.data(), hex.data() + hex.size(), number, 16);
  const bool whole = hex.size() == 16 && read.ec == std::errc() && read.ptr == hex.data() + hex.size();
  return whole ? std::optional(number) : std::nullopt;
}

// What relume export wrote about the bake (export_level.h). A level from elsewhere has no such extras, or others.
void importIdentity(const GltfDocument& document, Scene& scene) {
  const tinygltf::Value* lightmap = &document.model.asset.extras;
  for (const char* name : {"relume", "lightmap"}) {
    if (!lightmap->IsObject() || !lightmap->Has(name)) return;
    lightmap = &lightmap->Get(name);
  }
  const auto hashIn = [](const tinygltf::Value& object, const std::string& key) -> std::optional<std::uint64_t> {
    if (!object.IsObject() || !object.Has(key) || !object.Get(key).IsString()) return std::nullopt;
    return parseHash(object.Get(key).Get<std::string>());
  };
  scene.exportedWith = hashIn(*lightmap, "bake");
  if (!scene.exportedWith || !lightmap->Has("surfaces")) return;
  const tinygltf::Value& surfaces = lightmap->Get("surfaces");
  for (const std::string& key : surfaces.Keys()) {
    const std::optional<std::uint64_t> geometry = parseHash(key), surface = hashIn(surfaces, key);
    if (geometry && surface) scene.exportedSurfaces.emplace(*geometry, *surface);
  }
}

Result<Scene> import(const std::filesystem::path& path, Context& context, const ImportOptions& options) {
  // 1. The document: container, JSON, buffers, compressed views
  Result<GltfDocument> document = loadGltfDocument(path, context);
  if (!document) return document.error();
  if (Status status = checkRanges(*document); !status) return status.error();
  Scene scene;
  scene.name = document->file;
  importIdentity(*document, scene);
  // 2. Materials and the images they use
  Result<std::vector<UvSets>> uvSets = importMaterials(*document, scene, context);
  if (!uvSets) return uvSets.error();
  if (options.gloss) {
    if (Status status = importGloss(*document, *uvSets, scene, context); !status) return status.error();
  }
  // 3. The node graph, with the meshes that it uses
  MeshImporter meshes(*document, std::move(*uvSets), scene, context);
  if (Status status = importNodes(*document, meshes, scene, context); !status) return status.error();
  // 4. The lights' unit
  if (Status status = convertLights(*document, options.lightUnit, scene, context); !status) return status.error();
  // 5. Numbers that the baker can compute with
  if (Status status = checkLimits(scene); !status) return status.error();
  // 6. Copies that nobody sees, panes that nobody sees through, walls that absorb nothing
  setAsidePiles(scene, context);
  warnOfGlass(*document, scene, context);
  tellUnlit(*document, scene, context);
  warnOfWhite(scene, context);
  scene.files = std::move(document->files);
  // 7. Which two-sided surfaces enclose matter
  findSolids(scene, context);
  return scene;
}

}  // namespace

Result<Scene> importGltf(const std::filesystem::path& path, Context& context, const ImportOptions& options) {
  const Context::Stage stage(context, "import");
  if (!context.progress("import", 0.0)) return cancelledError();
  try {
    Result<Scene> scene = import(path, context, options);
    if (scene) {
      context.figure("triangles", scene->triangleCount());
      context.figure("instances", static_cast<double>(scene->instances.size()));
      context.progress("import", 1.0);
    }
    return scene;
  } catch (const std::bad_alloc&) {
    return Error{ErrorCode::failed, path.filename().string() + ": out of memory"};
  } catch (const std::exception& e) {
    return Error{ErrorCode::invalidFile, path.filename().string() + ": " + e.what()};
  }
}

}  // namespace relume
