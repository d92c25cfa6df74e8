// SPDX-License-Identifier: MIT
// PIC Table 3: milliseconds of cache lighting and resolve for every pair of luma and chroma bands, least of some
// frames, on one CPU thread and in OpenGL, beside the paper's. Prints a table of docs/notes/bands.md.
//   bench_band_times BAKE.relume [frames [receivers]]
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "runtime/shared/bands.h"
#include "tests/bench/receiver_pass.h"
#include "tools/gl_scene/egl_context.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

namespace relume {
namespace {

// PIC Table 3, GTX 980: rows chroma 2..8, columns luma 2..8.
constexpr double kPaper[7][7] = {{2.48, 2.69, 2.95, 3.59, 3.78, 4.50, 5.35},
                                 {0, 3.21, 3.41, 4.01, 4.07, 5.22, 5.83},
                                 {0, 0, 3.33, 4.14, 4.39, 5.35, 6.31},
                                 {0, 0, 0, 4.69, 5.67, 6.26, 6.78},
                                 {0, 0, 0, 0, 5.95, 6.94, 7.80},
                                 {0, 0, 0, 0, 0, 7.61, 11.89},
                                 {0, 0, 0, 0, 0, 0, 10.35}};

// A point of the light map and a normal 35 degrees off its cache's: both forms of the lobe would be needed nowhere, all
// bands everywhere.
struct Receiver {
  glm::vec2 uv;
  glm::vec3 normal;
};

std::vector<Receiver> makeReceivers(const Caches& caches, std::size_t count) {
  const Lightmap& map = caches.lightmap;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  std::vector<std::uint32_t> filled;
  for (std::uint32_t t = 0; t < map.cache.size(); ++t) {
    if (map.cache[t] != kNoCache) filled.push_back(t);
  }
  std::vector<Receiver> receivers;
  while (!filled.empty() && receivers.size() < count) {
    const std::uint32_t t = filled[receivers.size() * filled.size() / count];
    const glm::vec3 m = caches.normal[map.cache[t]];
    const glm::vec3 side =
        glm::normalize(glm::cross(m, std::abs(m.x) < 0.5f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0)));
    receivers.push_back({{(static_cast<float>(t % map.width) + uniform(random)) / static_cast<float>(map.width),
                          (static_cast<float>(t / map.width) + uniform(random)) / static_cast<float>(map.height)},
                         glm::normalize(m + 0.7f * side)});
  }
  return receivers;
}

LightSetup someLight(std::array<Light, 1>& lights) {
  lights[0].kind = LightKind::directional;
  LightSetup setup;
  setup.lights = lights;
  return setup;
}

double passMs(const Relighter& relighter, const std::string& pass) {
  for (const PassTime& each : relighter.passTimes()) {
    if (pass == each.pass) return each.ms;
  }
  return 0.0;
}

struct Times {
  double caches = 1e9, resolve = 1e9;
};

Result<Times> measureCpu(const Bake& bake, const Bands& bands, const std::vector<Receiver>& receivers, int frames) {
  RelightOptions options;
  options.lumaBands = bands.luma;
  options.chromaBands = bands.chroma;
  Result<Relighter> relighter = Relighter::create(bake, options);
  if (!relighter) return relighter.error();
  std::array<Light, 1> lights;
  const LightSetup setup = someLight(lights);
  Times times;
  glm::vec3 sum(0.0f);
  for (int frame = 0; frame < frames; ++frame) {
    if (Status ok = relighter->relight(setup); !ok) return ok.error();
    times.caches = std::min(times.caches, passMs(*relighter, "caches"));
    const auto begin = std::chrono::steady_clock::now();
    for (const Receiver& r : receivers) sum += relighter->irradianceOnLightmap(r.uv, r.normal);
    const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
    times.resolve = std::min(times.resolve, ms);
  }
  if (!(sum.x >= 0.0f)) return Error{ErrorCode::failed, "light that is no number"};
  return times;
}

Result<Times> measureGl(const Bake& bake, const Bands& bands, const std::vector<Receiver>& receivers, int frames) {
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.getProcAddress = EglContext::getProcAddress;
  options.lumaBands = bands.luma;
  options.chromaBands = bands.chroma;
  Result<Relighter> relighter = Relighter::create(bake, options);
  if (!relighter) return relighter.error();
  std::vector<bench::Receiver> in;
  for (const Receiver& r : receivers) in.push_back({glm::vec4(r.uv, 0.0f, 0.0f), glm::vec4(r.normal, 0.0f)});
  auto pass = bench::ReceiverPass::create(*relighter, "relumeIrradianceLightmap(a.xy, b.xyz)", in);
  if (!pass) return pass.error();
  std::array<Light, 1> lights;
  const LightSetup setup = someLight(lights);
  Times times;
  for (int frame = 0; frame < frames; ++frame) {
    if (Status ok = relighter->relight(setup); !ok) return ok.error();
    glFinish();
    times.caches = std::min(times.caches, passMs(*relighter, "caches"));
    times.resolve = std::min(times.resolve, pass->run());
  }
  return times;
}

template <class Measure>
int table(const char* title, const Measure& measure) {
  std::printf("\n%s:\n\n| chroma \\ luma |", title);
  for (int luma = 1; luma <= 8; ++luma) std::printf(" %d |", luma);
  std::printf("\n|---|---:|---:|---:|---:|---:|---:|---:|---:|");
  for (int chroma = 1; chroma <= 8; ++chroma) {
    std::printf("\n| %d |", chroma);
    for (int luma = 1; luma <= 8; ++luma) {
      if (luma < chroma) {
        std::printf(" |");
        continue;
      }
      const Result<Times> times = measure(Bands{luma, chroma});
      if (!times) return std::fprintf(stderr, "%s\n", times.error().message.c_str()), 1;
      std::printf(" %.2f + %.2f |", times->caches, times->resolve);
      std::fflush(stdout);
    }
  }
  std::printf("\n");
  return 0;
}

int run(const char* file, int frames, std::size_t count) {
  const Result<Bake> bake = readBake(file);
  if (!bake) return std::fprintf(stderr, "%s\n", bake.error().message.c_str()), 1;
  const std::vector<Receiver> receivers = makeReceivers(bake->caches, count);
  std::printf("%u caches, %u links, %zu receivers; caches + resolve, ms, least of %d frames\n", bake->caches.count(),
              bake->links.count(), receivers.size(), frames);
  if (table("CPU, one thread", [&](const Bands& bands) { return measureCpu(*bake, bands, receivers, frames); }))
    return 1;
  const Result<EglContext> context = EglContext::create();
  if (!context) {
    std::printf("\nno OpenGL: %s\n", context.error().message.c_str());
  } else if (table(context->renderer().c_str(),
                   [&](const Bands& bands) { return measureGl(*bake, bands, receivers, frames); })) {
    return 1;
  }
  std::printf(
      "\nPIC Table 3 (GTX 980), caches + shading:\n\n| chroma \\ luma | 2 | 3 | 4 | 5 | 6 | 7 | 8 "
      "|\n|---|---:|---:|---:|---:|---:|---:|---:|\n");
  for (int chroma = 2; chroma <= 8; ++chroma) {
    std::printf("| %d |", chroma);
    for (int luma = 2; luma <= 8; ++luma)
      luma < chroma ? std::printf(" |") : std::printf(" %.2f |", kPaper[chroma - 2][luma - 2]);
    std::printf("\n");
  }
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "usage: bench_band_times BAKE.relume [frames [receivers]]\n"), 1;
  return relume::run(argv[1], argc > 2 ? std::atoi(argv[2]) : 10,
                     argc > 3 ? static_cast<std::size_t>(std::atoi(argv[3])) : 57600);
}
