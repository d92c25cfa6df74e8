// SPDX-License-Identifier: MIT
// What a moving ball costs a frame: milliseconds without it and with it, the least mean of 16 frames in a
// row in which the ball goes on a little, beside the cache pass alone. Of the CPU backend on one thread,
// processor time; of OpenGL, where there is some, wall clock from relight() until the driver has done. With all near
// caches looked at in every frame (lag 1), and in turns. Then, for a ball that goes 1 m/s at 60 frames a second, how
// far light in turns is from light of all: squared difference of the map's coefficients as a share of what the ball
// changes of them.
//
//   bench_moving_cost BAKE X,Y,Z RADIUS [FRAMES [EMISSION]]     (metres; W/m²/sr)
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
#include <initializer_list>
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

// Relighters of a bake, and a setup with a lamp above the ball.
struct Frames {
  Frames(const Bake& bake, const RelightOptions& options, const Ball& ball, std::initializer_list<std::uint32_t> lags)
      : ball_(ball) {
    light_.positionWorld = ball.centre + glm::vec3(0.0f, 4.0f * ball.radius, 0.0f);
    RelightOptions own = options;
    for (const std::uint32_t lag : lags) {
      own.movingLag = lag;
      relighter.push_back(orExit(Relighter::create(bake, own)));
    }
  }

  void relight(std::size_t index, const glm::vec3& move, bool with) {
    MovingPart part;
    part.toWorld[3] = ball_.centre + move;
    LightSetup setup;
    setup.lights = {&light_, 1};
    setup.movingShapes = &ball_.shapes;
    setup.movingParts = {&part, with ? 1u : 0u};
    if (Status ok = relighter[index].relight(setup); !ok) {
      std::fprintf(stderr, "%s\n", ok.error().message.c_str());
      std::exit(1);
    }
  }

  std::vector<Relighter> relighter;

 private:
  const Ball& ball_;
  Light light_;
};

// now: [ms] when all that was asked for is done.
void measure(const char* name, const Bake& bake, const RelightOptions& options, const Ball& ball, int frames,
             const std::function<double()>& now) {
  constexpr int kMean = 16, kFirst = 4;  // kFirst: of OpenGL, times of frames that are still under way
  Frames each(bake, options, ball, {1, options.movingLag});
  double least[2] = {1e9, 1e9}, caches = 1e9, parts = 1e9;
  for (int run = 0; run * kMean < frames; ++run) {
    double sum[2] = {};
    for (const bool with : {false, true}) {
      for (int frame = 0; frame < kMean; ++frame) {
        const glm::vec3 move(0.1f * ball.radius * std::sin(0.3f * static_cast<float>(run * kMean + frame)));
        const double begin = now();
        each.relight(with, move, with);
        sum[with] += now() - begin;
        if (run == 0 && frame < kFirst) continue;
        if (with) parts = std::min(parts, pass(each.relighter[1], "moving parts"));
        if (!with) caches = std::min(caches, pass(each.relighter[0], "caches"));
      }
    }
    // The first frame with a part looks at all near caches.
    if (run == 0) continue;
    for (const bool with : {false, true}) least[with] = std::min(least[with], sum[with] / kMean);
  }
  std::printf(
      "%s, lag %u: frame %.3f ms without, %.3f with: %.0f %% of the cache pass, %.3f ms; pass \"moving parts\" %.3f "
      "ms\n",
      name, options.movingLag, least[0], least[1], 100.0 * (least[1] - least[0]) / caches, caches, parts);
}

// Of a ball that goes 1 m/s at 60 frames a second.
void measureLag(const Bake& bake, const RelightOptions& options, const Ball& ball) {
  constexpr int kFrames = 60, kFirst = 20;
  Frames each(bake, options, ball, {1, 1, options.movingLag});
  double error = 0.0, all = 0.0;
  for (int frame = 0; frame < kFrames; ++frame) {
    const glm::vec3 move(static_cast<float>(frame - (kFrames + kFirst) / 2) / 60.0f, 0.0f, 0.0f);
    std::vector<float> light[3];
    for (std::size_t k = 0; k < 3; ++k) {
      each.relight(k, move, k > 0);
      if (frame >= kFirst) light[k] = each.relighter[k].cacheCoefficients();
    }
    for (std::size_t i = bake.caches.firstMapCache() * each.relighter[0].coefficientsPerCache(); i < light[0].size();
         ++i) {
      const double change = double{light[1][i]} - light[0][i], wrong = double{light[2][i]} - light[1][i];
      all += change * change;
      error += wrong * wrong;
    }
  }
  std::printf("1 m/s at 60 Hz, lag %u: %.2f %% of the squared change is missed\n", options.movingLag,
              100.0 * error / all);
}

}  // namespace

int main(int argc, char** argv) {
  glm::vec3 centre;
  if (argc < 4 || std::sscanf(argv[2], "%f,%f,%f", &centre.x, &centre.y, &centre.z) != 3) {
    std::fprintf(stderr, "bench_moving_cost BAKE X,Y,Z RADIUS [FRAMES [EMISSION]]\n");
    return 2;
  }
  const auto radius = static_cast<float>(std::atof(argv[3]));
  const int frames = argc > 4 ? std::max(std::atoi(argv[4]), 17) : 96;
  const Bake bake = orExit(readBake(argv[1]));
  const test::Ball triangles(radius, 32);
  const glm::vec3 grey(0.5f), emission(argc > 5 ? static_cast<float>(std::atof(argv[5])) : 0.0f);
  const MovingMesh mesh{triangles.position, triangles.triangle, {&grey, 1}, {&emission, 1}};
  const MovingShapes shapes = orExit(MovingShapes::create({&mesh, 1}));
  std::printf("%u caches, %u links, %zu bytes a shape\n", bake.caches.count(), bake.links.count(), shapes.bytes());
  const Ball ball{centre, radius, shapes};
  RelightOptions options;
  options.movingParts = 1;
  const std::uint32_t lag = options.movingLag;
  for (const std::uint32_t each : {1u, lag}) {
    options.movingLag = each;
    measure("CPU", bake, options, ball, frames, processorMs);
  }
  measureLag(bake, options, ball);
#if defined(RELUME_MEASURE_GL)
  const Result<EglContext> context = EglContext::create({});
  if (!context) return 0;
  options.backend = BackendKind::gl;
  options.getProcAddress = EglContext::getProcAddress;
  const std::string_view renderer = reinterpret_cast<const char*>(glGetString(GL_RENDERER));
  std::printf("%s\n", renderer.data());
  const bool isSoftware = renderer.find("pipe") != std::string_view::npos;
  for (const std::uint32_t each : {1u, lag}) {
    options.movingLag = each;
    measure("OpenGL", bake, options, ball, frames, [&] {
      glFinish();
      return isSoftware ? processMs() : wallMs();
    });
  }
#endif
  return 0;
}
