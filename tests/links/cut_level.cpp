// SPDX-License-Identifier: MIT
// See cut_level.h.
#include "tests/links/cut_level.h"

#include "bake/base/parallel.h"
#include "bake/hierarchy/hierarchy.h"
#include "tests/links/test_lights.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume::test {
namespace {

// Arrivals of a leaf become one; ascending by leaf.
std::vector<Arrival> joinByLeaf(std::vector<Arrival>& arrivals) {
  std::vector<Arrival> joined;
  std::stable_sort(arrivals.begin(), arrivals.end(),
                   [](const Arrival& a, const Arrival& b) { return a.leaf < b.leaf; });
  for (std::size_t i = 0; i < arrivals.size();) {
    Arrival sum{arrivals[i].leaf, 0.0f, 0.0f, glm::vec3(0.0f)};
    for (; i < arrivals.size() && arrivals[i].leaf == sum.leaf; ++i) {
      sum.weight += arrivals[i].weight;
      sum.cosine += arrivals[i].weight * arrivals[i].cosine;
      sum.direction += arrivals[i].weight * arrivals[i].direction;
    }
    sum.cosine /= sum.weight;
    sum.direction /= sum.weight;
    joined.push_back(sum);
  }
  return joined;
}

}  // namespace

bool CutLevel::onSurface(std::size_t cache) const {
  return glm::dot(caches.normal[cache], caches.normal[cache]) > 0.0f;
}

Result<std::unique_ptr<CutLevel>> loadCutLevel(const std::string& path, const BakeOptions& options, Context& context) {
  Result<Scene> scene = importGltf(path, context);
  if (!scene) return scene.error();
  return makeCutLevel(std::move(*scene), options, context);
}

Result<std::unique_ptr<CutLevel>> makeCutLevel(Scene scene, const BakeOptions& options, Context& context) {
  auto level = std::make_unique<CutLevel>();
  level->scene = std::move(scene);
  Result<RayTracer> tracer = RayTracer::create(level->scene, options.embreeIsa, context);
  if (!tracer) return tracer.error();
  level->tracer = std::make_unique<RayTracer>(std::move(*tracer));
  Result<PlaySpace> space = findPlaySpace(*level->tracer, options.playSpace, options.seed, context);
  if (!space) return space.error();
  level->space = std::move(*space);
  Result<PlacedSurfels> placed = placeSurfels(*level->tracer, level->space, options.surfels, options.seed, context);
  if (!placed) return placed.error();
  level->placed = std::move(*placed);
  Result<Hierarchy> hierarchy = clusterSurfels(*level->tracer, level->placed.surfels, 0, options.clustering, context);
  if (!hierarchy) return hierarchy.error();
  level->hierarchy = std::move(*hierarchy);
  Result<PlacedCaches> caches = placeCaches(*level->tracer, level->space, options.caches, options.seed, context);
  if (!caches) return caches.error();
  level->caches = unpack(std::move(*caches));
  level->arrivals = gatherLeaves(*level, options.links.raysPerCache, options.seed, context);
  return level;
}

std::vector<std::vector<Arrival>> gatherLeaves(const CutLevel& level, std::uint32_t rays, std::uint64_t seed,
                                               Context& context) {
  const Gatherer gatherer(*level.tracer, level.placed.surfels, level.placed.map, level.hierarchy, rays, 0.0f, seed);
  std::vector<std::vector<Arrival>> all(level.caches.count());
  parallelChunks(context, "", all.size(), 16, [&](std::size_t begin, std::size_t end) {
    Gatherer::Scratch scratch;
    std::vector<Arrival> arrivals;
    RayCount count;
    for (std::size_t c = begin; c < end; ++c) {
      gatherer.gather(level.caches.positionWorld[c], level.caches.normal[c], scratch, arrivals, count);
      all[c] = joinByLeaf(arrivals);
    }
  });
  return all;
}

LightSuite makeSuite(const CutLevel& level, const std::string& name, const std::vector<SceneLight>& lights,
                     Context& context) {
  const Surfels& surfels = level.placed.surfels;
  const std::size_t all = lights.size();
  std::vector<float> value(all * surfels.count());
  parallelChunks(context, "", surfels.count(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const float albedo = glm::dot(surfels.albedo[i], glm::vec3(1.0f / 3.0f));
      for (std::size_t l = 0; l < all; ++l) {
        value[i * all + l] =
            albedo * directIrradiance(*level.tracer, lights[l], surfels.positionWorld[i], surfels.normal[i]);
      }
    }
  });

  // Leave out lights that shine on next to nothing.
  LightSuite suite{name, {}};
  std::vector<std::size_t> kept;
  for (std::size_t l = 0; l < all; ++l) {
    std::size_t reached = 0;
    for (std::size_t i = 0; i < surfels.count(); ++i) reached += value[i * all + l] > 0.0f;
    if (1e4 * static_cast<double>(reached) < surfels.count()) continue;
    kept.push_back(l);
    suite.lit.name.push_back(lights[l].name);
  }
  suite.lit.value.reserve(kept.size() * surfels.count());
  for (std::size_t i = 0; i < surfels.count(); ++i) {
    for (const std::size_t l : kept) suite.lit.value.push_back(value[i * all + l]);
  }
  return suite;
}

