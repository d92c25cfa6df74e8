// SPDX-License-Identifier: MIT
// What reads of the grid cost by each kind of look-up, and what its texture costs to make and to fill, on one CPU
// thread and in OpenGL: least of some frames. Receivers are spread around the grid's caches. Prints a table of
// docs/notes/vectors.md.
//   bench_grid_read_times BAKE.relume [frames [receivers]]
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "tests/bench/receiver_pass.h"
#include "tools/gl_scene/egl_context.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>
#include <string>
#include <vector>

namespace relume {
namespace {

constexpr std::array<std::pair<GridLookup, const char*>, 3> kLookups{
    {{GridLookup::stencil, "Grid"}, {GridLookup::texture, "GridTexture"}, {GridLookup::smooth, "GridSmooth"}}};

struct Receivers {
  std::vector<glm::vec3> positions, normals;
};

// Runs within a tenth of the finest spacing, up to a quarter of it from a cache; any normal.
Receivers makeReceivers(const Caches& caches, std::size_t count) {
  const std::uint32_t end = caches.firstMapCache();
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  std::normal_distribution<float> gauss;
  Receivers receivers;
  glm::vec3 middle(0.0f);
  for (std::size_t i = 0; i < count && end > 0; ++i) {
    const glm::vec3 offset(uniform(random), uniform(random), uniform(random));
    if (i % 64 == 0) {
      middle = caches.positionWorld[static_cast<std::uint32_t>(random()) % end] +
               0.25f * caches.grid.finestSpacing() * offset;
    }
    receivers.positions.push_back(middle + 0.05f * caches.grid.finestSpacing() * offset);
    receivers.normals.push_back(glm::normalize(glm::vec3(gauss(random), gauss(random), gauss(random))));
  }
  return receivers;
}

struct Times {
  double createMs = 1e9, fillMs = 1e9;
  std::array<double, 3> readNs{1e9, 1e9, 1e9};
};

// [ms] of the processor since `begin`: other programs do not count.
double msSince(std::clock_t begin) { return 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC; }

Result<Relighter> make(const Bake& bake, RelightOptions options, Times& times) {
  const auto plain = std::clock();
  const Result<Relighter> without = Relighter::create(bake, options);
  const double plainMs = msSince(plain);
  options.gridTexture = true;
  const auto begin = std::clock();
  Result<Relighter> relighter = Relighter::create(bake, options);
  times.createMs = std::max(msSince(begin) - plainMs, 0.0);
  return relighter;
}

Status light(Relighter& relighter, Times& times) {
  std::array<Light, 1> lights;
  lights[0].kind = LightKind::directional;
  LightSetup setup;
  setup.lights = lights;
  if (Status ok = relighter.relight(setup); !ok) return ok;
  if (relighter.backend() == BackendKind::gl) glFinish();
  times.fillMs = std::min(times.fillMs, relighter.passTimes().back().ms);
  return done();
}

Result<Times> measureCpu(const Bake& bake, float trust, const Receivers& receivers, int frames) {
  Times times;
  RelightOptions options;
  options.gridTrust = trust;
  Result<Relighter> relighter = make(bake, options, times);
  if (!relighter) return relighter.error();
  std::vector<glm::vec3> found(receivers.positions.size());
  for (int frame = 0; frame < frames; ++frame) {
    if (Status ok = light(*relighter, times); !ok) return ok.error();
    for (std::size_t k = 0; k < kLookups.size(); ++k) {
      const auto begin = std::clock();
      if (Status ok = relighter->irradianceInGrid(receivers.positions, receivers.normals, found, kLookups[k].first);
          !ok)
        return ok.error();
      times.readNs[k] = std::min(times.readNs[k], 1e6 * msSince(begin) / static_cast<double>(found.size()));
    }
  }
  return times;
}

Result<Times> measureGl(const Bake& bake, float trust, const Receivers& receivers, int frames) {
  Times times;
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.getProcAddress = EglContext::getProcAddress;
  options.gridTrust = trust;
  Result<Relighter> relighter = make(bake, options, times);
  if (!relighter) return relighter.error();
  std::vector<bench::Receiver> in;
  for (std::size_t i = 0; i < receivers.positions.size(); ++i)
    in.push_back({glm::vec4(receivers.positions[i], 0.0f), glm::vec4(receivers.normals[i], 0.0f)});
  for (std::size_t k = 0; k < kLookups.size(); ++k) {
    const std::string lookup = std::string("relumeIrradiance") + kLookups[k].second + "(a.xyz, b.xyz)";
    auto pass = bench::ReceiverPass::create(*relighter, lookup, in);
    if (!pass) return pass.error();
    for (int frame = 0; frame < frames; ++frame) {
      if (Status ok = light(*relighter, times); !ok) return ok.error();
      times.readNs[k] = std::min(times.readNs[k], 1e6 * pass->run() / static_cast<double>(in.size()));
    }
  }
  return times;
}

int print(const char* where, float trust, const Result<Times>& times) {
  if (!times) return std::fprintf(stderr, "%s\n", times.error().message.c_str()), 1;
  std::printf("| %s, trust %.2f | %.0f | %.2f | %.0f | %.0f | %.0f |\n", where, static_cast<double>(trust),
              times->createMs, times->fillMs, times->readNs[0], times->readNs[1], times->readNs[2]);
  std::fflush(stdout);
  return 0;
}

int run(const char* file, int frames, std::size_t count) {
  const Result<Bake> bake = readBake(file);
  if (!bake) return std::fprintf(stderr, "%s\n", bake.error().message.c_str()), 1;
  const Receivers receivers = makeReceivers(bake->caches, count);
  if (receivers.positions.empty()) return std::fprintf(stderr, "%s has no grid\n", file), 1;
  std::printf(
      "| | create ms | fill ms | caches around, ns | texture, ns | smooth, ns |\n"
      "|---|---:|---:|---:|---:|---:|\n");
  const Result<EglContext> context = EglContext::create();
  for (const float trust : {1.0f, RelightOptions{}.gridTrust}) {
    if (print("CPU, one thread", trust, measureCpu(*bake, trust, receivers, frames))) return 1;
    if (context && print(context->renderer().c_str(), trust, measureGl(*bake, trust, receivers, frames))) return 1;
  }
  if (!context) std::printf("\nno OpenGL: %s\n", context.error().message.c_str());
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "usage: bench_grid_read_times BAKE.relume [frames [receivers]]\n"), 1;
  return relume::run(argv[1], argc > 2 ? std::atoi(argv[2]) : 10,
                     argc > 3 ? static_cast<std::size_t>(std::atoi(argv[3])) : 57600);
}
