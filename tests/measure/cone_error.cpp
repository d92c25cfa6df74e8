// SPDX-License-Identifier: MIT
// Error of glossy light and of occlusion by cones in a view, against `relume reference`'s path tracer, by exponent of
// the lobe, with the time of a cone (one thread) and the memory of the mips. With a bake its light is on the voxels,
// without one live light. With the word `once` light is reflected once, and voxels lit by reflective shadow maps take
// the place of those with one direction. Prints the tables of errors of docs/notes/cones.md.
//   bench_cone_error LEVEL.glb CAMERA LIGHTS [BAKE.relume|-] [PATHS] [CELLS] [once]
#include "runtime/cones/cone_light.h"
#include "tests/measure/compare_frame.h"
#include "tests/measure/open_view.h"
#include "tests/measure/traced_light.h"
#include "tools/render/reference_layers.h"
#include "tools/render/render_cpu.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace relume {
namespace {

constexpr float kExponents[] = {4.0f, 16.0f, 64.0f, 650.0f};

int fail(const std::string& message) { return std::fprintf(stderr, "%s\n", message.c_str()), 1; }

int measure(const test::OpenedView& view, const std::vector<SceneLight>& lights, bool hasBake, std::uint32_t paths,
            std::uint32_t cells, bool once) {
  Context context;
  RenderRequest request;
  request.bake = hasBake ? &view.bake : nullptr;
  request.camera = view.camera;
  request.lights = lights;
  request.samples = 2;
  ReferenceOptions options;
  options.samplesPerPixel = paths;
  options.width = request.width;
  options.height = request.height;
  if (once) request.bounces = options.maxBounces = 1;

  std::printf(
      "| exponent | voxels | RMSE %% | t1 %% | energy | noise of the reference %% | draw, s | mips, MiB |\n"
      "|---:|---|---:|---:|---:|---:|---:|---:|\n");
  for (const float exponent : kExponents) {
    request.exponent = options.exponent = exponent;
    const auto truth = renderReference(view.tracer, view.camera, lights, options, context);
    if (!truth) return fail(truth.error().message);
    const ChannelImage reference = toChannels(*truth, glossyOf(*truth));
    for (const auto directions : {RadianceMips::Directions::six, RadianceMips::Directions::one}) {
      const bool isSix = directions == RadianceMips::Directions::six, byMaps = once && !isSix;
      request.live = LiveRequest{cells, 64, byMaps ? RadianceMips::Directions::six : directions};
      if (byMaps) request.live->rsm.emplace().frames = 1;
      const auto begin = std::chrono::steady_clock::now();
      const auto frame = renderCpu(view.tracer, request, context);
      if (!frame) return fail(frame.error().message);
      const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
      const auto d = test::compareFrame(reference, {"GlossDir", "GlossInd"}, *frame, Aov::glossy);
      if (!d) return fail(d.error().message);
      double bytes = 0.0;
      for (const auto& [name, size] : frame->bufferBytes) bytes += name == "mips" ? static_cast<double>(size) : 0.0;
      std::printf("| %g | %s | %.1f | %.1f | %.3f | %.1f | %.1f | %.1f |\n", static_cast<double>(exponent),
                  byMaps  ? "six, lit by maps"
                  : isSix ? "six directions"
                          : "one",
                  100 * d->rmseClean, 100 * d->rmseTrimmed, d->energy, 100 * d->noise, seconds.count(),
                  bytes / 1048576.0);
      std::fflush(stdout);
    }
  }
  if (once) return 0;

  // Occlusion: the mean of |difference| where something is seen
  request.exponent.reset();
  options.exponent.reset();
  options.maxBounces = 0;
  request.occlusionFalloff = options.occlusionFalloff = 1.0f;
  request.live = LiveRequest{cells, 64, RadianceMips::Directions::six};
  const auto truth = renderReference(view.tracer, view.camera, {}, options, context);
  if (!truth) return fail(truth.error().message);
  const auto frame = renderCpu(view.tracer, request, context);
  if (!frame) return fail(frame.error().message);
  double sum = 0.0, bias = 0.0, seen = 0.0;
  for (std::size_t i = 0; i < truth->open.size(); ++i) {
    if (truth->depth[i] == 0.0f) continue;
    const double d = static_cast<double>(frame->open[i]) - static_cast<double>(truth->open[i]);
    sum += std::abs(d);
    bias += d;
    seen += 1.0;
  }
  std::printf("occlusion: mean of |difference| %.3f, of difference %+.3f, over %.0f pixels\n", sum / seen, bias / seen,
              seen);
  return 0;
}

int run(int argc, char** argv) {
  Context context;
  const std::string bake = argc > 4 && std::string(argv[4]) != "-" ? argv[4] : "";
  const auto view = test::openView(argv[1], bake, argv[2], context);
  if (!view) return fail(view.error().message);
  const std::vector<SceneLight> lights = test::lightsNamed(*view->scene, argv[3]);
  if (lights.empty()) return fail(std::string(argv[1]) + ": no such lights");
  const int paths = argc > 5 ? std::atoi(argv[5]) : 256, cells = argc > 6 ? std::atoi(argv[6]) : 32;
  return measure(*view, lights, !bake.empty(), static_cast<std::uint32_t>(std::max(1, paths)),
                 static_cast<std::uint32_t>(cells), argc > 7 && std::string(argv[7]) == "once");
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 4)
    return std::fprintf(stderr,
                        "usage: bench_cone_error LEVEL.glb CAMERA LIGHTS [BAKE.relume|-] [PATHS] [CELLS] [once]\n"),
           1;
  return relume::run(argc, argv);
}
