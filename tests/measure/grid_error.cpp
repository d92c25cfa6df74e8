// SPDX-License-Identifier: MIT
// How far light that moving receivers read from the grid is from path-traced light, for grids of several kinds and
// sizes: points of the play space with random normals, the level's own lights. Prints the tables of docs/notes/grid.md,
// and of docs/notes/vectors.md those of the grid's texture.
//   bench_grid_error LEVEL.glb LIGHTS|emissive [RECEIVERS [PATHS [SURFELS]]]
#include "bake/base/parallel.h"
#include "bake/rays/ray_tracer.h"
#include "bake/visibility/play_space.h"
#include "relume/bake/bake.h"
#include "relume/relighter.h"
#include "runtime/shared/resolve.h"
#include "tests/measure/traced_light.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace relume {
namespace {

using test::errorOf, test::lightsNamed, test::shadowedLight, test::sphereDirection, test::traceIrradiance,
    test::TracedError;
using Receiver = test::TracedReceiver;
using Level = test::TracedLevel;

std::vector<Receiver> traceReceivers(const Level& level, const PlaySpace& playSpace, std::size_t count, int paths,
                                     Context& context) {
  std::vector<Receiver> receivers(count);
  parallelChunks(context, "", count, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      RandomStream random(11, 0x67726964, i);
      Receiver& r = receivers[i];
      r.position = playSpace.receivers[i * playSpace.receivers.size() / count];
      r.normal = sphereDirection(random.uniform2());
      traceIrradiance(level, paths, random, r);
    }
  });
  return receivers;
}

struct Figures : TracedError {
  double tooBright = 0.0;
};

// tooBright: the mean excess over receivers that have less than a tenth of the mean light, over that mean.
template <class Read>
Figures compare(const std::vector<Receiver>& receivers, const Read& read) {
  std::vector<glm::vec3> found;
  double mean = 0.0, excess = 0.0, dark = 0.0;
  for (const Receiver& r : receivers) mean += static_cast<double>(r.truth().y) / static_cast<double>(receivers.size());
  for (const Receiver& r : receivers) {
    found.push_back(read(r.position, r.normal));
    if (static_cast<double>(r.truth().y) < 0.1 * mean) {
      excess += std::max(0.0f, found.back().y - r.truth().y);
      dark += 1.0;
    }
  }
  return {errorOf(receivers, found), dark > 0.0 ? excess / dark / mean : 0.0};
}

struct GridKind {
  std::string name;
  glm::uvec3 resolution{0};
  std::uint32_t count = 0;
};

