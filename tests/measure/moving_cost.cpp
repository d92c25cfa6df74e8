// SPDX-License-Identifier: MIT
// What a moving ball costs a frame: the least milliseconds without it and with it, of many frames in which the two take
// turns and the ball goes on a little, beside the cache pass alone. Of the CPU backend on one thread, processor time;
// of OpenGL, where there is some, wall clock from relight() until the driver has done.
//
//   bench_moving_cost BAKE X,Y,Z RADIUS [FRAMES]     (metres)
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "tests/measure/or_exit.h"
#include "tests/runtime/ball.h"
#if defined(RELUME_MEASURE_GL)
#include "tools/gl_scene/egl_context.h"

#include <epoxy/gl.h>
#endif

#include <glm/geometric.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string_view>
#include <vector>

namespace {

using namespace relume;

// [ms] of this thread.
double processorMs() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

#if defined(RELUME_MEASURE_GL)
double wallMs() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// [ms] of all threads.
double processMs() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}
#endif

double pass(const Relighter& relighter, std::string_view name) {
  for (const PassTime& each : relighter.passTimes()) {
    if (each.pass == name) return each.ms;
  }
  return 0.0;
}

struct Ball {
  glm::vec3 centre;
  float radius;
  const MovingShapes& shapes;
};

// now: [ms] when all that was asked for is done.
void measure(const char* name, const Bake& bake, const RelightOptions& options, const Ball& ball, int frames,
             const std::function<double()>& now) {
  Relighter relighter = orExit(Relighter::create(bake, options));
  Light light;
  light.positionWorld = ball.centre + glm::vec3(0.0f, 4.0f * ball.radius, 0.0f);
  LightSetup setup;
  setup.lights = {&light, 1};
  double least[2] = {1e9, 1e9}, caches = 1e9, parts = 1e9;
  for (int frame = 0; frame < frames; ++frame) {
    for (const bool with : {false, true}) {
      MovingPart part;
      part.toWorld[3] = ball.centre + 0.1f * ball.radius * std::sin(0.3f * static_cast<float>(frame));
      setup.movingShapes = &ball.shapes;
      setup.movingParts = {&part, with ? 1u : 0u};
      const double begin = now();
      if (Status ok = relighter.relight(setup); !ok) {
        std::fprintf(stderr, "%s\n", ok.error().message.c_str());
        std::exit(1);
      }
      least[with] = std::min(least[with], now() - begin);
      if (frame < 4) continue;  // of OpenGL, times of frames that are still under way
      if (with) parts = std::min(parts, pass(relighter, "moving parts"));
      if (!with) caches = std::min(caches, pass(relighter, "caches"));
    }
  }
  std::printf(
      "%s: frame %.3f ms without, %.3f with: %.0f %% of the cache pass, %.3f ms; pass \"moving parts\" %.3f ms\n", name,
      least[0], least[1], 100.0 * (least[1] - least[0]) / caches, caches, parts);
}

}  // namespace

int main(int argc, char** argv) {
  glm::vec3 centre;
  if (argc < 4 || std::sscanf(argv[2], "%f,%f,%f", &centre.x, &centre.y, &centre.z) != 3) {
    std::fprintf(stderr, "bench_moving_cost BAKE X,Y,Z RADIUS [FRAMES]\n");
    return 2;
  }
  const auto radius = static_cast<float>(std::atof(argv[3]));
  const int frames = argc > 4 ? std::max(std::atoi(argv[4]), 5) : 100;
  const Bake bake = orExit(readBake(argv[1]));
  const test::Ball triangles(radius, 32);
  const glm::vec3 grey(0.5f);
  const MovingMesh mesh{triangles.position, triangles.triangle, {&grey, 1}, {}};
  const MovingShapes shapes = orExit(MovingShapes::create({&mesh, 1}));
  std::printf("%u caches, %u links, %zu bytes a shape\n", bake.caches.count(), bake.links.count(), shapes.bytes());
  const Ball ball{centre, radius, shapes};
  RelightOptions options;
  options.movingParts = 1;
  measure("CPU", bake, options, ball, frames, processorMs);
#if defined(RELUME_MEASURE_GL)
  const Result<EglContext> context = EglContext::create({});
  if (!context) return 0;
  options.backend = BackendKind::gl;
  options.getProcAddress = EglContext::getProcAddress;
  const std::string_view renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  std::printf("%s\n", renderer.data());
  const bool isSoftware = renderer.find("pipe") != std::string_view::npos;
  measure("OpenGL", bake, options, ball, frames, [&] {
    glFinish();
    return isSoftware ? processMs() : wallMs();
  });
#endif
  return 0;
}
