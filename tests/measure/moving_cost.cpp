// SPDX-License-Identifier: MIT
// What a moving ball costs a frame: the least milliseconds of processor time without it and with it, of many frames in
// which the two take turns and the ball goes on a little, beside the cache pass alone.
//
//   bench_moving_cost BAKE X,Y,Z RADIUS [FRAMES]     (one thread; metres)
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "tests/measure/or_exit.h"
#include "tests/runtime/ball.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
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

double pass(const Relighter& relighter, std::string_view name) {
  for (const PassTime& each : relighter.passTimes()) {
    if (each.pass == name) return each.ms;
  }
  return 0.0;
}

}  // namespace

int main(int argc, char** argv) {
  glm::vec3 centre;
  if (argc < 4 || std::sscanf(argv[2], "%f,%f,%f", &centre.x, &centre.y, &centre.z) != 3) {
    std::fprintf(stderr, "bench_moving_cost BAKE X,Y,Z RADIUS [FRAMES]\n");
    return 2;
  }
  const auto radius = static_cast<float>(std::atof(argv[3]));
  const int frames = argc > 4 ? std::atoi(argv[4]) : 100;
  const Bake bake = orExit(readBake(argv[1]));
  RelightOptions options;
  options.movingParts = 1;
  Relighter relighter = orExit(Relighter::create(bake, options));
  const test::Ball ball(radius, 32);
  const glm::vec3 grey(0.5f);
  const MovingMesh mesh{ball.position, ball.triangle, {&grey, 1}, {}};
  const MovingShapes shapes = orExit(MovingShapes::create({&mesh, 1}));
  std::printf("%zu bytes a shape\n", shapes.bytes());
  Light light;
  light.positionWorld = centre + glm::vec3(0.0f, 4.0f * radius, 0.0f);
  LightSetup setup;
  setup.lights = {&light, 1};
  double least[2] = {1e9, 1e9}, caches = 1e9, parts = 1e9;
  for (int frame = 0; frame < frames; ++frame) {
    for (const bool with : {false, true}) {
      MovingPart part;
      part.toWorld[3] = centre + 0.1f * radius * std::sin(0.3f * static_cast<float>(frame));
      setup.movingShapes = &shapes;
      setup.movingParts = {&part, with ? 1u : 0u};
      const double begin = processorMs();
      if (Status ok = relighter.relight(setup); !ok) {
        std::fprintf(stderr, "%s\n", ok.error().message.c_str());
        return 1;
      }
      least[with] = std::min(least[with], processorMs() - begin);
      if (with) parts = std::min(parts, pass(relighter, "moving parts"));
      if (!with) caches = std::min(caches, pass(relighter, "caches"));
    }
  }
  std::printf(
      "%u caches, %u links: frame %.3f ms without, %.3f with: %.0f %% of the cache pass, %.3f ms; of that its own "
      "light %.3f ms\n",
      bake.caches.count(), bake.links.count(), least[0], least[1], 100.0 * (least[1] - least[0]) / caches, caches,
      parts);
  return 0;
}
