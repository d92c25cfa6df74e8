// SPDX-License-Identifier: MIT
// How far light read through cuts and averages is from light read leaf by leaf, for every cut key, pull weight and n_L,
// under each light of a level; and how noisy the rays themselves are. Prints the tables of docs/CUTS.md.
//   bench_cut_error LEVEL.glb [surfels [caches [rays [cuts|budget|noise]]]]
#include "bake/caches/caches.h"
#include "bake/links/gather.h"
#include "bake/links/links.h"
#include "bake/links/pull_weights.h"
#include "bake/links/select_cut.h"
#include "bake/links/share_links.h"
#include "bake/links/touched_tree.h"
#include "bake/parallel.h"
#include "bake/scene/play_space.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <limits>
#include <string>
#include <vector>

namespace relume {
namespace {

using CutKey = LinkOptions::CutKey;
using PullWeight = LinkOptions::PullWeight;

struct Level {
  const RayTracer& tracer;
  const PlacedSurfels& placed;
  const Hierarchy& hierarchy;
  const Caches& caches;
  std::vector<std::string> lightName;
  std::vector<std::vector<double>> radiosity;  // [W/m²] a light, a sender
};

// Direct irradiance of a punctual light on a surfel, shadowed [W/m²].
double directIrradiance(const RayTracer& tracer, const SceneLight& light, const glm::vec3& position,
                        const glm::vec3& normal) {
  const glm::vec3 from = position + normal * std::max(1e-3f, 4.0f * tracer.epsilonAt(position));
  glm::vec3 toLight = -light.direction;
  float distance = std::numeric_limits<float>::infinity();
  double irradiance = (light.intensity.x + light.intensity.y + light.intensity.z) / 3.0;
  if (light.type != LightType::directional) {
    distance = glm::length(light.positionWorld - from);
    toLight = (light.positionWorld - from) / distance;
    irradiance /= double{distance} * distance;
    if (light.type == LightType::spot) {
      const double inner = std::cos(light.innerConeRad), outer = std::cos(light.outerConeRad);
      const double t =
          std::clamp((-glm::dot(toLight, light.direction) - outer) / std::max(inner - outer, 1e-4), 0.0, 1.0);
      irradiance *= t * t;
    }
  }
  irradiance *= std::max(0.0f, glm::dot(toLight, normal));
  if (irradiance <= 0.0) return 0.0;
  return tracer.occluded(Ray{from, 0.0f, toLight, distance * 0.999f}) ? 0.0 : irradiance;
}

void lightSurfels(Level& level, Context& context) {
  const Surfels& surfels = level.placed.surfels;
  for (const SceneLight& light : level.tracer.scene().lights) {
    std::vector<double> radiosity(surfels.count());
    parallelChunks(context, "", surfels.count(), 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const double albedo = glm::dot(surfels.albedo[i], glm::vec3(1.0f / 3.0f));
        radiosity[i] = albedo * directIrradiance(level.tracer, light, surfels.positionWorld[i], surfels.normal[i]);
      }
    });
    level.lightName.push_back(light.name);
    level.radiosity.push_back(std::move(radiosity));
  }
}

// What a cache reads: node, and the share of irradiance it weighs.
struct Read {
  std::uint32_t node;
  float received;
};
using Reads = std::vector<std::vector<Read>>;

struct Errors {
  double rmse, energy;
};

Errors compare(const std::vector<double>& a, const std::vector<double>& exact) {
  double error = 0, square = 0, sum = 0, exactSum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    error += (a[i] - exact[i]) * (a[i] - exact[i]);
    square += exact[i] * exact[i];
    sum += a[i];
    exactSum += exact[i];
  }
  return {std::sqrt(error / square), sum / exactSum};
}

std::vector<double> irradiance(const Level& level, const Reads& reads, std::span<const float> firstWeight,
                               std::size_t light) {
  const Hierarchy& h = level.hierarchy;
  std::vector<double> b(h.nodeCount());
  for (std::uint32_t node = h.nodeCount(); node-- > 0;) {
    const double w = firstWeight[node];
    b[node] = h.isLeaf(node) ? level.radiosity[light][h.sender(node)]
                             : w * b[h.child[node]] + (1.0 - w) * b[h.child[node] + 1];
  }
  std::vector<double> e(reads.size(), 0.0);
  for (std::size_t c = 0; c < reads.size(); ++c) {
    for (const Read& read : reads[c]) e[c] += read.received * b[read.node];
  }
  return e;
}

