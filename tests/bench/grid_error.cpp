// SPDX-License-Identifier: MIT
// How far light that moving receivers read from the grid is from path-traced light, for grids of several kinds and sizes:
// points of the play space with random normals, the level's own lights. Prints the tables of docs/GRID.md.
//   bench_grid_error LEVEL.glb LIGHTS|emissive [RECEIVERS [PATHS [SURFELS]]]
#include "bake/bake.h"
#include "bake/random.h"
#include "bake/reference/path_tracer.h"
#include "bake/scene/play_space.h"
#include "bake/scene/ray_tracer.h"
#include "bake/parallel.h"
#include "runtime/cpu/resolve.h"
#include "runtime/relighter.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

namespace relume {
namespace {

constexpr float kPi = 3.14159265f;

struct Receiver {
  glm::vec3 position, normal;
  std::array<glm::vec3, 2> half;  // [W/m²] irradiance by each half of the paths
  glm::vec3 truth() const { return 0.5f * (half[0] + half[1]); }
};

glm::vec3 sphereDirection(const glm::vec2& u) {
  const float z = 1.0f - 2.0f * u.x, r = std::sqrt(std::max(0.0f, 1.0f - z * z));
  return {r * std::cos(2.0f * kPi * u.y), r * std::sin(2.0f * kPi * u.y), z};
}

glm::vec3 cosineDirection(const glm::vec3& n, const glm::vec2& u) {
  const glm::vec3 d = n + 0.9999f * sphereDirection(u);
  return glm::normalize(d);
}

struct Level {
  const Scene& scene;
  const RayTracer& tracer;
  std::vector<SceneLight> lights;
  bool emissive = false;
};

// Radiance that comes along a ray, by paths with light drawn at every vertex; emitters are met by chance.
glm::vec3 radiance(const Level& level, glm::vec3 origin, glm::vec3 direction, RandomStream& random) {
  glm::vec3 sum(0.0f), throughput(1.0f);
  for (int bounce = 0; bounce < 10; ++bounce) {
    const Hit hit = level.tracer.trace({origin, 0.0f, direction});
    if (!hit) break;
    const SurfacePoint p = hit.point();
    const Instance& instance = level.scene.instances[p.instance];
    const auto c = level.scene.corners(instance, p.triangle);
    glm::vec3 n = geometricNormal(level.scene, p);
    if (level.emissive && (!hit.back || level.scene.material(instance).doubleSided)) sum += throughput * emissionAt(level.scene, p);
    if (hit.back) n = -n;
    origin = c[0] + (c[1] - c[0]) * p.barycentric.x + (c[2] - c[0]) * p.barycentric.y;
    origin += n * level.tracer.epsilonAt(origin);
    throughput *= albedoAt(level.scene, p);
    if (!level.lights.empty()) sum += throughput / kPi * directIrradiance(level.tracer, level.lights, origin, n);
    direction = cosineDirection(n, random.uniform2());
    if (bounce > 3) {
      const float keep = std::min(0.9f, std::max({throughput.x, throughput.y, throughput.z}));
      if (random.uniform() >= keep) break;
      throughput /= keep;
    }
  }
  return sum;
}

std::vector<Receiver> traceReceivers(const Level& level, const PlaySpace& playSpace, std::size_t count, int paths, Context& context) {
  std::vector<Receiver> receivers(count);
  parallelChunks(context, "", count, 4, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      RandomStream random(11, 0x67726964, i);
      Receiver& r = receivers[i];
      r.position = playSpace.receivers[i * playSpace.receivers.size() / count];
      r.normal = sphereDirection(random.uniform2());
      for (glm::vec3& half : r.half) {
        glm::vec3 sum(0.0f);
        for (int k = 0; k < paths / 2; ++k) sum += radiance(level, r.position, cosineDirection(r.normal, random.uniform2()), random);
        half = kPi * sum / static_cast<float>(paths / 2);
      }
    }
  });
  return receivers;
}

struct Figures {
  double rmse = 0.0, trimmed = 0.0, energy = 0.0, tooBright = 0.0;
};

