// SPDX-License-Identifier: MIT
// Caches with directions against caches of irradiance alone, many of them: error of indirect light on surfaces, time
// and memory of the runtime, from 8192 to 131072 caches on the light map. Receivers are surfels that read the light
// map, spread evenly over its area, against path-traced light. Prints a table of docs/notes/links.md.
//   bench_cache_error LEVEL.glb LIGHTS[;LIGHTS..] [RECEIVERS [PATHS [SURFELS [LINKS [RAYS [MOST_CACHES]]]]]]
#include "bake/base/parallel.h"
#include "formats/pack.h"
#include "relume/bake/bake.h"
#include "relume/relighter.h"
#include "tests/measure/traced_light.h"

#include <cstdio>
#include <cstdlib>
#include <optional>
#include <sstream>

namespace relume {
namespace {

using test::errorOf, test::lightsNamed, test::shadowedLight, test::traceIrradiance, test::TracedError,
    test::TracedLevel, test::TracedReceiver;

struct Sizes {
  std::size_t receivers;
  int paths;
  std::uint32_t surfels, links, rays, maxCaches;
};

// Surfels whose light comes from the light map, every so many.
std::vector<std::uint32_t> chooseSurfels(const Surfels& surfels, std::size_t wanted) {
  std::vector<std::uint32_t> mapped, chosen;
  for (std::uint32_t s = 0; s < surfels.count(); ++s) {
    if (surfels.receiver[s] != kGridReceiver) mapped.push_back(s);
  }
  for (std::size_t i = 0; i < wanted; ++i) chosen.push_back(mapped[i * mapped.size() / wanted]);
  return chosen;
}

std::vector<TracedReceiver> traceReceivers(const TracedLevel& level, const Surfels& surfels,
                                           std::span<const std::uint32_t> chosen, int paths, Context& context) {
  std::vector<TracedReceiver> receivers(chosen.size());
  parallelChunks(context, "", receivers.size(), 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t s = chosen[i];
      receivers[i].normal = surfels.normal[s];
      receivers[i].position =
          surfels.positionWorld[s] + surfels.normal[s] * level.tracer.epsilonAt(surfels.positionWorld[s]);
      RandomStream random(13, 0x63616368, i);
      traceIrradiance(level, paths, random, receivers[i]);
    }
  });
  return receivers;
}

// Receivers under each lighting. Left out: where no light arrives, buried in another surface, which nobody sees.
void chooseReceivers(const std::vector<TracedLevel>& levels, const Surfels& surfels, const Sizes& sizes,
                     Context& context, std::vector<std::uint32_t>& chosen,
                     std::vector<std::vector<TracedReceiver>>& receivers) {
  const std::vector<std::uint32_t> candidates = chooseSurfels(surfels, sizes.receivers);
  std::vector<std::vector<TracedReceiver>> traced;
  for (const TracedLevel& level : levels)
    traced.push_back(traceReceivers(level, surfels, candidates, sizes.paths, context));
  receivers.resize(levels.size());
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const auto isLit = [i](const std::vector<TracedReceiver>& all) { return all[i].truth() != glm::vec3(0.0f); };
    if (!std::any_of(traced.begin(), traced.end(), isLit)) continue;
    chosen.push_back(candidates[i]);
    for (std::size_t k = 0; k < levels.size(); ++k) receivers[k].push_back(traced[k][i]);
  }
}

// Error of converged light.
std::optional<TracedError> lightError(const Bake& bake, const TracedLevel& level, std::span<const std::uint32_t> chosen,
                                      std::span<const TracedReceiver> receivers) {
  auto relighter = Relighter::create(bake, {});
  if (!relighter) return std::nullopt;
  const std::vector<glm::vec3> direct = shadowedLight(level, bake.surfels);
  LightSetup setup;
  setup.surfelIrradiance = direct;
  setup.emissionScale = glm::vec3(0.0f);
  if (!relightUntilConverged(*relighter, setup)) return std::nullopt;
  std::vector<glm::vec3> found;
  for (const std::uint32_t s : chosen) {
    const std::uint32_t at = bake.surfels.receiver[s];
    const glm::vec3 n = bake.surfels.normal[s];
    found.push_back(at == kGridReceiver ? relighter->irradianceInGrid(bake.surfels.positionWorld[s], n)
                                        : relighter->irradianceOnLightmap(unpackUnorm16x2(at), n));
  }
  return errorOf(receivers, found);
}

struct Cost {
  double cachesMs = 0.0, frameMs = 0.0, linksMiB = 0.0, allMiB = 0.0;
};