bool onSurface(const Caches& caches, std::size_t c) {
  return glm::dot(caches.normal[c], caches.normal[c]) > 0.0f;
}

// Arrivals of every cache, those of a leaf together: what a cut needs, a tenth of the size.
std::vector<std::vector<Arrival>> gatherLeaves(const Level& level, std::uint32_t rays, std::uint64_t seed,
                                               Context& context) {
  const Gatherer gatherer(level.tracer, level.placed.surfels, level.placed.map, level.hierarchy, rays, 0.0f, seed);
  std::vector<std::vector<Arrival>> all(level.caches.count());
  parallelChunks(context, "", all.size(), 16, [&](std::size_t begin, std::size_t end) {
    Gatherer::Scratch scratch;
    std::vector<Arrival> arrivals;
    RayCount count;
    for (std::size_t c = begin; c < end; ++c) {
      gatherer.gather(static_cast<std::uint32_t>(c), level.caches.positionWorld[c], level.caches.normal[c], scratch,
                      arrivals, count);
      std::sort(arrivals.begin(), arrivals.end(), [](const Arrival& a, const Arrival& b) { return a.leaf < b.leaf; });
      for (std::size_t i = 0; i < arrivals.size();) {
        Arrival sum{arrivals[i].leaf, 0.0f, 0.0f, 0.0f, glm::vec3(0.0f)};
        for (; i < arrivals.size() && arrivals[i].leaf == sum.leaf; ++i) {
          sum.weight += arrivals[i].weight;
          sum.cosine += arrivals[i].weight * arrivals[i].cosine;
          sum.distance += arrivals[i].weight * arrivals[i].distance;
          sum.direction += arrivals[i].weight * arrivals[i].direction;
        }
        sum.cosine /= sum.weight;
        sum.distance /= sum.weight;
        sum.direction /= sum.weight;
        all[c].push_back(sum);
      }
    }
  });
  return all;
}

void cutTable(const Level& level, const std::vector<std::vector<Arrival>>& arrivals) {
  const Hierarchy& h = level.hierarchy;
  const LeafOrder order(h);
  const NodeGeometry geometry = nodeGeometry(h, level.placed.surfels);
  const std::size_t lights = level.radiosity.size(), caches = arrivals.size();
  TouchedTree tree(order);
  std::vector<float> keys;
  std::vector<CutCandidate> queue;
  std::vector<std::uint32_t> cut;

  Reads leaves(caches);
  for (std::size_t c = 0; c < caches; ++c) {
    for (const Arrival& a : arrivals[c]) {
      leaves[c].push_back({a.leaf, a.weight * a.cosine * (onSurface(level.caches, c) ? 1.0f : 0.25f)});
    }
  }
  std::vector<std::vector<double>> exact;
  for (std::size_t l = 0; l < lights; ++l) exact.push_back(irradiance(level, leaves, h.firstWeight, l));

  std::printf("\n| n_L | key | pull weight |");
  for (const std::string& name : level.lightName) std::printf(" %s: RMSE %% | energy |", name.c_str());
  std::printf("\n|---|---|---|");
  for (std::size_t l = 0; l < lights; ++l) std::printf("---|---|");
  for (const std::uint32_t maxNodes : {64u, 128u, 254u, 512u}) {
    for (const auto& [key, keyName] : {std::pair{CutKey::transfer, "transfer"},
                                       {CutKey::transferRadius, "transferRadius"},
                                       {CutKey::readError, "readError"}}) {
      const std::vector<CutNode> cutNode = cutNodes(h, geometry, key, level.placed.surfels.emission);
      PullSums openness(h, PullWeight::openness, 3.0f), importance(h, PullWeight::importance, 3.0f);
      Reads reads(caches);
      for (std::size_t c = 0; c < caches; ++c) {
        tree.build(arrivals[c], onSurface(level.caches, c) ? 1.0f : 0.25f);
        cutKeys(tree, cutNode, key, keys);
        selectCut(tree, keys, CutLimit{maxNodes}, queue, cut);
        openness.add(tree, cut, arrivals[c]);
        importance.add(tree, cut, arrivals[c]);
        for (const std::uint32_t slot : cut) reads[c].push_back({tree[slot].node, tree[slot].received});
      }
      const std::pair<const char*, std::vector<float>> weights[] = {
          {"area", h.firstWeight.toVector()}, {"openness", openness.weights(h)}, {"importance", importance.weights(h)}};
      for (const auto& [weightName, firstWeight] : weights) {
        std::printf("\n| %u | %s | %s |", maxNodes, keyName, weightName);
        for (std::size_t l = 0; l < lights; ++l) {
          const Errors e = compare(irradiance(level, reads, firstWeight, l), exact[l]);
          std::printf(" %.1f | %.3f |", 100 * e.rmse, e.energy);
        }
        std::fflush(stdout);
      }
    }
  }
  std::printf("\n");
}

