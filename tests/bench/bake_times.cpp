// SPDX-License-Identifier: MIT
// Seconds of the stages of a bake, named stage/scene/n_S/n_C/n_L/l. Scenes: the shipped level, and the .glb named by
// RELUME_BENCH_SCENE when it is set. Each stage is measured on what the stages before it made, on all cores.
#include "bake/caches/caches.h"
#include "bake/hierarchy/hierarchy.h"
#include "bake/links/links.h"
#include "bake/rays/ray_tracer.h"
#include "bake/surfels/surfels.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/options.h"
#include "relume/bake/scene.h"

#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <memory>
#include <optional>

namespace relume {
namespace {

// A level and what the stages of its bake made, as far as they have run.
struct Stages {
  std::string name;
  Scene scene;
  BakeOptions options;
  Context context;
  std::optional<RayTracer> tracer;
  PlaySpace space;
  PlacedSurfels surfels;
  Hierarchy hierarchy;
  Caches caches;

  Status prepare();
};

// Run every stage but the last once, for the ones after it.
Status Stages::prepare() {
  Result<RayTracer> rays = RayTracer::create(scene, options.embreeIsa, context, RayStructure::bundles);
  if (!rays) return rays.error();
  tracer.emplace(std::move(*rays));
  Result<PlaySpace> found = findPlaySpace(*tracer, options.playSpace, options.seed, context);
  if (!found) return found.error();
  space = std::move(*found);
  Result<PlacedSurfels> placed = placeSurfels(*tracer, space, options.surfels, options.seed, context);
  if (!placed) return placed.error();
  surfels = std::move(*placed);
  Result<Hierarchy> tree =
      clusterSurfels(*tracer, surfels.surfels, options.links.skyPatches, options.clustering, context);
  if (!tree) return tree.error();
  hierarchy = std::move(*tree);
  Result<PlacedCaches> receivers = placeCaches(*tracer, space, options.caches, options.seed, context);
  if (!receivers) return receivers.error();
  caches = unpack(std::move(*receivers));
  return done();
}

// A typical edge over the instances, in metres an object unit: what unwrapMesh() is told.
float scaleOf(const Instance& instance) { return std::cbrt(std::abs(glm::determinant(glm::mat3(instance.toWorld)))); }

using Work = std::function<bool(Stages&)>;

bool placeAll(Stages& s) {
  return static_cast<bool>(placeSurfels(*s.tracer, s.space, s.options.surfels, s.options.seed, s.context));
}
bool clusterAll(Stages& s) {
  return static_cast<bool>(
      clusterSurfels(*s.tracer, s.surfels.surfels, s.options.links.skyPatches, s.options.clustering, s.context));
}
bool unwrapAll(Stages& s) {
  std::vector<bool> seen(s.scene.meshes.size(), false);
  for (const Instance& instance : s.scene.instances) {
    if (seen[instance.mesh]) continue;
    seen[instance.mesh] = true;
    benchmark::DoNotOptimize(unwrapMesh(s.scene.meshes[instance.mesh], scaleOf(instance), s.context));
  }
  return true;
}
bool placeCachesAll(Stages& s) {
  return static_cast<bool>(placeCaches(*s.tracer, s.space, s.options.caches, s.options.seed, s.context));
}
bool traceAll(Stages& s) {
  return static_cast<bool>(traceLinks(*s.tracer, s.surfels.surfels, s.surfels.map, s.hierarchy, s.caches,
                                      s.options.links, s.options.seed, s.context));
}

void registerScene(const std::string& name, const Scene& scene, Preset preset) {
  const BakeOptions options = presetOptions(preset);
  const std::string tail = "/" + name + "/" + std::to_string(options.surfels.count) + "/" +
                           std::to_string(options.caches.gridCaches + options.caches.lightmapCaches) + "/" +
                           std::to_string(options.links.linksPerCache) + "/" + std::to_string(options.lumaBands);
  // The stages before are run when the first benchmark of the scene is.
  auto stages = std::make_shared<Stages>();
  stages->name = name;
  stages->scene = scene;
  stages->options = options;
  auto ready = std::make_shared<std::optional<Status>>();
  const std::vector<std::pair<const char*, Work>> all = {{"surfels", placeAll},
                                                         {"hierarchy", clusterAll},
                                                         {"unwrap", unwrapAll},
                                                         {"caches", placeCachesAll},
                                                         {"links", traceAll}};
  for (const auto& [stage, body] : all) {
    benchmark::RegisterBenchmark((stage + tail).c_str(),
                                 [stages, ready, work = body](benchmark::State& state) {
                                   if (!*ready) ready->emplace(stages->prepare());
                                   if (!**ready) {
                                     state.SkipWithError((*ready)->error().message.c_str());
                                     return;
                                   }
                                   for (auto _ : state) {
                                     if (!work(*stages)) state.SkipWithError("the stage failed");
                                   }
                                 })
        ->MeasureProcessCPUTime()
        ->UseRealTime()
        ->Unit(benchmark::kMillisecond);
  }
}

Status registerFile(const std::filesystem::path& path, const std::vector<Preset>& presets) {
  Context context;
  const Result<Scene> scene = importGltf(path, context);
  if (!scene) return scene.error();
  for (const Preset preset : presets) registerScene(path.stem().string(), *scene, preset);
  return done();
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  using namespace relume;
  Status ok = registerFile(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", {Preset::draft, Preset::medium});
  const char* path = std::getenv("RELUME_BENCH_SCENE");
  if (ok && path) ok = registerFile(path, {Preset::medium, Preset::high});
  if (!ok) {
    std::cerr << ok.error().message << "\n";
    return exitCode(ok.error().code);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
}
