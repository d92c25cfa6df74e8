// SPDX-License-Identifier: MIT
// Milliseconds of each runtime pass, named stage/scene/n_S/n_L/l. Scenes: the synthetic room at PIC's high and moderate
// settings, and the bake file named by RELUME_BENCH_BAKE when it is set.
#include "formats/bake_file.h"
#include "runtime/relighter.h"
#include "tests/runtime/synthetic_bake.h"
#if defined(RELUME_HAS_GL)
#include "samples/common/egl_context.h"
#endif

#include <benchmark/benchmark.h>

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstdlib>
#include <iostream>
#include <map>
#include <mutex>
#include <thread>

namespace relume {
namespace {

// A host's job system in small: threads that wait for work, tasks handed out by a counter.
class Workers {
 public:
  explicit Workers(unsigned threads) {
    for (unsigned i = 1; i < threads; ++i) threads_.emplace_back([this] { work(); });
  }
  ~Workers() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    wake_.notify_all();
    for (std::thread& thread : threads_) thread.join();
  }
  void run(std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
    {
      const std::lock_guard lock(mutex_);
      body_ = &body;
      tasks_ = tasks;
      next_ = 0;
      busy_ = threads_.size();
      ++generation_;
    }
    wake_.notify_all();
    drain(body, tasks);
    std::unique_lock lock(mutex_);
    idle_.wait(lock, [this] { return busy_ == 0; });
  }

 private:
  void drain(const std::function<void(std::uint32_t)>& body, std::uint32_t tasks) {
    for (std::uint32_t i = next_++; i < tasks; i = next_++) body(i);
  }
  void work() {
    std::uint64_t seen = 0;
    std::unique_lock lock(mutex_);
    while (true) {
      wake_.wait(lock, [&] { return stop_ || generation_ != seen; });
      if (stop_) return;
      seen = generation_;
      const auto* body = body_;
      const std::uint32_t tasks = tasks_;
      lock.unlock();
      drain(*body, tasks);
      lock.lock();
      if (--busy_ == 0) idle_.notify_one();
    }
  }

  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::condition_variable wake_, idle_;
  const std::function<void(std::uint32_t)>* body_ = nullptr;
  std::atomic<std::uint32_t> next_{0};
  std::uint32_t tasks_ = 0;
  std::size_t busy_ = 0;
  std::uint64_t generation_ = 0;
  bool stop_ = false;
};

struct Scene {
  std::string name;
  std::shared_ptr<const Bake> bake;
  int bands;
};

// Relights under one sun-like and one spot light, each iteration a frame; reports the named pass, or all of them.
void relightPass(benchmark::State& state, const Scene& scene, const std::string& pass, RelightOptions options) {
  options.lumaBands = options.chromaBands = scene.bands;
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
  for (int i = 0; i < 4; ++i) relighter->relight(setup);
  for (auto _ : state) {
    relighter->relight(setup);
    double ms = 0.0;
    for (const PassTime& each : relighter->passTimes()) {
      if (pass == "frame" || pass == each.pass) ms += each.ms;
    }
    state.SetIterationTime(ms * 1e-3);
  }
}

void registerScene(const Scene& scene, bool gl) {
  const Bake& bake = *scene.bake;
  const std::uint32_t rows = bake.links.cacheCount();
  const std::string tail = "/" + scene.name + "/" + std::to_string(bake.surfels.count()) + "/" +
                           std::to_string(rows ? bake.links.count() / rows : 0) + "/" + std::to_string(scene.bands);
  const auto add = [&](const std::string& pass, const std::string& how, const RelightOptions& options) {
    benchmark::RegisterBenchmark((pass + "_" + how + tail).c_str(),
                                 [=](benchmark::State& state) { relightPass(state, scene, pass, options); })
        ->UseManualTime()
        ->Unit(benchmark::kMillisecond);
  };
  static Workers two(2);
  RelightOptions one, both, baseline, avx2, opengl;
  both.parallelFor = [](std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) { two.run(tasks, body); };
  baseline.simd = Simd::baseline;
  avx2.simd = Simd::avx2;
  opengl.backend = Backend::gl;
  for (const char* pass : {"surfels", "pull", "caches", "frame"}) {
    add(pass, "cpu1", one);
    add(pass, "cpu2", both);
  }
  add("caches", "cpu1_baseline", baseline);
  add("caches", "cpu1_avx2", avx2);
  if (!gl) return;
  for (const char* pass : {"surfels", "pull", "caches", "copy", "frame"}) add(pass, "gl", opengl);
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
  registerScene({"room_high", share(test::makeSyntheticBake(test::highSetting())), 4}, gl);
  registerScene({"room_moderate", share(test::makeSyntheticBake(test::moderateSetting())), 3}, gl);
  if (const char* path = std::getenv("RELUME_BENCH_BAKE")) {
    Result<Bake> bake = readBake(path);
    if (!bake) {
      std::cerr << bake.error().message << "\n";
      return exitCode(bake.error().code);
    }
    const int bands = static_cast<int>(bake->provenance.lumaBands);
    registerScene({"file", share(std::move(*bake)), bands}, gl);
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
}
