// SPDX-License-Identifier: MIT
// What a live preview takes: records, relighting them, splatting them here and in OpenGL, and a camera that turns by 5
// degrees.
//
//   bench_live_preview LEVEL.glb BAKE.relume CAMERA LIGHT[,LIGHT...] [WIDTH HEIGHT [ACCURACY [THREADS [RECORDS
//   [ROUNDS]]]]]
#include "bake/preview/live_preview.h"

#include "bake/base/parallel.h"
#include "relume/bake/context.h"
#include "relume/bake/load_scene.h"
#include "relume/bake_file.h"
#include "tools/render/hit_light.h"
#include "tools/render/relight_by_rays.h"
#ifdef RELUME_BENCH_GL
#include "tools/gl_scene/egl_context.h"
#include "tools/gl_splat/splats_gl.h"
#endif

#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace relume {
namespace {

using Clock = std::chrono::steady_clock;

double msSince(Clock::time_point begin) {
  return std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
}

// Of several runs [ms]: the least and the median by the clock, and the mean of all threads by the processor's time.
struct Times {
  double least, median, processor;
};
Times timesOf(int runs, const std::function<void()>& work) {
  std::vector<double> ms;
  const std::clock_t before = std::clock();
  for (int i = 0; i < runs; ++i) {
    const auto begin = Clock::now();
    work();
    ms.push_back(msSince(begin));
  }
  const double processor = 1e3 * static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC / runs;
  std::sort(ms.begin(), ms.end());
  return {ms.front(), ms[ms.size() / 2], processor};
}

int fail(const std::string& message) { return std::fprintf(stderr, "%s\n", message.c_str()), 1; }

struct Frames {
  std::uint32_t records = 0, frames = 0;
  double ms = 0.0;
};

Frames fillAll(LivePreview& live, Context& context) {
  Frames frames;
  const auto begin = Clock::now();
  for (; !live.isComplete(); ++frames.frames) frames.records += live.fill(100, {}, context);
  frames.ms = msSince(begin);
  return frames;
}

// Splats of records that there are, by tiles.
void splatByTiles(const LivePreview& live, const CameraRays& camera, std::span<const Record> records,
                  const Interpolation& options, std::vector<Splat>& picture, Context& context) {
  const RecordTiles tiles(camera, records, options);
  parallelChunks(context, "", live.height(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin * live.width(); i < end * live.width(); ++i) {
      const PixelReceiver& receiver = live.receivers()[i];
      picture[i] = {};
      if (receiver.normal == glm::vec3(0.0f)) continue;
      picture[i] = tiles.splat(static_cast<std::uint32_t>(i % live.width()),
                               static_cast<std::uint32_t>(i / live.width()), receiver);
    }
  });
}

void printTimes(const char* what, const Times& t) {
  std::printf("    %s: %.1f ms (median %.1f, processor %.1f)\n", what, t.least, t.median, t.processor);
}

// The first records, by tiles and in OpenGL, which a call to finish waits for.
void measureSplats(const LivePreview& live, const Camera& camera, const Interpolation& options, std::size_t most,
                   Context& context) {
  const std::vector<Record>& all = live.records().records();
  const std::span<const Record> records = std::span(all).first(std::min(most, all.size()));
  const CameraRays rays(camera, live.width(), live.height());
  std::vector<Splat> here(live.receivers().size()), drawn(here.size());
  const Times tiles = timesOf(15, [&] { splatByTiles(live, rays, records, options, here, context); });
  std::printf("  splat of %zu records\n", records.size());
  printTimes("tiles", tiles);
#ifdef RELUME_BENCH_GL
  const auto egl = EglContext::create();
  if (!egl) return static_cast<void>(std::printf("    no OpenGL: %s\n", egl.error().message.c_str()));
  const auto finish = reinterpret_cast<void (*)()>(EglContext::getProcAddress("glFinish"));
  const auto made = SplatsGl::create({EglContext::getProcAddress});
  if (!made) return static_cast<void>(std::printf("    no splats: %s\n", made.error().message.c_str()));
  SplatsGl& gl = **made;
  bool ok = true;
  const auto timed = [&](const auto& work) {
    return timesOf(15, [&] {
      ok = work() && ok;
      finish();
    });
  };
  std::printf("    OpenGL: %s\n", egl->renderer().c_str());
  printTimes("pixels sent", timed([&] { return bool(gl.look(rays, live.receivers())); }));
  printTimes("records sent and drawn", timed([&] { return bool(gl.draw(records, options)); }));
  printTimes("relit: light sent, and drawn", timed([&] { return bool(gl.relight(records)); }));
  std::printf("      of %.2f MiB\n", static_cast<double>(gl.sentBytes()) / 1048576.0);
  printTimes("picture read back", timed([&] { return bool(gl.read(drawn)); }));
  double square = 0.0, sum = 0.0;
  std::size_t apart = 0;
  for (std::size_t i = 0; i < here.size(); ++i) {
    const glm::vec3 d = here[i].reflected - drawn[i].reflected;
    square += glm::dot(d, d);
    sum += glm::dot(here[i].reflected, here[i].reflected);
    apart += (here[i].weight > 0.0f) != (drawn[i].weight > 0.0f) ? 1 : 0;
  }
  std::printf("    apart by %.1e of the root mean square, %zu pixels lit by one alone%s\n", std::sqrt(square / sum),
              apart, ok ? "" : "; a call failed");
#endif
}