// On one thread, under a sun and a spot light with bounces; the least of some frames.
std::optional<Cost> costOf(const Bake& bake) {
  RelightOptions options;
  options.surfelArrays = false;
  auto relighter = Relighter::create(bake, options);
  if (!relighter) return std::nullopt;
  std::array<Light, 2> lights;
  lights[0].kind = LightKind::directional;
  lights[1].kind = LightKind::spot;
  lights[1].positionWorld = bake.caches.positionWorld[0];
  LightSetup setup;
  setup.lights = lights;
  Cost cost{1e9, 1e9};
  for (int frame = 0; frame < 60; ++frame) {
    if (!relighter->relight(setup)) return std::nullopt;
    if (frame < 4) continue;
    double all = 0.0;
    for (const PassTime& pass : relighter->passTimes()) {
      all += pass.ms;
      if (std::string_view(pass.pass) == "caches") cost.cachesMs = std::min(cost.cachesMs, pass.ms);
    }
    cost.frameMs = std::min(cost.frameMs, all);
  }
  for (const auto& [buffer, bytes] : relighter->bufferSizes()) {
    const double mib = static_cast<double>(bytes) / (1 << 20);
    cost.allMiB += mib;
    if (buffer == "links") cost.linksMiB = mib;
  }
  return cost;
}

int measure(const std::string& path, const std::string& lightings, const Sizes& sizes) {
  Context context;
  auto scene = importGltf(path, context);
  if (!scene) return std::fprintf(stderr, "%s\n", scene.error().message.c_str()), 1;
  auto tracer = RayTracer::create(*scene, "avx2", context);
  if (!tracer) return std::fprintf(stderr, "%s\n", tracer.error().message.c_str()), 1;
  std::vector<TracedLevel> levels;
  std::stringstream names(lightings);
  std::printf("\n| n_C | kind | links | links, MiB | all, MiB | (4), ms | (2) to (4), ms |");
  for (std::string each; std::getline(names, each, ';');) {
    levels.push_back({*scene, *tracer, lightsNamed(*scene, each), false});
    std::printf(" %s: RMSE %% | energy |", each.c_str());
  }
  std::printf("\n|---:|---|---:|---:|---:|---:|---:|");
  for (std::size_t i = 0; i < 2 * levels.size(); ++i) std::printf("---:|");
  std::printf("\n");
  BakeOptions options = presetOptions(Preset::high);
  options.surfels.count = sizes.surfels;
  options.links.linksPerCache = options.links.maxLinksPerCache = sizes.links;
  options.links.raysPerCache = sizes.rays;
  std::vector<std::uint32_t> chosen;
  std::vector<std::vector<TracedReceiver>> receivers;
  for (std::uint32_t caches = 8192; caches <= sizes.maxCaches; caches *= 2) {
    for (const LinkKind kind : {LinkKind::oct6, LinkKind::irradiance}) {
      options.caches.lightmapCaches = caches;
      options.links.kind = kind;
      Context quiet;
      auto baked = bake(*scene, options, quiet);
      if (!baked) return std::fprintf(stderr, "%s\n", baked.error().message.c_str()), 1;
      // All bakes have the same surfels.
      if (chosen.empty()) chooseReceivers(levels, baked->surfels, sizes, quiet, chosen, receivers);
      const auto cost = costOf(*baked);
      if (!cost) return 1;
      std::printf("| %u | %s | %u | %.1f | %.1f | %.2f | %.2f |", baked->caches.count(),
                  kind == LinkKind::oct6 ? "oct6" : "irradiance", baked->links.count(), cost->linksMiB, cost->allMiB,
                  cost->cachesMs, cost->frameMs);
      for (std::size_t i = 0; i < levels.size(); ++i) {
        const auto error = lightError(*baked, levels[i], chosen, receivers[i]);
        if (!error) return 1;
        std::printf(" %.1f | %.3f |", 100 * error->rmse, error->energy);
      }
      std::printf("\n");
      std::fflush(stdout);
    }
  }
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 3)
    return std::fprintf(stderr,
                        "usage: bench_cache_error LEVEL.glb LIGHTS[;LIGHTS..] [RECEIVERS [PATHS [SURFELS [LINKS [RAYS "
                        "[MOST_CACHES]]]]]]\n"),
           1;
  const auto number = [&](int i, int otherwise) {
    return static_cast<std::uint32_t>(argc > i ? std::atoi(argv[i]) : otherwise);
  };
  return relume::measure(argv[1], argv[2],
                         {number(3, 2000), static_cast<int>(number(4, 1024)), number(5, 131072), number(6, 96),
                          number(7, 1024), number(8, 131072)});
}