// The same number of links for every cache, the same total shared out by error, and an error to stop at.
void budgetTable(const Level& level, const std::vector<std::vector<Arrival>>& arrivals) {
  constexpr std::uint32_t kMost = 2048;
  const Hierarchy& h = level.hierarchy;
  const LeafOrder order(h);
  const NodeGeometry geometry = nodeGeometry(h, level.placed.surfels);
  const std::vector<CutNode> cutNode = cutNodes(h, geometry, CutKey::readError, level.placed.surfels.emission);
  const std::size_t lights = level.radiosity.size(), caches = arrivals.size();
  TouchedTree tree(order);
  std::vector<float> keys;
  std::vector<CutCandidate> queue;
  std::vector<std::uint32_t> cut;
  const auto look = [&](std::size_t c) {
    tree.build(arrivals[c], onSurface(level.caches, c) ? 1.0f : 0.25f);
    cutKeys(tree, cutNode, CutKey::readError, keys);
  };

  Reads leaves(caches);
  KeyCounts counts;
  for (std::size_t c = 0; c < caches; ++c) {
    look(c);
    counts.add(tree, keys, kMost);
    for (const TouchedNode& leaf : tree.leaves()) leaves[c].push_back({leaf.node, leaf.received});
  }
  std::vector<std::vector<double>> exact;
  for (std::size_t l = 0; l < lights; ++l) exact.push_back(irradiance(level, leaves, h.firstWeight, l));

  std::printf("\n| links a cache | shared | fewest | most |");
  for (const std::string& name : level.lightName) std::printf(" %s: RMSE %% | energy |", name.c_str());
  std::printf("\n|---|---|---|---|");
  for (std::size_t l = 0; l < lights; ++l) std::printf("---|---|");
  const auto row = [&](const CutLimit& limit, const std::string& name) {
    PullSums importance(h, PullWeight::importance, 3.0f);
    Reads reads(caches);
    std::size_t links = 0, fewest = kMost, most = 0;
    for (std::size_t c = 0; c < caches; ++c) {
      look(c);
      selectCut(tree, keys, limit, queue, cut);
      importance.add(tree, cut, arrivals[c]);
      for (const std::uint32_t slot : cut) reads[c].push_back({tree[slot].node, tree[slot].received});
      links += cut.size();
      fewest = std::min(fewest, cut.size());
      most = std::max(most, cut.size());
    }
    std::printf("\n| %.1f | %s | %zu | %zu |", static_cast<double>(links) / static_cast<double>(caches), name.c_str(),
                fewest, most);
    const std::vector<float> firstWeight = importance.weights(h);
    for (std::size_t l = 0; l < lights; ++l) {
      const Errors e = compare(irradiance(level, reads, firstWeight, l), exact[l]);
      std::printf(" %.1f | %.3f |", 100 * e.rmse, e.energy);
    }
    std::fflush(stdout);
    return links;
  };
  for (const std::uint32_t each : {64u, 128u, 254u, 512u}) {
    // Some caches do not see enough to use their share: the total is what is used.
    const std::size_t links = row(CutLimit{each}, "equally");
    row(CutLimit{kMost, counts.keyFor(static_cast<double>(links))}, "by error");
  }
  for (const float error : {0.5f, 0.25f, 0.1f}) {
    row(CutLimit{kMost, -1.0f, keySumOf(error, levelRadius(h, geometry))},
        "error " + std::to_string(error).substr(0, 4));
  }
  std::printf("\n");
}

