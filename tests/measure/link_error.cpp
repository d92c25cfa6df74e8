// SPDX-License-Identifier: MIT
// What the kinds of links cost in error, bytes and time, on the same links of one level. Prints the table of
// docs/notes/links.md.
//   bench_link_error SH.relume CONE.relume [repetitions]
// Two bakes of one scene by the same options and seed but --link-kind sh (4 bands) and cone. The other kinds are packed
// from these. Light: a sun, a point light and three bounces, then all else is still.
#include "formats/compact_links.h"
#include "formats/sh.h"
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "runtime/cpu/light_caches.h"
#include "runtime/shared/pack_color.h"
#include "tests/measure/or_exit.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <numeric>
#include <string>
#include <vector>

namespace relume {
namespace {

constexpr int kBands = 4;
constexpr std::size_t kStride = 3 * kBands * kBands;

// Radiosity of all nodes under some light.
std::vector<std::uint32_t> lightNodes(const Bake& bake) {
  Relighter relighter = orExit(Relighter::create(bake, {}));
  std::vector<Light> lights(2);
  lights[0] = {.kind = LightKind::directional,
               .intensity = glm::vec3(30, 28, 25),
               .direction = glm::normalize(glm::vec3(0.3f, -1, 0.2f))};
  lights[1] = {.kind = LightKind::point,
               .intensity = glm::vec3(40, 20, 5),
               .positionWorld = bake.caches.positionWorld[bake.caches.count() / 3]};
  LightSetup setup;
  setup.lights = lights;
  for (int frame = 0; frame < 4; ++frame) {
    if (!relighter.relight(setup)) return {};
  }
  std::vector<std::uint32_t> nodes;
  for (const glm::vec3& rgb : relighter.nodeRadiosity()) nodes.push_back(packColor(rgb, 0.5f));
  return nodes;
}

struct Measured {
  std::vector<float> coefficients;
  double ms = 0.0;  // least of the repetitions, CPU time of one thread
};

Measured measure(const Links& links, const std::vector<std::uint32_t>& nodes, int repetitions) {
  Measured m;
  m.coefficients.resize(links.cacheCount() * kStride);
  m.ms = 1e30;
  const LinkSet set(links, std::pmr::new_delete_resource());
  StoredLight light({kBands, kBands}, links.cacheCount(), links.cacheCount(), std::pmr::new_delete_resource());
  const auto now = [] {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e3 * static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_nsec);
  };
  for (int i = 0; i < repetitions; ++i) {
    const double start = now();
    cpu::lightCaches(cpu::lightCachesKernel(Simd::best), set, nodes, light, {});
    m.ms = std::min(m.ms, now() - start);
  }
  for (std::uint32_t cache = 0; cache < links.cacheCount(); ++cache)
    light.read(cache, &m.coefficients[cache * kStride]);
  return m;
}

double percentile(std::vector<double> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct Error2 {
  std::vector<double> links, caches, irradiance;  // relative
};

// Distances of coefficients, relative to the size of the exact ones: of every 7th link, and of every cache's light; and
// of surface caches' irradiance.
Error2 compare(const Bake& bake, const Links& exact, const Links& links, const std::vector<float>& want,
               const std::vector<float>& found) {
  Error2 e;
  std::array<float, kMaxCoefficients> a, b;
  std::uint32_t cache = 0;
  for (std::uint32_t i = 0; i < exact.count(); i += 7) {
    while (exact.rowBegin[cache + 1] <= i) ++cache;
    const bool surface = bake.caches.normal[cache] != glm::vec3(0.0f);
    if (links.kind == LinkKind::irradiance && surface) continue;
    linkCoefficients(exact, i, surface, kBands, a);
    linkCoefficients(links, i, surface, kBands, b);
    double error = 0.0, square = 0.0;
    for (std::size_t k = 0; k < kBands * kBands; ++k) {
      error += (a[k] - b[k]) * (a[k] - b[k]);
      square += a[k] * a[k];
    }
    if (square > 0.0) e.links.push_back(std::sqrt(error / square));
  }
  for (std::uint32_t c = 0; c < exact.cacheCount(); ++c) {
    const glm::vec3 n = bake.caches.normal[c];
    const std::span<const float> x(&want[c * kStride], kStride), y(&found[c * kStride], kStride);
    if (n != glm::vec3(0.0f)) {
      const float truth = irradianceLinear(x, n);
      const float read = links.kind == LinkKind::irradiance ? 1.7724538509f * y[0] : irradianceLinear(y, n);
      if (truth > 0.0f) e.irradiance.push_back(std::abs(read - truth) / truth);
    }
    if (links.kind == LinkKind::irradiance && n != glm::vec3(0.0f)) continue;
    double error = 0.0, square = 0.0;
    for (std::size_t k = 0; k < kBands * kBands; ++k) {
      error += (x[k] - y[k]) * (x[k] - y[k]);
      square += x[k] * x[k];
    }
    if (square > 0.0) e.caches.push_back(std::sqrt(error / square));
  }
  return e;
}

int run(int argc, char** argv) {
  const int repetitions = argc > 3 ? std::atoi(argv[3]) : 50;
  Bake sh = orExit(readBake(argv[1]));
  const Bake cone = orExit(readBake(argv[2]));
  const std::pair<const char*, Links> kinds[] = {
      {"sh", sh.links},
      {"cone", cone.links},
      {"oct6", orExit(compactLinks(sh.links))},
      {"irradiance", orExit(irradianceLinks(sh.caches, sh.links, cone.links))}};
  const std::vector<std::uint32_t> nodes = lightNodes(sh);
  const Measured exact = measure(sh.links, nodes, 1);
  std::printf("n_S %u, n_C %u (%.0f %% on the light map), %u links\n\n", sh.surfels.count(), sh.caches.count(),
              100.0 - 100.0 * static_cast<double>(countGridLinks(sh.caches, sh.links)) / sh.links.count(),
              sh.links.count());
  std::printf(
      "| kind | bytes a link | MiB | link error %%: median | p95 | L_SH error %%: median | p95 | irradiance error %%: "
      "median "
      "| p95 | ms, one thread |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& [name, links] : kinds) {
    const double bytes = 4.0 * static_cast<double>(links.shNode.size() + links.head.size() + links.shape.size()) +
                         2.0 * static_cast<double>(links.shCoefficients.size()) +
                         12.0 * static_cast<double>(links.cone.size());
    const Measured m = measure(links, nodes, repetitions);
    const Error2 e = compare(sh, sh.links, links, exact.coefficients, m.coefficients);
    std::printf("| %s | %.1f | %.1f | %.2f | %.2f | %.3f | %.3f | %.3f | %.3f | %.2f |\n", name, bytes / links.count(),
                bytes / 1048576.0, 100 * percentile(e.links, 0.5), 100 * percentile(e.links, 0.95),
                100 * percentile(e.caches, 0.5), 100 * percentile(e.caches, 0.95), 100 * percentile(e.irradiance, 0.5),
                100 * percentile(e.irradiance, 0.95), m.ms);
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s SH.relume CONE.relume [repetitions]\n", argv[0]);
    return 1;
  }
  return relume::run(argc, argv);
}
