// SPDX-License-Identifier: MIT
// See staleness.h.
#include "tools/compare/staleness.h"

#include "bake/rays/ray_tracer_name.h"
#include "bake/scene/surface_hash.h"
#include "relume/bake/provenance.h"

#include <algorithm>
#include <map>
#include <optional>

namespace relume {
namespace {

// Whether more than half of either level's parts are not in the other by their names.
bool isAnotherLevel(const std::vector<PartChange>& changes, std::size_t before, std::size_t now) {
  const auto count = [&](PartChange::Kind kind) {
    return static_cast<std::size_t>(
        std::count_if(changes.begin(), changes.end(), [&](const PartChange& c) { return c.kind == kind; }));
  };
  const std::size_t renamed = count(PartChange::Kind::renamed);
  return 2 * (count(PartChange::Kind::removed) + renamed) > before ||
         2 * (count(PartChange::Kind::added) + renamed) > now;
}

std::string anotherLevel(std::span<const BakedInstance> before, std::span<const BakedInstance> now) {
  const auto first = [](std::span<const BakedInstance> parts) {
    return parts.empty() ? std::string() : " (\"" + parts[0].node + "\", ...)";
  };
  return "this is another level: " + std::to_string(before.size()) + " parts" + first(before) +
         " were baked, the scene has " + std::to_string(now.size()) + first(now);
}

// "option links.linksPerCache was 64, is 254"
void compareOptions(const BakeOptions& options, const Provenance& provenance, std::vector<std::string>& others) {
  if (provenance.optionsJson == optionsToJson(options)) return;
  const std::size_t found = others.size();
  const Result<BakeOptions> before = optionsFromJson(provenance.optionsJson, BakeOptions{});
  if (before) {
    std::map<std::string, std::string> values;
    for (const OptionInfo& info : listOptions(*before)) values[info.name] = info.value;
    for (const OptionInfo& info : listOptions(options)) {
      if (values[info.name] != info.value)
        others.emplace_back("option " + info.name + " was " + values[info.name] + ", is " + info.value);
    }
  }
  if (others.size() == found) others.emplace_back("the options of this version are others than the bake's");
}

// At most three changes in words; a level that has little in common with the baked one is called another level.
std::string summary(const std::vector<PartChange>& changes, const Bake& bake, std::span<const BakedInstance> now) {
  if (isAnotherLevel(changes, bake.instances.size(), now.size())) return anotherLevel(bake.instances, now);
  if (changes.empty()) return "its parts come in another order";
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(changes.size(), 3); ++i)
    text += (i > 0 ? ", " : "") + toString(changes[i]);
  if (changes.size() > 3) text += ", and " + std::to_string(changes.size() - 3) + " more changes";
  return text;
}

// Rays are traced by the bake's own options unless others are given, which are compared as options.
void compareRayTracer(const BakeOptions* options, const Provenance& then, std::vector<std::string>& others) {
  const Result<BakeOptions> before = optionsFromJson(then.optionsJson, BakeOptions{});
  if (!before || (options != nullptr && options->embreeIsa != before->embreeIsa)) return;
  const std::string now = rayTracerName(before->embreeIsa);
  if (now != then.rayTracer)
    others.emplace_back("the ray tracer was " + then.rayTracer + ", is " +
                        (now.empty() ? "none that starts here" : now));
}

// The scene's parts, where a geometry differs from the baked one by noise alone with the baked one's hash.
std::vector<BakedInstance> describeAsBaked(const Scene& scene, const Bake& bake) {
  std::vector<BakedInstance> now = describeInstances(scene);
  const std::vector<PartKey> keysNow = partKeys(now), keysBaked = partKeys(bake.instances);
  std::map<PartKey, std::uint32_t> baked;
  for (std::uint32_t i = 0; i < keysBaked.size(); ++i) baked.emplace(keysBaked[i], i);
  std::vector<std::uint32_t> answers;
  for (const PartKey& key : keysNow) {
    const auto found = baked.find(key);
    answers.push_back(found == baked.end() ? kNone : found->second);
  }
  return forgiveNoise(scene, std::move(now), bake, answers);
}

}  // namespace

std::vector<std::string> Staleness::sentences() const {
  std::vector<std::string> all;
  for (const PartChange& change : parts) all.push_back(toString(change));
  all.insert(all.end(), others.begin(), others.end());
  return all;
}

Staleness findStaleness(const Scene& scene, const BakeOptions* options, const Bake& bake) {
  const Provenance& then = bake.provenance;
  Staleness stale;
  const std::vector<BakedInstance> now = describeAsBaked(scene, bake);
  if (then.sceneHash != hashScene(scene, now)) {
    stale.parts = compareParts(bake.instances, now);
    if (isAnotherLevel(stale.parts, bake.instances.size(), now.size())) {
      stale.others.emplace_back(anotherLevel(bake.instances, now));
      stale.parts.clear();
    }
    if (then.viewHash != hashViews(scene)) stale.others.emplace_back("cameras or play volumes changed");
    if (stale.upToDate())
      stale.others.emplace_back("the order of the scene's parts changed, or which of them share a mesh");
  }
  if (then.viewHash == hashViews(scene) && then.cameraHash != hashCameras(scene))
    stale.notes.emplace_back("cameras changed; light did not need a rebake");
  if (then.algorithmVersion != kAlgorithmVersion)
    stale.others.emplace_back("algorithm version was " + std::to_string(then.algorithmVersion) + ", is " +
                              std::to_string(kAlgorithmVersion));
  compareRayTracer(options, then, stale.others);
  if (options != nullptr) compareOptions(*options, then, stale.others);
  return stale;
}

