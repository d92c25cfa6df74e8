// SPDX-License-Identifier: MIT
// See entry_names.h.
#include "bake/shards/entry_names.h"

#include "bake/base/byte_stream.h"
#include "bake/rays/ray_tracer_name.h"
#include "formats/chunks.h"
#include "relume/bake/provenance.h"

#include <algorithm>
#include <unordered_map>
#include <utility>
#include <vector>

namespace relume {
namespace {

// Processors of different makers may differ in where a ray at an edge ends (docs/notes/determinism.md).
const char* processorMaker() {
#if defined(__x86_64__) && defined(__GNUC__)
  __builtin_cpu_init();
  if (__builtin_cpu_is("amd")) return "amd";
  if (__builtin_cpu_is("intel")) return "intel";
#endif
  return "other";
}

// The options without those that only links, and the bands a file recommends, depend on.
BakeOptions withoutLinks(BakeOptions options) {
  options.budget = {};  // its sizes are chosen
  const LinkOptions links = std::exchange(options.links, LinkOptions{});
  options.links.raysPerCache = links.raysPerCache;  // the test rays are a share of them
  options.links.skyPatches = links.skyPatches;      // the hierarchy has their leaves
  options.lumaBands = BakeOptions{}.lumaBands;
  options.chromaBands = BakeOptions{}.chromaBands;
  return options;
}

// What rays meet. A material counts only where it lets some of them through: what it emits, the surfels say.
void addShapes(const Scene& scene, const std::vector<BakedInstance>& described, ByteWriter& inputs) {
  std::unordered_map<std::uint32_t, std::uint32_t> firstOfMesh;  // those that share a mesh may be traced in another way
  inputs.value(static_cast<std::uint64_t>(scene.instances.size()));
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    const Instance& instance = scene.instances[i];
    const Material& material = scene.material(instance);
    const bool hasHoles = material.alphaMode != AlphaMode::opaque;
    inputs.value(described[i].transformHash);
    inputs.value(described[i].geometryHash);
    inputs.value(instance.mode);
    inputs.value(static_cast<std::uint8_t>(instance.flipped));
    inputs.value(static_cast<std::uint8_t>(material.doubleSided));
    inputs.value(hasHoles ? described[i].materialHash : std::uint64_t{0});
    inputs.value(firstOfMesh.try_emplace(instance.mesh, i).first->second);
  }
  inputs.array(std::span<const std::uint8_t>(scene.solid));
}

// What decides how rays are traced: the seed, the instruction set, and numbers of rays, which choose the structure.
void addRayOptions(const BakeOptions& from, ByteWriter& inputs) {
  BakeOptions options;
  options.caches.lightmapCaches = from.caches.lightmapCaches;
  options.caches.gridCaches = from.caches.gridCaches;
  options.links.raysPerCache = from.links.raysPerCache;
  options.seed = from.seed;
  options.embreeIsa = from.embreeIsa;
  inputs.text(optionsToJson(options));
}

}  // namespace

EntryNames::EntryNames(const Scene& scene, const BakeOptions& options)
    : scene_(scene), options_(options), instances_(describeInstances(scene)) {
  const Provenance p = describeProvenance(Scene{}, {}, options, rayTracerName(options.embreeIsa));
  program_ = std::string("processor ") + processorMaker() + "\ntool " + p.toolVersion + "\nalgorithm " +
             std::to_string(p.algorithmVersion) + "\nfiles " + std::to_string(kPlanFileType.version) + " " +
             std::to_string(kShardFileType.version) + " " + std::to_string(kBakeFormatVersion) + "\ntracer " +
             p.rayTracer;
}

EntryName EntryNames::space() const {
  ByteWriter inputs;
  inputs.text("space");
  inputs.text(program_);
  addShapes(scene_, instances_, inputs);
  addRayOptions(options_, inputs);
  inputs.value(hashViews(scene_));
  BakeOptions options;
  options.playSpace = options_.playSpace;
  inputs.text(optionsToJson(options));
  return nameEntry(inputs.bytes());
}

EntryName EntryNames::caches() const {
  ByteWriter inputs;
  inputs.text("caches");
  const EntryName from = space();
  inputs.value(from.high);
  inputs.value(from.low);
  // What their warnings say, and what decides where they are.
  for (const Instance& instance : scene_.instances) {
    inputs.text(instance.node);
    inputs.value(instance.primitive);
    inputs.value(instance.gpuInstance);
    inputs.value(instance.texelDensity);
  }
  BakeOptions options;
  options.caches = options_.caches;
  inputs.text(optionsToJson(options));
  return nameEntry(inputs.bytes());
}

EntryName EntryNames::plan() const {
  ByteWriter inputs;
  inputs.text("plan");
  inputs.text(program_);
  inputs.value(hashScene(scene_, instances_));
  inputs.text(optionsToJson(withoutLinks(options_)));
  return nameEntry(inputs.bytes());
}

EntryName EntryNames::threshold(const BakePlan& plan) const {
  const Bake& bake = plan.bake;
  ByteWriter inputs;
  inputs.text("links");
  inputs.text(program_);
  addShapes(scene_, instances_, inputs);
  addRayOptions(options_, inputs);
  BakeOptions options;
  options.links = plan.chosen.links;
  inputs.text(optionsToJson(options));

  inputs.value(bake.surfels.areaEach);
  inputs.array(bake.surfels.positionWorld.span());
  inputs.array(bake.surfels.normal.span());
  inputs.array(plan.tracedEmission.empty() ? bake.surfels.emission.span()
                                           : std::span<const glm::vec3>(plan.tracedEmission));
  static_assert(sizeof(SurfelMap::Side) == 8, "no padding");
  inputs.array(std::span<const SurfelMap::Side>(plan.map.sides.toVector()));
  inputs.array(std::span<const std::uint32_t>(plan.map.tile));
  inputs.array(bake.hierarchy.child.span());
  inputs.array(bake.hierarchy.firstWeight.span());
  inputs.array(bake.hierarchy.levelBegin.span());
  inputs.array(bake.hierarchy.leafNode.span());
  inputs.array(bake.hierarchy.groupRoot.span());
  inputs.array(bake.hierarchy.skyDirection.span());
  inputs.array(bake.caches.positionWorld.span());
  inputs.array(bake.caches.normal.span());
  return nameEntry(inputs.bytes());
}

EntryName EntryNames::links(const EntryName& threshold, float minKey) {
  ByteWriter inputs;
  inputs.text("threshold");
  inputs.value(threshold.high);
  inputs.value(threshold.low);
  inputs.value(minKey);
  return nameEntry(inputs.bytes());
}

EntryName EntryNames::block(const EntryName& links, const ShardNumber& number) {
  ByteWriter inputs;
  inputs.text("block");
  inputs.value(links.high);
  inputs.value(links.low);
  inputs.value(number.number);
  inputs.value(number.count);
  return nameEntry(inputs.bytes());
}

}  // namespace relume
