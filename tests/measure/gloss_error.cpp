// SPDX-License-Identifier: MIT
// Error of glossy light in a view, against `relume reference`'s path tracer, by exponent of the lobe and bands of the
// caches, with the time of the caches' pass and of a look-up, and the runtime's memory (one thread). Prints the tables
// of docs/notes/gloss.md.
//   bench_gloss_error LEVEL.glb BAKE.relume CAMERA LIGHTS [PATHS]
#include "tests/measure/compare_frame.h"
#include "tests/measure/open_view.h"
#include "tests/measure/traced_light.h"
#include "tools/render/reference_layers.h"
#include "tools/render/render_cpu.h"
#include "tools/render/seen_surface.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace relume {
namespace {

constexpr float kExponents[] = {1.0f, 4.0f, 16.0f, 64.0f};
constexpr Bands kBands[] = {{2, 2}, {3, 2}, {4, 2}, {4, 4}, {5, 3}, {6, 3}, {7, 4}, {8, 4}, {8, 8}};

int fail(const std::string& message) { return std::fprintf(stderr, "%s\n", message.c_str()), 1; }

// One thread's time of a call, in nanoseconds: the least of a few runs over all receivers of the view.
double lookUpNs(const test::OpenedView& view, const Relighter& relighter, const RenderRequest& request) {
  struct Receiver {
    SeenSurface seen;
    Ray ray;
  };
  std::vector<Receiver> receivers;
  const CameraRays rays(request.camera, request.width, request.height);
  for (std::uint32_t i = 0; i < request.width * request.height; i += 7) {
    Ray ray;
    rays.at(static_cast<float>(i % request.width) + 0.5f, static_cast<float>(i / request.width) + 0.5f, ray.origin,
            ray.direction);
    if (const Hit hit = view.tracer.trace(ray)) receivers.push_back({seenAt(*view.scene, ray, hit), ray});
  }
  double least = 1e30;
  glm::vec3 sum(0.0f);
  for (int run = 0; run < 5; ++run) {
    const auto begin = std::chrono::steady_clock::now();
    for (const Receiver& r : receivers)
      sum += linkGlossy(*view.scene, view.bake, relighter, r.seen, r.ray, *request.exponent);
    const std::chrono::duration<double, std::nano> ns = std::chrono::steady_clock::now() - begin;
    least = std::min(least, ns.count() / static_cast<double>(receivers.size()));
  }
  return sum.x < 0.0f ? 0.0 : least;
}

int measure(const test::OpenedView& view, const std::vector<SceneLight>& lights, std::uint32_t paths) {
  Context context;
  RenderRequest request;
  request.bake = &view.bake;
  request.camera = view.camera;
  request.lights = lights;
  ReferenceOptions options;
  options.samplesPerPixel = paths;
  options.width = request.width;
  options.height = request.height;
  std::printf(
      "| exponent | bands | RMSE %% | t1 %% | energy | noise of the reference %% | caches, ms | a look-up, ns | "
      "MiB |\n|---:|---|---:|---:|---:|---:|---:|---:|---:|\n");
  for (const float exponent : kExponents) {
    request.exponent = options.exponent = exponent;
    const auto truth = renderReference(view.tracer, view.camera, lights, options, context);
    if (!truth) return fail(truth.error().message);
    const ChannelImage reference = toChannels(*truth, glossyOf(*truth));
    for (const Bands& bands : kBands) {
      request.bands = bands;
      const auto frame = renderCpu(view.tracer, request, context);
      if (!frame) return fail(frame.error().message);
      const auto d = test::compareFrame(reference, {"GlossDir", "GlossInd"}, *frame, Aov::glossy);
      if (!d) return fail(d.error().message);

      auto relighter =
          Relighter::create(view.bake, {.lumaBands = bands.luma, .chromaBands = bands.chroma, .glossy = true});
      if (!relighter) return fail(relighter.error().message);
      LightSetup setup;
      const std::vector<Light> lit = toRuntimeLights(lights);
      setup.lights = lit;
      double caches = 1e30, bytes = 0.0;
      for (int frames = 0; frames < 5; ++frames) {
        if (Status ok = relighter->relight(setup); !ok) return fail(ok.error().message);
        for (const PassTime& pass : relighter->passTimes()) {
          if (std::string(pass.pass) == "caches") caches = std::min(caches, pass.ms);
        }
      }
      for (const auto& [name, size] : relighter->bufferSizes()) bytes += static_cast<double>(size);
      std::printf("| %g | %s | %.1f | %.1f | %.3f | %.1f | %.2f | %.0f | %.1f |\n", static_cast<double>(exponent),
                  bandsName(bands).c_str(), 100 * d->rmseClean, 100 * d->rmseTrimmed, d->energy, 100 * d->noise, caches,
                  lookUpNs(view, *relighter, request), bytes / 1048576.0);
      std::fflush(stdout);
    }
  }
  return 0;
}

int run(int argc, char** argv) {
  Context context;
  const auto view = test::openView(argv[1], argv[2], argv[3], context);
  if (!view) return fail(view.error().message);
  const std::vector<SceneLight> lights = test::lightsNamed(*view->scene, argv[4]);
  if (lights.empty()) return fail(std::string(argv[1]) + ": no such lights");
  const int paths = argc > 5 ? std::atoi(argv[5]) : 256;
  return measure(*view, lights, static_cast<std::uint32_t>(std::max(1, paths)));
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 5)
    return std::fprintf(stderr, "usage: bench_gloss_error LEVEL.glb BAKE.relume CAMERA LIGHTS [PATHS]\n"), 1;
  return relume::run(argc, argv);
}