// Relative to the mean square of the truth, its noise removed; trimmed: without the worst 1 % of receivers. tooBright: the
// mean excess over receivers that have less than a tenth of the mean light, over that mean.
Figures compare(const std::vector<Receiver>& receivers, const Caches& caches, const cpu::CacheLight& light) {
  std::vector<double> error;
  double square = 0.0, noise = 0.0, sum = 0.0, truth = 0.0, mean = 0.0, excess = 0.0, dark = 0.0;
  for (const Receiver& r : receivers) mean += static_cast<double>(r.truth().y) / static_cast<double>(receivers.size());
  for (const Receiver& r : receivers) {
    const glm::vec3 e = cpu::irradianceInGrid(caches, light, r.position, r.normal), d = e - r.truth(), n = 0.5f * (r.half[0] - r.half[1]);
    error.push_back(static_cast<double>(glm::dot(d, d)));
    noise += static_cast<double>(glm::dot(n, n));
    square += static_cast<double>(glm::dot(r.truth(), r.truth()));
    sum += static_cast<double>(e.x + e.y + e.z);
    truth += static_cast<double>(r.truth().x + r.truth().y + r.truth().z);
    if (static_cast<double>(r.truth().y) < 0.1 * mean) {
      excess += std::max(0.0f, d.y);
      dark += 1.0;
    }
  }
  std::sort(error.begin(), error.end());
  double total = 0.0, kept = 0.0;
  for (std::size_t i = 0; i < error.size(); ++i) {
    total += error[i];
    if (static_cast<double>(i) < 0.99 * static_cast<double>(error.size())) kept += error[i];
  }
  return {std::sqrt(std::max(0.0, total - noise) / square), std::sqrt(std::max(0.0, kept - noise) / square), sum / truth,
          dark > 0.0 ? excess / dark / mean : 0.0};
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
  Level level{*scene, *tracer, {}, lights == "emissive"};
  for (const SceneLight& light : scene->lights) {
    if (("," + lights + ",").find("," + light.name + ",") != std::string::npos) level.lights.push_back(light);
  }
  const std::vector<Receiver> receivers = traceReceivers(level, *playSpace, count, paths, context);

  std::vector<GridKind> kinds{{"uniform, small", {12, 5, 8}, 0}, {"uniform, 24 x 8 x 12", {24, 8, 12}, 0}, {"uniform, large", {40, 15, 24}, 0}};
  for (const std::uint32_t n : {300u, 1150u, 2304u, 8192u}) kinds.push_back({"two levels, about " + std::to_string(n), {}, n});
  std::printf("\n%s, %s: %zu receivers, %d paths each\n", scene->name.c_str(), lights.c_str(), receivers.size(), paths);
  std::printf("\n| grid | caches | bytes | RMSE %% | t1 %% | energy | dark excess %% | without visibility: RMSE %% | t1 %% | energy | dark excess %% |\n"
              "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|\n");
  for (const GridKind& kind : kinds) {
    options.caches.gridResolution = kind.resolution;
    options.caches.gridCaches = kind.count;
    Context quiet;
    auto baked = bake(*scene, options, quiet);
    if (!baked) return std::fprintf(stderr, "%s\n", baked.error().message.c_str()), 1;
    std::vector<glm::vec3> direct(baked->surfels.count(), glm::vec3(0.0f));
    for (std::size_t s = 0; s < direct.size(); ++s) {
      const glm::vec3 p = baked->surfels.positionWorld[s], n = baked->surfels.normal[s];
      if (!level.lights.empty()) direct[s] = directIrradiance(*tracer, level.lights, p + n * tracer->epsilonAt(p), n);
    }
    auto relighter = Relighter::create(*baked, {});
    if (!relighter) return std::fprintf(stderr, "%s\n", relighter.error().message.c_str()), 1;
    LightSetup setup;
    setup.surfelIrradiance = direct;
    setup.emissionScale = glm::vec3(level.emissive ? 1.0f : 0.0f);
    relightUntilConverged(*relighter, setup);
    const std::vector<float> coefficients = relighter->cacheCoefficients();
    const cpu::CacheLight light{relighter->lumaBands(), relighter->chromaBands(), coefficients, baked->links.kind == LinkKind::irradiance};
    const CacheGrid& grid = baked->caches.grid;
    const auto gridCaches = std::count(baked->caches.normal.begin(), baked->caches.normal.end(), glm::vec3(0.0f));
    const std::size_t bytes = 4 * (grid.cache.size() + grid.brick.size() + grid.fine.size() + grid.depth.size());
    const Figures with = compare(receivers, baked->caches, light);
    Caches blind = baked->caches;
    blind.grid.depth = {};
    const Figures without = compare(receivers, blind, light);
    std::printf("| %s | %td | %zu | %.1f | %.1f | %.3f | %.1f | %.1f | %.1f | %.3f | %.1f |\n", kind.name.c_str(), gridCaches, bytes, 100 * with.rmse,
                100 * with.trimmed, with.energy, 100 * with.tooBright, 100 * without.rmse, 100 * without.trimmed, without.energy, 100 * without.tooBright);
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 3) return std::fprintf(stderr, "usage: bench_grid_error LEVEL.glb LIGHTS|emissive [RECEIVERS [PATHS [SURFELS]]]\n"), 1;
  const auto number = [&](int i, int otherwise) { return argc > i ? std::atoi(argv[i]) : otherwise; };
  return relume::measure(argv[1], argv[2], static_cast<std::size_t>(number(3, 1000)), number(4, 1024), static_cast<std::uint32_t>(number(5, 65536)));
}