int measure(const std::string& path, const std::string& lights, std::size_t count, int paths, std::uint32_t surfels) {
  Context context;
  auto scene = importGltf(path, context);
  if (!scene) return std::fprintf(stderr, "%s\n", scene.error().message.c_str()), 1;
  auto tracer = RayTracer::create(*scene, "avx2", context);
  if (!tracer) return std::fprintf(stderr, "%s\n", tracer.error().message.c_str()), 1;
  BakeOptions options;
  options.surfels.count = surfels;
  auto playSpace = findPlaySpace(*tracer, options.playSpace, options.seed, context);
  if (!playSpace) return std::fprintf(stderr, "%s\n", playSpace.error().message.c_str()), 1;
  const Level level{*scene, *tracer, lightsNamed(*scene, lights), lights == "emissive"};
  const std::vector<Receiver> receivers = traceReceivers(level, *playSpace, count, paths, context);

  std::vector<GridKind> kinds{
      {"uniform, small", {12, 5, 8}, 0}, {"uniform, 24 x 8 x 12", {24, 8, 12}, 0}, {"uniform, large", {40, 15, 24}, 0}};
  for (const std::uint32_t n : {300u, 1150u, 2304u, 8192u})
    kinds.push_back({"two levels, about " + std::to_string(n), {}, n});
  std::printf("\n%s, %s: %zu receivers, %d paths each\n", scene->name.c_str(), lights.c_str(), receivers.size(), paths);
  std::printf(
      "\n| grid | caches | bytes | RMSE %% | t1 %% | energy | dark excess %% | without visibility: RMSE %% | t1 %% | "
      "energy | dark excess %% |\n"
      "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n");
  for (const GridKind& kind : kinds) {
    options.caches.gridResolution = kind.resolution;
    options.caches.gridCaches = kind.count;
    Context quiet;
    auto baked = bake(*scene, options, quiet);
    if (!baked) return std::fprintf(stderr, "%s\n", baked.error().message.c_str()), 1;
    const std::vector<glm::vec3> direct = shadowedLight(level, baked->surfels);
    RelightOptions relight;
    relight.gridTexture = true;
    auto relighter = Relighter::create(*baked, relight);
    if (!relighter) return std::fprintf(stderr, "%s\n", relighter.error().message.c_str()), 1;
    LightSetup setup;
    setup.surfelIrradiance = direct;
    setup.emissionScale = glm::vec3(level.emissive ? 1.0f : 0.0f);
    if (const auto lit = relightUntilConverged(*relighter, setup); !lit)
      return std::fprintf(stderr, "%s\n", lit.error().message.c_str()), 1;
    const std::vector<float> coefficients = relighter->cacheCoefficients();
    const CacheLight light{
        {relighter->lumaBands(), relighter->chromaBands(), baked->links.kind == LinkKind::irradiance}, coefficients};
    const CacheGrid& grid = baked->caches.grid;
    const auto gridCaches = std::count(baked->caches.normal.begin(), baked->caches.normal.end(), glm::vec3(0.0f));
    const std::size_t bytes = 4 * (grid.cache.size() + grid.brick.size() + grid.fine.size() + grid.depth.size());
    const auto figures = [&](const Caches& caches) {
      return compare(receivers,
                     [&](const glm::vec3& p, const glm::vec3& n) { return irradianceInGrid(caches, light, p, n); });
    };
    const Figures with = figures(baked->caches);
    Caches blind = baked->caches;
    blind.grid.depth = {};
    const Figures without = figures(blind);
    std::printf("| %s | %td | %zu | %.1f | %.1f | %.3f | %.1f | %.1f | %.1f | %.3f | %.1f |\n", kind.name.c_str(),
                gridCaches, bytes, 100 * with.rmse, 100 * with.trimmed, with.energy, 100 * with.tooBright,
                100 * without.rmse, 100 * without.trimmed, without.energy, 100 * without.tooBright);
    // Both kinds of texture reads, for several degrees of trust.
    for (const float trust : {0.25f, RelightOptions{}.gridTrust, 1.0f}) {
      relight.gridTrust = trust;
      auto textured = Relighter::create(*baked, relight);
      if (!textured) return std::fprintf(stderr, "%s\n", textured.error().message.c_str()), 1;
      if (const auto lit = relightUntilConverged(*textured, setup); !lit)
        return std::fprintf(stderr, "%s\n", lit.error().message.c_str()), 1;
      const GridTextureInfo info = textured->gridTexture();
      constexpr std::pair<GridLookup, const char*> kLookups[] = {
          {GridLookup::stencil, "caches around"}, {GridLookup::texture, "texture"}, {GridLookup::smooth, "smooth"}};
      for (const auto& [lookup, name] : kLookups) {
        // The same whatever the trust; with what two bands lack guessed, as the texture has it.
        if (lookup == GridLookup::stencil && trust != 1.0f) continue;
        const Figures f = compare(receivers, [&, by = lookup](const glm::vec3& p, const glm::vec3& n) {
          return textured->irradianceInGrid(p, n, by);
        });
        std::printf(
            "| - %s, trust %.2f: %.0f %% open | | | %.1f | %.1f | %.3f | %.1f | | | | |\n", name,
            static_cast<double>(trust),
            100.0 * static_cast<double>(info.openCells) / static_cast<double>(std::max<std::size_t>(info.cells, 1)),
            100 * f.rmse, 100 * f.trimmed, f.energy, 100 * f.tooBright);
      }
    }
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 3)
    return std::fprintf(stderr, "usage: bench_grid_error LEVEL.glb LIGHTS|emissive [RECEIVERS [PATHS [SURFELS]]]\n"), 1;
  const auto number = [&](int i, int otherwise) { return argc > i ? std::atoi(argv[i]) : otherwise; };
  return relume::measure(argv[1], argv[2], static_cast<std::size_t>(number(3, 1000)), number(4, 1024),
                         static_cast<std::uint32_t>(number(5, 65536)));
}