Staleness findExportStaleness(const Scene& scene, const Bake& bake, std::uint64_t bakeFileHash) {
  Staleness stale;
  if (scene.exportedWith != bakeFileHash) {
    stale.others.emplace_back("relume export made this level with another bake; export it again from its source");
    return stale;
  }
  // Export keeps the order of the parts, and all triangles with their corners' positions and normals.
  const std::vector<BakedInstance> now = describeInstances(scene);
  const Array<LightmapPart>& placed = bake.caches.lightmap.parts;
  std::vector<std::optional<std::uint64_t>> hashNow(scene.meshes.size());
  if (now.size() != bake.instances.size()) {
    stale.others.emplace_back("the exported level had " + std::to_string(bake.instances.size()) + " parts, has " +
                              std::to_string(now.size()));
  }
  for (std::size_t i = 0; i < now.size() && stale.others.empty(); ++i) {
    const BakedInstance& then = bake.instances[i];
    const auto changed = [&](PartChange::Kind kind) {
      stale.parts.push_back({kind, now[i].node, now[i].mesh, then.material, now[i].material});
    };
    // What was a GPU instance is a node of another name, whose transform went through rotation and scale.
    if (then.node == now[i].node && then.transformHash != now[i].transformHash) changed(PartChange::Kind::moved);
    if (then.materialHash != now[i].materialHash) changed(PartChange::Kind::rematerialled);
    const std::uint32_t mesh = scene.instances[i].mesh;
    const auto surface = scene.exportedSurfaces.find(then.geometryHash);
    if (surface != scene.exportedSurfaces.end() && !hashNow[mesh]) hashNow[mesh] = hashSurface(scene.meshes[mesh]);
    const bool recounted = i < placed.size() && placed[i].triangleCount > 0 &&
                           placed[i].triangleCount != scene.meshes[mesh].triangle.size();
    if (recounted || (surface != scene.exportedSurfaces.end() && surface->second != *hashNow[mesh]))
      changed(PartChange::Kind::reshaped);
  }
  if (!stale.upToDate())
    stale.others.emplace_back("an exported level was changed; change its source, bake and export it");
  stale.notes.emplace_back(
      "relume export made this level with this bake; only its source tells whether a rebake is due");
  if (scene.exportedSurfaces.empty() && !bake.instances.empty())
    stale.notes.emplace_back("an older relume export made this level; whether vertices moved since cannot be told");
  return stale;
}

std::optional<SceneMismatch> findMismatch(const Scene& scene, const Bake& bake, const std::string& bakeFile,
                                          const std::string& sceneFile) {
  const std::vector<BakedInstance> now = describeAsBaked(scene, bake);
  const auto same = [](const BakedInstance& x, const BakedInstance& y) {
    return x.node == y.node && x.mesh == y.mesh && x.contentHash == y.contentHash;
  };
  if (std::equal(now.begin(), now.end(), bake.instances.begin(), bake.instances.end(), same)) return std::nullopt;
  if (scene.exportedWith) {
    return SceneMismatch{"\"" + sceneFile +
                             "\" is a level of relume export, whose vertices are others than those that \"" + bakeFile +
                             "\" was baked from",
                         "give the level that it was exported from"};
  }
  return SceneMismatch{"\"" + bakeFile + "\" was not baked from \"" + sceneFile +
                           "\": " + summary(compareParts(bake.instances, now), bake, now),
                       "bake again"};
}

Status checkSameScene(const Scene& scene, const Bake& bake, const std::string& bakeFile, const std::string& sceneFile) {
  const std::optional<SceneMismatch> found = findMismatch(scene, bake, bakeFile, sceneFile);
  if (!found) return done();
  return Error{ErrorCode::invalidFile, found->reason + "; " + found->advice + ", or give --allow-stale"};
}

std::uint32_t fitToScene(const Scene& scene, Bake& bake) {
  Lightmap& map = bake.caches.lightmap;
  std::map<PartKey, std::size_t> baked;
  const std::vector<PartKey> before = partKeys(bake.instances);
  for (std::size_t i = 0; i < std::min(before.size(), map.parts.size()); ++i) baked.emplace(before[i], i);

  std::vector<BakedInstance> instances = describeInstances(scene);
  for (BakedInstance& instance : instances) instance.firstShape = instance.shapeCount = 0;
  const std::vector<PartKey> now = partKeys(instances);
  std::vector<LightmapPart> parts(now.size() + before.size());
  std::uint32_t matched = 0;
  for (std::size_t i = 0; i < now.size(); ++i) {
    const auto found = baked.find(now[i]);
    const std::size_t triangles = scene.meshes[scene.instances[i].mesh].triangle.size();
    if (found == baked.end() || map.parts[found->second].triangleCount != triangles) continue;
    parts[i] = map.parts[found->second];
    ++matched;
  }
  instances.insert(instances.end(), bake.instances.begin(), bake.instances.end());
  std::vector<std::uint32_t> surfels = bake.surfels.instance.toVector();
  for (std::uint32_t& instance : surfels) instance += static_cast<std::uint32_t>(now.size());
  map.parts = parts;
  bake.surfels.instance = surfels;
  bake.instances = std::move(instances);
  bake.certificate = {};  // of the level that it was baked from
  return matched;
}

}  // namespace relume
