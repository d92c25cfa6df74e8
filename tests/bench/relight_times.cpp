// SPDX-License-Identifier: MIT
// Milliseconds of each runtime pass, named stage/scene/n_S/n_L/bands. Scenes: the synthetic room at PIC's high and
// moderate settings, and the bake file named by RELUME_BENCH_BAKE when it is set.
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "runtime/shared/bands.h"
#include "tests/runtime/synthetic_bake.h"
#include "tools/base/worker_threads.h"
#if defined(RELUME_HAS_GL)
#include "tools/gl_scene/egl_context.h"
#endif

#include <benchmark/benchmark.h>

#include <array>
#include <cstddef>
#include <cstdlib>
#include <iostream>
#include <vector>

namespace relume {
namespace {

struct Scene {
  std::string name;
  std::shared_ptr<const Bake> bake;
  Bands bands;
};

// Relights under one sun-like and one spot light, each iteration a frame; reports the named pass, or all of them.
void relightPass(benchmark::State& state, const Scene& scene, const std::string& pass, RelightOptions options) {
  options.lumaBands = scene.bands.luma;
  options.chromaBands = scene.bands.chroma;
  Result<Relighter> relighter = Relighter::create(*scene.bake, options);
  if (!relighter) {
    state.SkipWithError(relighter.error().message.c_str());
    return;
  }
  std::array<Light, 2> lights;
  lights[0].kind = LightKind::directional;
  lights[1].kind = LightKind::spot;
  lights[1].positionWorld = scene.bake->caches.positionWorld[0];
  LightSetup setup;
  setup.lights = lights;
  bool lit = true;
  for (int i = 0; i < 4; ++i) lit = lit && relighter->relight(setup);
  if (!lit) return state.SkipWithError(relighter->check(setup).error().message.c_str());
  for (auto _ : state) {
    if (!relighter->relight(setup)) break;
    double ms = 0.0;
    for (const PassTime& each : relighter->passTimes()) {
      if (pass == "frame" || pass == each.pass) ms += each.ms;
    }
    state.SetIterationTime(ms * 1e-3);
  }
}

// Writes the textures that are light, for a resolve by textures (relume/texture_resolve.h).
void writeTextures(benchmark::State& state, const Scene& scene) {
  const Result<Relighter> relighter = Relighter::create(*scene.bake, {});
  if (!relighter) return state.SkipWithError(relighter.error().message.c_str());
  const Result<TextureResolve> resolve = relighter->textureResolve();
  if (!resolve) return state.SkipWithError(resolve.error().message.c_str());
  std::vector<std::vector<std::byte>> texels;
  for (const ResolveTexture& texture : resolve->textures) texels.emplace_back(texture.bytes);
  for (auto _ : state) {
    for (std::size_t i = 0; i < texels.size(); ++i) {
      if (resolve->textures[i].isLight && !relighter->writeResolveTexture(i, texels[i])) break;
    }
  }
}

void registerScene(const Scene& scene, bool gl) {
  const Bake& bake = *scene.bake;
  const std::uint32_t rows = bake.links.cacheCount();
  const std::string tail = "/" + scene.name + "/" + std::to_string(bake.surfels.count()) + "/" +
                           std::to_string(rows ? bake.links.count() / rows : 0) + "/" + bandsName(scene.bands);
  const auto add = [&](const std::string& pass, const std::string& how, const RelightOptions& options) {
    benchmark::RegisterBenchmark((pass + "_" + how + tail).c_str(),
                                 [=](benchmark::State& state) { relightPass(state, scene, pass, options); })
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  };
  static WorkerThreads two(2);
  RelightOptions one, both, baseline, avx2, opengl;
  both.parallelFor = two.parallelFor();
  baseline.simd = Simd::baseline;
  avx2.simd = Simd::avx2;
  opengl.backend = BackendKind::gl;
#if defined(RELUME_HAS_GL)
  opengl.getProcAddress = EglContext::getProcAddress;
#endif
  for (const char* pass : {"surfels", "pull", "caches", "frame"}) {
    add(pass, "cpu1", one);
    add(pass, "cpu2", both);
  }
  for (const char* pass : {"surfels", "pull", "caches", "frame"}) {
    add(pass, "cpu1_baseline", baseline);
    add(pass, "cpu1_avx2", avx2);
  }
  benchmark::RegisterBenchmark(("textures_cpu1" + tail).c_str(), [=](benchmark::State& state) {
    writeTextures(state, scene);
  })->Unit(benchmark::kMillisecond);
  if (!gl) return;
  for (const char* pass : {"surfels", "pull", "caches", "frame"}) add(pass, "gl", opengl);
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  using namespace relume;
  bool gl = false;
#if defined(RELUME_HAS_GL)
  const Result<EglContext> context = EglContext::create();
  gl = static_cast<bool>(context);
  benchmark::AddCustomContext("OpenGL", context ? context->renderer() : context.error().message);
#endif
  const auto share = [](Bake bake) { return std::make_shared<const Bake>(std::move(bake)); };
  registerScene({"room_high", share(test::makeSyntheticBake(test::highSetting())), {4, 4}}, gl);
  registerScene({"room_moderate", share(test::makeSyntheticBake(test::moderateSetting())), {3, 3}}, gl);
  if (const char* path = std::getenv("RELUME_BENCH_BAKE")) {
    Result<Bake> bake = readBake(path);
    if (!bake) {
      std::cerr << bake.error().message << "\n";
      return exitCode(bake.error().code);
    }
    const auto luma = static_cast<int>(bake->provenance.lumaBands),
               chroma = static_cast<int>(bake->provenance.chromaBands);
    registerScene({"file", share(std::move(*bake)), {luma, chroma}}, gl);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
}