// Noise of the rays: two runs of the same light differ by sqrt(2) times the error of one.
void noiseTable(const Level& level, std::uint32_t rays, Context& context) {
  std::printf("\n| rays |");
  for (const std::string& name : level.lightName)
    std::printf(" %s: irradiance %% | band 0 %% | band 1 %% |", name.c_str());
  std::printf("\n|---|");
  for (std::size_t l = 0; l < level.radiosity.size(); ++l) std::printf("---|---|---|");
  for (const std::uint32_t k : {rays / 4, rays}) {
    const auto a = gatherLeaves(level, k, 101, context), b = gatherLeaves(level, k, 102, context);
    std::printf("\n| %u |", k);
    for (const auto& radiosity : level.radiosity) {
      double error[3] = {}, square[3] = {};
      for (std::size_t c = 0; c < a.size(); ++c) {
        if (!onSurface(level.caches, c)) continue;
        glm::dvec3 direction[2] = {};
        double sum[2][2] = {};
        for (int run = 0; run < 2; ++run) {
          for (const Arrival& x : run ? b[c] : a[c]) {
            const double light = x.weight * radiosity[level.hierarchy.sender(x.leaf)];
            sum[run][0] += light * x.cosine;
            sum[run][1] += light;
            direction[run] += light * glm::dvec3(x.direction);
          }
        }
        for (int i = 0; i < 2; ++i) {
          error[i] += (sum[0][i] - sum[1][i]) * (sum[0][i] - sum[1][i]) / 2;
          square[i] += sum[0][i] * sum[1][i];
        }
        error[2] += glm::dot(direction[0] - direction[1], direction[0] - direction[1]) / 2;
        square[2] += glm::dot(direction[0], direction[1]);
      }
      for (int i = 0; i < 3; ++i) std::printf(" %.2f |", 100 * std::sqrt(error[i] / square[i]));
    }
    std::fflush(stdout);
  }
  std::printf("\n");
}

template <class T>
T orExit(Result<T> result) {
  if (!result) {
    std::fprintf(stderr, "%s\n", result.error().message.c_str());
    std::exit(exitCode(result.error().code));
  }
  return std::move(*result);
}

int run(int argc, char** argv) {
  const auto number = [&](int i, std::uint32_t otherwise) {
    return argc > i ? static_cast<std::uint32_t>(std::strtoul(argv[i], nullptr, 10)) : otherwise;
  };
  Context context;
  BakeOptions options;
  options.surfels.count = number(2, options.surfels.count);
  if (argc > 3) options.caches.gridCaches = 0, options.caches.lightmapCaches = number(3, 8281);
  options.links.raysPerCache = number(4, options.links.raysPerCache);

  const Scene scene = orExit(importGltf(argv[1], context));
  const RayTracer tracer = orExit(RayTracer::create(scene, options.embreeIsa, context));
  const PlaySpace space = orExit(findPlaySpace(tracer, options.playSpace, 1, context));
  const PlacedSurfels placed = orExit(placeSurfels(tracer, space, options.surfels, 1, context));
  const Hierarchy hierarchy = orExit(clusterSurfels(placed.surfels, 0, options.clustering, context));
  const Caches caches = orExit(placeCaches(tracer, space, options.caches, 1, context));
  Level level{tracer, placed, hierarchy, caches, {}, {}};
  lightSurfels(level, context);

  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpuStart = std::clock();
  const TracedLinks traced =
      orExit(traceLinks(tracer, placed.surfels, placed.map, hierarchy, caches, options.links, 1, context));
  const double cpuSeconds = static_cast<double>(std::clock() - cpuStart) / CLOCKS_PER_SEC;
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto& s = traced.statistics;
  std::printf(
      "%s: n_S %u, n_C %u, K %u; links %u in %.2f s (%.2f s of CPU); visible leaves %.0f a cache; back faces %.3f, "
      "misses %.3f, unmapped %.4f of all rays\n",
      scene.name.c_str(), placed.surfels.count(), caches.count(), options.links.raysPerCache, traced.links.count(),
      seconds, cpuSeconds, s.visibleLeavesMean, s.backFaceShare, s.missShare, s.unmappedShare);
  std::fflush(stdout);
  const auto arrivals = gatherLeaves(level, options.links.raysPerCache, 1, context);
  const std::string only = argc > 5 ? argv[5] : "";
  if (only.empty() || only == "cuts") cutTable(level, arrivals);
  if (only.empty() || only == "budget") budgetTable(level, arrivals);
  if (only.empty() || only == "noise") noiseTable(level, options.links.raysPerCache, context);
  return 0;
}

}  // namespace
}  // namespace relume

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s LEVEL.glb [surfels [caches [rays [cuts|budget|noise]]]]\n", argv[0]);
    return 1;
  }
  return relume::run(argc, argv);
}