LightSuite ownLights(const CutLevel& level, Context& context) {
  return makeSuite(level, "own", level.scene.lights, context);
}

std::vector<LightSuite> untrainedLights(const CutLevel& level, Context& context) {
  std::vector<LightSuite> suites;
  suites.push_back(makeSuite(level, "suns", makeSuns(16), context));
  suites.push_back(makeSuite(level, "spots", makeSpots(*level.tracer, level.space, 16), context));
  suites.push_back(makeSuite(level, "torch", makeTorchPath(*level.tracer, level.space, 16), context));
  return suites;
}

Reads leafReads(const CutLevel& level) {
  Reads leaves(level.arrivals.size());
  for (std::size_t c = 0; c < leaves.size(); ++c) {
    for (const Arrival& a : level.arrivals[c])
      leaves[c].push_back({a.leaf, a.weight * a.cosine * level.receivedScale(c)});
  }
  return leaves;
}

std::vector<double> irradiance(const CutLevel& level, const Reads& reads, std::span<const float> firstWeight,
                               const LitSenders& lit) {
  const Hierarchy& h = level.hierarchy;
  const std::size_t lights = lit.count();
  std::vector<float> b(h.nodeCount() * lights);
  for (std::uint32_t node = h.nodeCount(); node-- > 0;) {
    const std::size_t child = h.isLeaf(node) ? 0 : h.child[node];
    for (std::size_t l = 0; l < lights; ++l) {
      const float w = firstWeight[node];
      b[node * lights + l] = h.isLeaf(node) ? lit.value[h.sender(node) * lights + l]
                                            : w * b[child * lights + l] + (1.0f - w) * b[(child + 1) * lights + l];
    }
  }
  std::vector<double> e(reads.size() * lights, 0.0);
  for (std::size_t c = 0; c < reads.size(); ++c) {
    for (const Read& read : reads[c]) {
      for (std::size_t l = 0; l < lights; ++l) e[c * lights + l] += double{read.received} * b[read.node * lights + l];
    }
  }
  return e;
}

std::vector<CutError> compareCaches(const std::vector<double>& read, const std::vector<double>& exact,
                                    std::size_t lights) {
  std::vector<CutError> errors(lights);
  for (std::size_t l = 0; l < lights; ++l) {
    double error = 0, square = 0, sum = 0, exactSum = 0;
    for (std::size_t i = l; i < exact.size(); i += lights) {
      error += (read[i] - exact[i]) * (read[i] - exact[i]);
      square += exact[i] * exact[i];
      sum += read[i];
      exactSum += exact[i];
    }
    errors[l] = {std::sqrt(error / square), sum / exactSum};
  }
  return errors;
}

CutReads cutCaches(const CutLevel& level, const CutChoice& choice) {
  const Hierarchy& h = level.hierarchy;
  const LeafOrder order(h);
  const NodeGeometry geometry = nodeGeometry(h, level.placed.surfels);
  const std::vector<CutNode> cutNode = cutNodes(h, geometry, choice.key, level.placed.surfels.emission);
  PullSums sums(h, choice.pull);
  VisibleSubtree tree(order);
  CutKeys keys;
  std::vector<CutCandidate> queue;
  std::vector<CutLink> cut;
  CutReads result;
  result.reads.resize(level.arrivals.size());
  result.min = 0xFFFFFFFFu;
  for (std::size_t c = 0; c < level.arrivals.size(); ++c) {
    tree.build(level.arrivals[c], level.receivedScale(c));
    cutKeys(tree, cutNode, choice.key, keys);
    selectCut(tree, keys, choice.limit, queue, cut);
    sums.add(tree, cut);
    for (const auto [slot, reads] : cut) result.reads[c].push_back({tree[reads].node, tree[slot].received});
    result.links += cut.size();
    result.min = std::min(result.min, cut.size());
    result.max = std::max(result.max, cut.size());
  }
  result.firstWeight = sums.weights(h);
  return result;
}

SuiteError summarize(const std::vector<CutError>& errors, const std::vector<std::string>& names) {
  SuiteError suite;
  if (errors.empty()) return suite;
  std::vector<double> rmse, energy;
  suite.worstEnergy = 1.0;
  for (std::size_t l = 0; l < errors.size(); ++l) {
    rmse.push_back(errors[l].rmse);
    energy.push_back(errors[l].energy);
    if (errors[l].rmse >= suite.worstRmse) suite.worstRmse = errors[l].rmse, suite.worst = names[l];
    if (std::abs(errors[l].energy - 1.0) > std::abs(suite.worstEnergy - 1.0)) suite.worstEnergy = errors[l].energy;
  }
  const auto median = [](std::vector<double>& v) {
    std::sort(v.begin(), v.end());
    return 0.5 * (v[(v.size() - 1) / 2] + v[v.size() / 2]);
  };
  suite.medianRmse = median(rmse);
  suite.medianEnergy = median(energy);
  return suite;
}

}  // namespace relume::test
