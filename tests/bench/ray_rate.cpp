// SPDX-License-Identifier: MIT
// How fast the rays of a bake's caches are traced: in packets, with a thorough structure of Embree's, and as bundles;
// and how many of them hit another triangle. Prints the table of docs/notes/tracing.md, millions of rays a second on
// all cores.
//   bench_ray_rate LEVEL.glb BAKE.relume [every n-th run of caches [repeats]]
#include "bake/base/parallel.h"
#include "bake/links/directions.h"
#include "bake/rays/bundle/ray_bundle.h"
#include "relume/bake/context.h"
#include "relume/bake_file.h"

#include <glm/common.hpp>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <thread>
#include <vector>

namespace relume {
namespace {

constexpr std::uint32_t kRun = 16;  // caches that lie beside each other, as a bake traces them
constexpr std::uint32_t kRays[] = {256, 512, 1024, 4096, 16384, 65536};

struct Origin {
  std::uint32_t cache;
  glm::vec3 positionWorld, normal;
};

// Rays as the links' stage casts them.
void castFrom(const Origin& origin, const DirectionStrata& strata, std::vector<glm::vec3>& directions) {
  DirectionStrata::Sequence sequence(strata, origin.normal, RandomStream(0, 1, origin.cache));
  DirectionStrata::Sample block[DirectionStrata::kBlock];
  directions.clear();
  while (directions.size() < strata.count()) {
    sequence.next(block);
    for (const DirectionStrata::Sample& sample : block) directions.push_back(sample.direction);
  }
}

// Seconds, least of some runs, for work(origin, directions, hits) at all origins; directions are not counted.
template <class Work>
double secondsOf(Context& context, const std::vector<Origin>& origins, const DirectionStrata& strata, int repeats,
                 const Work& work) {
  double min = std::numeric_limits<double>::infinity();
  for (int repeat = 0; repeat < repeats; ++repeat) {
    std::atomic<std::int64_t> nanoseconds{0};
    parallelChunks(context, "", origins.size(), kRun, [&](std::size_t begin, std::size_t end) {
      std::vector<glm::vec3> directions;
      std::vector<Hit> hits(strata.count());
      for (std::size_t i = begin; i < end; ++i) {
        castFrom(origins[i], strata, directions);
        const auto start = std::chrono::steady_clock::now();
        work(origins[i], directions, hits);
        nanoseconds += std::chrono::nanoseconds(std::chrono::steady_clock::now() - start).count();
      }
    });
    min = std::min(min, 1e-9 * static_cast<double>(nanoseconds));
  }
  return min / std::max(context.threads, 1);
}

int run(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: %s LEVEL.glb BAKE.relume [every n-th run of caches [repeats]]\n", argv[0]);
    return 2;
  }
  Context context;
  const auto fail = [](const Error& error) {
    std::fprintf(stderr, "%s\n", error.message.c_str());
    return 1;
  };
  const auto scene = importGltf(argv[1], context);
  if (!scene) return fail(scene.error());
  const auto bake = readBake(argv[2]);
  if (!bake) return fail(bake.error());
  const auto packets = RayTracer::create(*scene, "avx2", context, RayStructure::thorough);
  if (!packets) return fail(packets.error());
  const auto bundles = RayTracer::create(*scene, "avx2", context, RayStructure::bundles);
  if (!bundles) return fail(bundles.error());
  const auto step = static_cast<std::uint32_t>(std::max(1, argc > 3 ? std::atoi(argv[3]) : 8));
  const int repeats = std::max(1, argc > 4 ? std::atoi(argv[4]) : 3);
  context.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));

  std::vector<Origin> origins;
  for (std::uint32_t c = 0; c < bake->caches.count(); ++c) {
    if (c / kRun % step != 0) continue;
    const glm::vec3 position = bake->caches.positionWorld[c], normal = bake->caches.normal[c];
    origins.push_back({c, position + normal * bundles->epsilonAt(position), normal});
  }
  std::printf(
      "%zu caches, %d threads\n\n| rays a cache | packets | bundles | | another triangle "
      "|\n|---:|---:|---:|---:|---:|\n",
      origins.size(), context.threads);
  for (const std::uint32_t rays : kRays) {
    const DirectionStrata strata(rays);
    const double total = static_cast<double>(strata.count()) * static_cast<double>(origins.size()) * 1e-6;
    const double alone = secondsOf(context, origins, strata, repeats, [&](const Origin& o, auto& to, auto& hits) {
      thread_local std::vector<Ray> packet;
      packet.clear();
      for (const glm::vec3& direction : to) packet.push_back({o.positionWorld, 0.0f, direction});
      packets->trace(packet, hits, RayOrder::coherent);
    });
    const double together = secondsOf(context, origins, strata, repeats, [&](const Origin& o, auto& to, auto& hits) {
      thread_local RayBundle bundle;
      bundle.trace(*bundles, o.positionWorld, o.normal, to, hits);
    });
    std::atomic<std::uint64_t> others{0};
    secondsOf(context, origins, strata, 1, [&](const Origin& o, auto& to, auto& hits) {
      RayBundle().trace(*bundles, o.positionWorld, o.normal, to, hits);
      std::vector<Ray> packet;
      for (const glm::vec3& direction : to) packet.push_back({o.positionWorld, 0.0f, direction});
      std::vector<Hit> expected(packet.size());
      packets->trace(packet, expected, RayOrder::coherent);
      for (std::size_t i = 0; i < hits.size(); ++i) {
        others += hits[i].instance != expected[i].instance || hits[i].triangle != expected[i].triangle;
      }
    });
    std::printf("| %u | %.1f | %.1f | x %.2f | %.1f of a million |\n", strata.count(), total / alone, total / together,
                alone / together, static_cast<double>(others) / total);
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) { return relume::run(argc, argv); }