int measure(int argc, char** argv) {
  const std::string cameraName = argv[3], lightNames = std::string(",") + argv[4] + ",";
  const auto number = [&](int i, const char* otherwise) { return argc > i ? argv[i] : otherwise; };
  Context context;
  context.threads = std::atoi(number(8, "2"));
  const auto scene = loadScene(argv[1], context);
  if (!scene) return fail(scene.error().message);
  const auto bake = readBake(argv[2]);
  if (!bake) return fail(bake.error().message);
  const auto tracer = RayTracer::create(*scene, "", context, RayStructure::bundles);
  if (!tracer) return fail(tracer.error().message);
  RenderRequest request;
  request.bake = &*bake;
  for (const SceneLight& light : scene->lights) {
    if (lightNames.find("," + light.name + ",") != std::string::npos) request.lights.push_back(light);
  }
  const auto named = [&](const Camera& camera) { return camera.name == cameraName; };
  const auto camera = std::find_if(scene->cameras.begin(), scene->cameras.end(), named);
  if (camera == scene->cameras.end() || request.lights.empty())
    return fail("a camera and lights of the level expected");
  auto relit = relightByRays(*tracer, request, context);
  if (!relit) return fail(relit.error().message);
  std::vector<glm::vec3> radiance = surfelRadiances(*bake, *relit->all);
  const auto map = mapSurfels(*scene, *bake, context);

  LivePreview::Options options;
  options.accuracy = std::strtof(number(7, "0.25"), nullptr);
  options.rounds = std::atoi(number(10, "2"));
  LivePreview live(*tracer, surfelLeaves(*map), {}, options);
  const auto width = static_cast<std::uint32_t>(std::atoi(number(5, "512"))),
             height = static_cast<std::uint32_t>(std::atoi(number(6, "512")));
  live.relight(radiance, context);
  live.look(*camera, width, height, context);
  const Frames first = fillAll(live, context);
  const std::size_t count = live.records().records().size();
  std::printf("%s, %s: %u x %u, %u surfels\n", argv[1], argv[3], width, height,
              static_cast<unsigned>(bake->surfels.count()));
  std::printf("  %u records in %u frames, %.0f ms: %.2f ms a record\n", first.records, first.frames, first.ms,
              first.ms / first.records);
  std::printf("  %.1f leaves and %.1f KiB a record, %.1f MiB\n",
              static_cast<double>(live.records().terms()) / static_cast<double>(count),
              static_cast<double>(live.records().sizeBytes()) / 1024.0 / static_cast<double>(count),
              static_cast<double>(live.records().sizeBytes()) / 1048576.0);

  // Records alone, and with the picture
  LeafRecords records(*tracer, surfelLeaves(*map), {}, {options.rays, options.seed, true});
  std::vector<PixelReceiver> placed;
  for (const Record& r : live.records().records()) placed.push_back({r.positionWorld, r.normal, r.normal, r.footprint});
  std::vector<std::uint32_t> pixels(
      std::min<std::size_t>(static_cast<std::size_t>(std::atoi(number(9, "5000"))), placed.size()));
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = static_cast<std::uint32_t>(i * placed.size() / pixels.size());
  records.gather(placed, pixels, context);
  const auto relight = timesOf(50, [&] { records.relight(radiance, context); });
  std::printf("  relight of %zu records, %.1f leaves each, %.1f MiB: %.2f ms (median %.2f, processor %.2f)\n",
              pixels.size(), static_cast<double>(records.terms()) / static_cast<double>(pixels.size()),
              static_cast<double>(records.sizeBytes()) / 1048576.0, relight.least, relight.median, relight.processor);
  const auto whole = timesOf(15, [&] { live.relight(radiance, context); });
  std::printf("  relight and splat of %zu records: %.1f ms (median %.1f, processor %.1f)\n", count, whole.least,
              whole.median, whole.processor);

  Interpolation interpolation;
  interpolation.accuracy = options.accuracy;
  measureSplats(live, *camera, interpolation, static_cast<std::size_t>(std::atoi(number(9, "5000"))), context);

  Camera turned = *camera;
  turned.toWorld = turned.toWorld * glm::rotate(glm::mat4(1.0f), glm::radians(5.0f), glm::vec3(0, 1, 0));
  const auto begin = Clock::now();
  live.look(turned, width, height, context);
  const double lookMs = msSince(begin);
  const Frames more = fillAll(live, context);
  std::printf("  turned by 5 degrees: %.0f ms, and %u records more, %.1f %%\n", lookMs, more.records,
              100.0 * more.records / static_cast<double>(first.records));
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 5)
    return std::fprintf(stderr,
                        "bench_live_preview LEVEL.glb BAKE.relume CAMERA LIGHT[,LIGHT...] [WIDTH HEIGHT [ACCURACY "
                        "[THREADS]]]\n"),
           1;
  return relume::measure(argc, argv);
}
