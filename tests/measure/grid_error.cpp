// SPDX-License-Identifier: MIT
// How far light that moving receivers read from the grid is from path-traced light, for grids of several kinds and
// sizes: points of the play space with random normals, the level's own lights. Prints the tables of docs/notes/grid.md,
// and of docs/notes/vectors.md those of the grid's texture and, with --bytes, of bases at equal bytes.
//   bench_grid_error [--bytes] LEVEL.glb LIGHTS|emissive [RECEIVERS [PATHS [SURFELS]]]
#include "formats/color.h"
#include "relume/relighter.h"
#include "runtime/cpu/grid_vectors.h"
#include "runtime/shared/resolve.h"
#include "tests/measure/grid_receivers.h"
#include "tests/measure/spline_prefilter.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory_resource>
#include <string>
#include <utility>

namespace relume::test {
namespace {

struct GridKind {
  std::string name;
  glm::uvec3 resolution{0};
  std::uint32_t count = 0;
};

bool fail(const Error& error) { return std::fprintf(stderr, "%s\n", error.message.c_str()), false; }

// What the spline through the texture's points would give, at some degree of trust.
GridFigures prefiltered(const PackedCaches& caches, const CacheLight& light, float trust,
                        const std::vector<TracedReceiver>& receivers) {
  std::pmr::memory_resource* memory = std::pmr::get_default_resource();
  GridTextureLimits limits;
  limits.trust = trust;
  cpu::GridVectors vectors(makeGridTexture(caches, limits, {}, memory), memory);
  vectors.fill(light, {});
  std::vector<float> spline(vectors.texels().begin(), vectors.texels().end());
  prefilterSpline(spline, vectors.texture().resolution, 6 * kTexelFloats);
  return compareReceivers(receivers, [&](const glm::vec3& p, const glm::vec3& n) {
    const auto read = readGridTexture(vectors.texture(), spline, p, n, true);
    return read ? *read : irradianceInGrid(caches, light, p, n);
  });
}

}  // namespace

bool printGridKinds(const GridLevel& opened, const std::string& lights) {
  const TracedLevel& level = *opened.level;
  const std::vector<TracedReceiver>& receivers = opened.receivers;
  BakeOptions options = opened.options;
  std::vector<GridKind> kinds{
      {"uniform, small", {12, 5, 8}, 0}, {"uniform, 24 x 8 x 12", {24, 8, 12}, 0}, {"uniform, large", {40, 15, 24}, 0}};
  for (const std::uint32_t n : {300u, 1150u, 2304u, 8192u})
    kinds.push_back({"two levels, about " + std::to_string(n), {}, n});
  std::printf("\n%s, %s: %zu receivers\n", level.scene.name.c_str(), lights.c_str(), receivers.size());
  std::printf(
      "\n| grid | caches | bytes | RMSE %% | t1 %% | energy | dark excess %% | without visibility: RMSE %% | t1 %% | "
      "energy | dark excess %% |\n"
      "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n");
  for (const GridKind& kind : kinds) {
    options.caches.gridResolution = kind.resolution;
    options.caches.gridCaches = kind.count;
    Context quiet;
    auto baked = bake(level.scene, options, quiet);
    if (!baked) return fail(baked.error());
    const std::vector<glm::vec3> direct = shadowedLight(level, baked->surfels);
    RelightOptions relight;
    relight.gridTexture = true;
    auto relighter = Relighter::create(*baked, relight);
    if (!relighter) return fail(relighter.error());
    LightSetup setup;
    setup.surfelIrradiance = direct;
    setup.emissionScale = glm::vec3(level.emissive ? 1.0f : 0.0f);
    if (const auto lit = relightUntilConverged(*relighter, setup); !lit) return fail(lit.error());
    const std::vector<float> coefficients = relighter->cacheCoefficients();
    const CacheLight light{
        {relighter->lumaBands(), relighter->chromaBands(), baked->links.kind == LinkKind::irradiance}, coefficients};
    const CacheGrid& grid = baked->caches.grid;
    const auto gridCaches = std::count(baked->caches.normal.begin(), baked->caches.normal.end(), glm::vec3(0.0f));
    const std::size_t bytes = 4 * (grid.cache.size() + grid.brick.size() + grid.fine.size() + grid.depth.size());
    const auto figures = [&](const Caches& placed) {
      const PackedCaches caches(placed, std::pmr::new_delete_resource());
      return compareReceivers(
          receivers, [&](const glm::vec3& p, const glm::vec3& n) { return irradianceInGrid(caches, light, p, n); });
    };
    const GridFigures with = figures(baked->caches);
    Caches blind = baked->caches;
    blind.grid.depth = {};
    const GridFigures without = figures(blind);
    std::printf("| %s | %td | %zu | %.1f | %.1f | %.3f | %.1f | %.1f | %.1f | %.3f | %.1f |\n", kind.name.c_str(),
                gridCaches, bytes, 100 * with.rmse, 100 * with.trimmed, with.energy, 100 * with.tooBright,
                100 * without.rmse, 100 * without.trimmed, without.energy, 100 * without.tooBright);
    // Both kinds of texture reads, for several degrees of trust.
    for (const float trust : {0.25f, RelightOptions{}.gridTrust, 1.0f}) {
      relight.gridTrust = trust;
      auto textured = Relighter::create(*baked, relight);
      if (!textured) return fail(textured.error());
      if (const auto lit = relightUntilConverged(*textured, setup); !lit) return fail(lit.error());
      const GridTextureInfo info = textured->gridTexture();
      constexpr std::pair<GridLookup, const char*> kLookups[] = {
          {GridLookup::stencil, "caches around"}, {GridLookup::texture, "texture"}, {GridLookup::smooth, "smooth"}};
      for (const auto& [lookup, name] : kLookups) {
        // The same whatever the trust; with what two bands lack guessed, as the texture has it.
        if (lookup == GridLookup::stencil && trust != 1.0f) continue;
        const GridFigures f = compareReceivers(receivers, [&, by = lookup](const glm::vec3& p, const glm::vec3& n) {
          return textured->irradianceInGrid(p, n, by);
        });
        std::printf(
            "| - %s, trust %.2f: %.0f %% open | | | %.1f | %.1f | %.3f | %.1f | | | | |\n", name,
            static_cast<double>(trust),
            100.0 * static_cast<double>(info.openCells) / static_cast<double>(std::max<std::size_t>(info.cells, 1)),
            100 * f.rmse, 100 * f.trimmed, f.energy, 100 * f.tooBright);
      }
      CacheLight guessing = light;
      guessing.guessBands = true;
      const GridFigures f =
          prefiltered(PackedCaches(baked->caches, std::pmr::new_delete_resource()), guessing, trust, receivers);
      std::printf("| - smooth, prefiltered, trust %.2f | | | %.1f | %.1f | %.3f | %.1f | | | | |\n",
                  static_cast<double>(trust), 100 * f.rmse, 100 * f.trimmed, f.energy, 100 * f.tooBright);
    }
    std::fflush(stdout);
  }
  return true;
}

namespace {

int measure(bool bytes, const GridRequest& request) {
  Context context;
  const auto opened = openGridLevel(request, context);
  if (!opened) return fail(opened.error()), 1;
  return (bytes ? printEqualBytes(*opened, request.lights) : printGridKinds(*opened, request.lights)) ? 0 : 1;
}

}  // namespace
}  // namespace relume::test

int main(int argc, char** argv) {
  const bool bytes = argc > 1 && std::strcmp(argv[1], "--bytes") == 0;
  const int first = bytes ? 2 : 1;
  if (argc < first + 2) {
    return std::fprintf(stderr,
                        "usage: bench_grid_error [--bytes] LEVEL.glb LIGHTS|emissive [RECEIVERS [PATHS [SURFELS]]]\n"),
           1;
  }
  const auto number = [&](int i, int otherwise) { return argc > first + i ? std::atoi(argv[first + i]) : otherwise; };
  return relume::test::measure(bytes, {argv[first], argv[first + 1], static_cast<std::size_t>(number(2, 1000)),
                                       number(3, 1024), static_cast<std::uint32_t>(number(4, 65536))});
}
