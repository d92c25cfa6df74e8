// SPDX-License-Identifier: MIT
// See entry_names.h.
#include "bake/shards/entry_names.h"

#include "bake/rays/ray_tracer_name.h"
#include "formats/chunks.h"
#include "relume/bake/provenance.h"

#include <algorithm>
#include <type_traits>
#include <unordered_map>
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

// What a name is the hash of. Every array is preceded by its size, so that different inputs never give the same bytes.
class Inputs {
 public:
  explicit Inputs(const std::string& kind) { text(kind); }

  template <class T>
  requires(std::is_trivially_copyable_v<T>) void array(std::span<const T> values) {
    const std::uint64_t size = values.size();
    append(&size, sizeof(size));
    append(values.data(), values.size_bytes());
  }
  // No types with padding: its bytes are undefined.
  template <class T>
  requires(std::is_arithmetic_v<T> || std::is_enum_v<T> ||
           std::has_unique_object_representations_v<T>) void value(const T& v) {
    append(&v, sizeof(v));
  }
  void text(const std::string& text) { array(std::span<const char>(text)); }
  EntryName name() const { return nameEntry(bytes_); }

 private:
  void append(const void* data, std::size_t size) {
    const auto* from = static_cast<const std::byte*>(data);
    bytes_.insert(bytes_.end(), from, from + size);
  }
  std::vector<std::byte> bytes_;
};

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
void addShapes(const Scene& scene, const std::vector<BakedInstance>& described, Inputs& inputs) {
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

}  // namespace

EntryNames::EntryNames(const Scene& scene, const BakeOptions& options)
    : scene_(scene), options_(options), instances_(describeInstances(scene)) {
  const Provenance p = describeProvenance(Scene{}, {}, options, rayTracerName(options.embreeIsa));
  program_ = std::string("processor ") + processorMaker() + "\ntool " + p.toolVersion + "\nalgorithm " +
             std::to_string(p.algorithmVersion) + "\nfiles " + std::to_string(kPlanFileType.version) + " " +
             std::to_string(kShardFileType.version) + " " + std::to_string(kBakeFormatVersion) + "\ntracer " +
             p.rayTracer;
}

EntryName EntryNames::plan() const {
  Inputs inputs("plan");
  inputs.text(program_);
  inputs.value(hashScene(scene_, instances_));
  inputs.text(optionsToJson(withoutLinks(options_)));
  return inputs.name();
}

EntryName EntryNames::threshold(const BakePlan& plan) const {
  const Bake& bake = plan.bake;
  Inputs inputs("links");
  inputs.text(program_);
  addShapes(scene_, instances_, inputs);
  // The numbers of caches asked for decide with which structure rays are traced.
  BakeOptions options;
  options.links = plan.chosen.links;
  options.caches.lightmapCaches = options_.caches.lightmapCaches;
  options.caches.gridCaches = options_.caches.gridCaches;
  options.seed = options_.seed;
  options.embreeIsa = options_.embreeIsa;
  inputs.text(optionsToJson(options));

  inputs.value(bake.surfels.areaEach);
  inputs.array(bake.surfels.positionWorld.span());
  inputs.array(bake.surfels.normal.span());
  inputs.array(plan.tracedEmission.empty() ? bake.surfels.emission.span()
                                           : std::span<const glm::vec3>(plan.tracedEmission));
  static_assert(sizeof(SurfelMap::Side) == 8, "no padding");
  inputs.array(std::span<const SurfelMap::Side>(plan.map.sides));
  inputs.array(std::span<const std::uint32_t>(plan.map.tile));
  inputs.array(bake.hierarchy.child.span());
  inputs.array(bake.hierarchy.firstWeight.span());
  inputs.array(bake.hierarchy.levelBegin.span());
  inputs.array(bake.hierarchy.leafNode.span());
  inputs.array(bake.hierarchy.groupRoot.span());
  inputs.array(bake.hierarchy.skyDirection.span());
  inputs.array(bake.caches.positionWorld.span());
  inputs.array(bake.caches.normal.span());
  return inputs.name();
}

EntryName EntryNames::links(const EntryName& threshold, float minKey) {
  Inputs inputs("threshold");
  inputs.value(threshold.high);
  inputs.value(threshold.low);
  inputs.value(minKey);
  return inputs.name();
}

EntryName EntryNames::block(const EntryName& links, const ShardNumber& number) {
  Inputs inputs("block");
  inputs.value(links.high);
  inputs.value(links.low);
  inputs.value(number.number);
  inputs.value(number.count);
  return inputs.name();
}

}  // namespace relume
