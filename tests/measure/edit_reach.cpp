// SPDX-License-Identifier: MIT
// How many caches of a bake see a node: those whose links an edit of that node must change. Prints rows of
// docs/notes/store.md.
//   bench_edit_reach LEVEL.glb BAKE.relume NODE [RAYS]
// Traces the rays of every cache as the baker does. A cache sees a node if a ray ends on it; it also counts as near if
// a ray passes the node's box, as it is or grown to whole cells of so many metres, which is what a key of cells can
// tell.
#include "bake/base/parallel.h"
#include "bake/base/place_number.h"
#include "bake/links/directions.h"
#include "bake/rays/ray_tracer.h"
#include "relume/bake/context.h"
#include "relume/bake/load_scene.h"
#include "relume/bake_file.h"
#include "tests/measure/or_exit.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtx/component_wise.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

namespace relume {
namespace {

constexpr std::array<float, 4> kCells = {0.0f, 0.5f, 1.0f, 2.0f};  // [m] 0 = the box itself

struct Box {
  glm::vec3 low{INFINITY}, high{-INFINITY};

  Box grownTo(float cell) const {
    if (cell <= 0.0f) return *this;
    return {glm::floor(low / cell) * cell, glm::ceil(high / cell) * cell};
  }
  bool meets(const Ray& ray, float length) const {
    const glm::vec3 a = (low - ray.origin) / ray.direction, b = (high - ray.origin) / ray.direction;
    return std::max(glm::compMax(glm::min(a, b)), 0.0f) <= std::min(glm::compMin(glm::max(a, b)), length);
  }
};

struct Reach {
  std::uint32_t rays = 0;                    // that end on the node
  std::array<bool, kCells.size()> passes{};  // whether any passes the box
};

Box boxOf(const Scene& scene, std::uint32_t index) {
  const Instance& instance = scene.instances[index];
  Box box;
  for (const glm::vec3& local : scene.meshes[instance.mesh].position) {
    const glm::vec3 world(instance.toWorld * glm::vec4(local, 1.0f));
    box.low = glm::min(box.low, world);
    box.high = glm::max(box.high, world);
  }
  return box;
}

Reach reachOf(const RayTracer& tracer, const DirectionStrata& strata, const Caches& caches, std::uint32_t cache,
              const std::vector<bool>& ofNode, const std::array<Box, kCells.size()>& boxes) {
  const glm::vec3 position = caches.positionWorld[cache], normal = caches.normal[cache];
  const glm::vec3 origin = position + normal * tracer.epsilonAt(position);
  DirectionStrata::Sequence sequence(strata, normal, RandomStream(1, 0x72656163, placeNumber(position, normal)));
  std::array<DirectionStrata::Sample, DirectionStrata::kBlock> samples;
  std::array<Ray, DirectionStrata::kBlock> rays;
  std::array<Hit, DirectionStrata::kBlock> hits;
  Reach reach;
  for (std::uint32_t first = 0; first < strata.count(); first += DirectionStrata::kBlock) {
    sequence.next(samples);
    for (std::size_t i = 0; i < rays.size(); ++i) rays[i] = {origin, 0.0f, samples[i].direction};
    tracer.trace(rays, hits);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (hits[i] && ofNode[hits[i].instance]) ++reach.rays;
      for (std::size_t k = 0; k < boxes.size(); ++k)
        reach.passes[k] = reach.passes[k] || boxes[k].meets(rays[i], hits[i].distance);
    }
  }
  return reach;
}

int run(const std::string& level, const std::string& file, const std::string& node, std::uint32_t rays) {
  Context context;
  const Scene scene = orExit(loadScene(level, context));
  const RayTracer tracer = orExit(RayTracer::create(scene, "", context));
  const Bake bake = orExit(readBake(file));
  std::vector<bool> ofNode(scene.instances.size());
  Box box;
  for (std::uint32_t i = 0; i < scene.instances.size(); ++i) {
    if (scene.instances[i].node != node) continue;
    ofNode[i] = true;
    const Box own = boxOf(scene, i);
    box = {glm::min(box.low, own.low), glm::max(box.high, own.high)};
  }
  if (!(box.low.x <= box.high.x)) {
    std::fprintf(stderr, "%s: no node \"%s\"\n", level.c_str(), node.c_str());
    return 1;
  }
  std::array<Box, kCells.size()> boxes;
  for (std::size_t k = 0; k < boxes.size(); ++k) boxes[k] = box.grownTo(kCells[k]);

  const DirectionStrata strata(rays);
  std::vector<Reach> reach(bake.caches.count());
  parallelChunks(context, "", reach.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      reach[i] = reachOf(tracer, strata, bake.caches, static_cast<std::uint32_t>(i), ofNode, boxes);
  });

  const double all = static_cast<double>(reach.size());
  double see = 0.0, ended = 0.0;
  for (const Reach& each : reach) {
    see += each.rays > 0;
    ended += each.rays;
  }
  std::printf("%s, node \"%s\", %zu caches, %u rays each\n", level.c_str(), node.c_str(), reach.size(), strata.count());
  std::printf("  %.1f %% of the caches have a ray that ends on it; %.3f %% of the rays do\n", 100.0 * see / all,
              100.0 * ended / all / strata.count());
  for (std::size_t k = 0; k < boxes.size(); ++k) {
    const auto passed = std::count_if(reach.begin(), reach.end(), [k](const Reach& each) { return each.passes[k]; });
    std::printf("  %.1f %% have one that passes its box in cells of %.1f m\n",
                100.0 * static_cast<double>(passed) / all, static_cast<double>(kCells[k]));
  }
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 4 || argc > 5) {
    std::fprintf(stderr, "usage: bench_edit_reach LEVEL.glb BAKE.relume NODE [RAYS]\n");
    return 1;
  }
  return relume::run(argv[1], argv[2], argv[3], argc > 4 ? static_cast<std::uint32_t>(std::atoi(argv[4])) : 2048);
}
