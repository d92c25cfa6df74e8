// SPDX-License-Identifier: MIT
// See bench_measure.h.
#include "tools/cli/bench_measure.h"

#include "relume/bake/bake.h"
#include "relume/relighter.h"
#include "tools/base/clock.h"
#include "tools/base/worker_threads.h"
#include "tools/cli/bake_arguments.h"

#include <malloc.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <fstream>
#include <map>
#include <thread>

namespace relume {
namespace {

constexpr int kWarmUpFrames = 5;  // more than the frames that OpenGL keeps in flight

// Forget the peak so far: give back what is free, then ask Linux to count anew.
void resetPeakMemory() {
#if defined(__GLIBC__)
  ::malloc_trim(0);
#endif
  std::ofstream("/proc/self/clear_refs") << "5";
}

// Frames, and the times of their passes.
Result<RelightTimes> measureFrames(const Bake& bake, const RelightOptions& options, int frames, Context& context) {
  Result<Relighter> relighter = Relighter::create(bake, options);
  if (!relighter) return relighter.error();
  std::array<Light, 2> lights;
  lights[0].kind = LightKind::directional;
  lights[1].kind = LightKind::spot;
  if (!bake.caches.positionWorld.empty()) lights[1].positionWorld = bake.caches.positionWorld[0];
  LightSetup setup;
  setup.lights = lights;
  for (int i = 0; i < kWarmUpFrames; ++i) {
    if (Status ok = relighter->relight(setup); !ok) return ok.error();
  }

  std::vector<std::string> order;
  std::map<std::string, std::vector<double>> ms;
  std::vector<double> all;
  for (int i = 0; i < frames; ++i) {
    if (context.cancelled()) return cancelledError();
    if (Status ok = relighter->relight(setup); !ok) return ok.error();
    all.push_back(0.0);
    for (const PassTime& each : relighter->passTimes()) {
      if (ms[each.pass].empty()) order.push_back(each.pass);
      ms[each.pass].push_back(each.ms);
      all.back() += each.ms;
    }
  }
  RelightTimes times;
  for (const std::string& pass : order) times.passes.push_back(figuresOf(pass, ms[pass]));
  times.passes.push_back(figuresOf("frame", all));
  times.buffers = relighter->bufferSizes();
  times.bands = bandsName({relighter->lumaBands(), relighter->chromaBands()});
  return times;
}

}  // namespace

PassFigures figuresOf(const std::string& pass, std::vector<double> ms) {
  std::sort(ms.begin(), ms.end());
  const std::size_t n = ms.size();
  return {pass, 0.5 * (ms[(n - 1) / 2] + ms[n / 2]), ms.front()};
}

Result<MeasuredBake> measureBake(const Scene& scene, const BakeOptions& options, int repeat, Context& context) {
  MeasuredBake measured;
  resetPeakMemory();
  for (int i = 0; i < repeat; ++i) {
    measured.bake = Bake{};
    const std::size_t before = context.report().size();
    const double begin = clockSeconds();
    Result<Bake> baked = bake(scene, options, context);
    const double seconds = clockSeconds() - begin;
    if (!baked) return baked.error();
    measured.bake = std::move(*baked);

    // Keep the least of each stage: what the machine did beside the bake only ever adds.
    std::vector<StageReport>& stages = measured.times.stages;
    for (std::size_t k = before; k < context.report().size(); ++k) {
      const StageReport& stage = context.report()[k];
      const auto same = [&](const StageReport& other) { return other.stage == stage.stage; };
      const auto known = std::find_if(stages.begin(), stages.end(), same);
      if (known == stages.end()) {
        stages.push_back(stage);
      } else {
        known->seconds = std::min(known->seconds, stage.seconds);
      }
    }
    measured.times.seconds = i == 0 ? seconds : std::min(measured.times.seconds, seconds);
  }
  measured.times.peakMiB = peakMemoryMiB();
  return measured;
}

Result<RelightTimes> measureCpu(const Bake& bake, const Bands& bands, int threads, int frames, Context& context) {
  WorkerThreads workers(static_cast<unsigned>(threads));
  RelightOptions options;
  options.lumaBands = bands.luma;
  options.chromaBands = bands.chroma;
  options.surfelArrays = false;  // the lights are punctual
  if (threads > 1) options.parallelFor = workers.parallelFor();
  Result<RelightTimes> times = measureFrames(bake, options, frames, context);
  if (!times) return times.error();
  times->how = "CPU, " + std::to_string(threads) + (threads == 1 ? " thread" : " threads");
  times->backend = "cpu";
  times->threads = threads;
  return times;
}

Result<RelightTimes> measureGl(const Bake& bake, const Bands& bands, const GetProcAddress& getProcAddress, int frames,
                               Context& context) {
  RelightOptions options;
  options.lumaBands = bands.luma;
  options.chromaBands = bands.chroma;
  options.backend = BackendKind::gl;
  options.getProcAddress = getProcAddress;
  Result<RelightTimes> times = measureFrames(bake, options, frames, context);
  if (!times) return times.error();
  times->how = "OpenGL";
  times->backend = "gl";
  return times;
}

Machine describeMachine() {
  Machine machine;
  machine.cores = std::max(1u, std::thread::hardware_concurrency());
  // Family and model tell processors apart whose name virtual machines cut short.
  std::string name, family, model;
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line) && !line.empty();) {
    const std::size_t colon = line.find(": ");
    if (colon == std::string::npos) continue;
    const std::string value = line.substr(colon + 2);
    if (line.starts_with("model name"))
      name = value;
    else if (line.starts_with("model"))
      model = value;
    else if (line.starts_with("cpu family"))
      family = value;
  }
  machine.processor = name;
  if (!name.empty() && !family.empty() && !model.empty())
    machine.processor += " (family " + family + ", model " + model + ")";
  if (machine.processor.empty()) machine.processor = "unknown processor";
  return machine;
}

}  // namespace relume
