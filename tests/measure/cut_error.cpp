// SPDX-License-Identifier: MIT
// How far light read through cuts and averages is from light read leaf by leaf, for every cut key, pull weight and n_L,
// under the level's own lights and under others; what a budget of links brings; and how noisy the rays themselves are.
// Prints the tables of docs/notes/cuts.md.
//   bench_cut_error LEVEL.glb [surfels [caches [rays [cuts|lights|budget|error|noise]]]]
#include "bake/links/links.h"
#include "bake/links/share_links.h"
#include "tests/links/cut_level.h"
#include "tests/measure/or_exit.h"

#include <glm/geometric.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace relume::test {
namespace {

using CutKey = LinkOptions::CutKey;
using PullWeight = LinkOptions::PullWeight;

// The level's own lights: every key with every weight.
void cutTable(const CutLevel& level, Context& context) {
  const LitSenders lit = ownLights(level, context).lit;
  const std::vector<double> exact = irradiance(level, leafReads(level), level.hierarchy.firstWeight, lit);
  std::printf("\n| n_L | key | pull weight |");
  for (const std::string& name : lit.name) std::printf(" %s: RMSE %% | energy |", name.c_str());
  std::printf("\n|---|---|---|");
  for (std::size_t l = 0; l < lit.count(); ++l) std::printf("---|---|");
  for (const std::uint32_t maxNodes : {64u, 128u, 254u, 512u}) {
    for (const auto& [key, keyName] : {std::pair{CutKey::transfer, "transfer"}, {CutKey::readError, "readError"}}) {
      for (const auto& [pull, pullName] :
           {std::pair{PullWeight::area, "area"}, {PullWeight::importance, "importance"}}) {
        const CutReads cut = cutCaches(level, {key, pull, CutLimit{maxNodes}});
        std::printf("\n| %u | %s | %s |", maxNodes, keyName, pullName);
        for (const CutError& e :
             compareCaches(irradiance(level, cut.reads, cut.firstWeight, lit), exact, lit.count())) {
          std::printf(" %.1f | %.3f |", 100 * e.rmse, e.energy);
        }
        std::fflush(stdout);
      }
    }
  }
  std::printf("\n");
}

// Lights the bake knew nothing of: the paper's choice and the default.
void lightTable(const CutLevel& level, Context& context) {
  const std::vector<LightSuite> suites = untrainedLights(level, context);
  std::vector<std::vector<double>> exact;
  std::printf("\n| n_L | key, weight | lights | median RMSE %% | worst RMSE %% | at | median energy | worst energy |");
  std::printf("\n|---|---|---|---|---|---|---|---|");
  for (const LightSuite& suite : suites) {
    exact.push_back(irradiance(level, leafReads(level), level.hierarchy.firstWeight, suite.lit));
  }
  for (const std::uint32_t maxNodes : {64u, 128u, 254u, 512u}) {
    for (const auto& [key, pull, name] : {std::tuple{CutKey::transfer, PullWeight::area, "paper's"},
                                          {CutKey::readError, PullWeight::importance, "default"}}) {
      const CutReads cut = cutCaches(level, {key, pull, CutLimit{maxNodes}});
      for (std::size_t s = 0; s < suites.size(); ++s) {
        const LitSenders& lit = suites[s].lit;
        const SuiteError e = summarize(
            compareCaches(irradiance(level, cut.reads, cut.firstWeight, lit), exact[s], lit.count()), lit.name);
        std::printf("\n| %u | %s | %zu %s | %.1f | %.1f | %s | %.3f | %.3f |", maxNodes, name, lit.count(),
                    suites[s].name.c_str(), 100 * e.medianRmse, 100 * e.worstRmse, e.worst.c_str(), e.medianEnergy,
                    e.worstEnergy);
      }
      std::fflush(stdout);
    }
  }
  std::printf("\n");
}

// Lights the bake knew nothing of, with the truth for them.
struct Truth {
  std::vector<LightSuite> suites;
  std::vector<std::vector<double>> exact;  // [Size suites]
};

Truth untrainedTruth(const CutLevel& level, Context& context) {
  Truth truth{untrainedLights(level, context), {}};
  const Reads leaves = leafReads(level);
  for (const LightSuite& suite : truth.suites) {
    truth.exact.push_back(irradiance(level, leaves, level.hierarchy.firstWeight, suite.lit));
  }
  return truth;
}

// Print a column for every kind of light and one for all together: the median. Returns that of all.
double printMedians(const CutLevel& level, const Truth& truth, const CutReads& cut) {
  std::vector<CutError> all;
  std::vector<std::string> names;
  for (std::size_t s = 0; s < truth.suites.size(); ++s) {
    const LitSenders& lit = truth.suites[s].lit;
    const std::vector<CutError> e =
        compareCaches(irradiance(level, cut.reads, cut.firstWeight, lit), truth.exact[s], lit.count());
    std::printf(" %.1f |", 100 * summarize(e, lit.name).medianRmse);
    all.insert(all.end(), e.begin(), e.end());
    names.insert(names.end(), lit.name.begin(), lit.name.end());
  }
  const double median = summarize(all, names).medianRmse;
  std::printf(" %.1f |", 100 * median);
  return median;
}

// The same number of links for every cache, and the same total shared out by error.
void budgetTable(const CutLevel& level, Context& context) {
  constexpr std::uint32_t kMax = 2048;
  const Hierarchy& h = level.hierarchy;
  const NodeGeometry geometry = nodeGeometry(h, level.placed.surfels);
  const std::vector<CutNode> cutNode = cutNodes(h, geometry, CutKey::readError, level.placed.surfels.emission);
  const Truth truth = untrainedTruth(level, context);
  const LeafOrder order(h);
  VisibleSubtree tree(order);
  CutKeys keys;
  KeyCounts counts;
  for (std::size_t c = 0; c < level.arrivals.size(); ++c) {
    tree.build(level.arrivals[c], level.receivedScale(c));
    cutKeys(tree, cutNode, CutKey::readError, keys);
    counts.add(tree, keys.key, kMax);
  }

  std::printf("\n| links a cache | shared | fewest | most | suns: median RMSE %% | spots | torch | all |");
  std::printf("\n|---|---|---|---|---|---|---|---|");
  const auto row = [&](const CutLimit& limit, const char* name) {
    const CutReads cut = cutCaches(level, {CutKey::readError, PullWeight::importance, limit});
    std::printf("\n| %.1f | %s | %zu | %zu |", static_cast<double>(cut.links) / static_cast<double>(cut.reads.size()),
                name, cut.min, cut.max);
    printMedians(level, truth, cut);
    std::fflush(stdout);
    return cut.links;
  };
  for (const std::uint32_t each : {64u, 128u, 254u, 512u}) {
    // Some caches do not see enough to use their share: the total is what is used.
    const std::size_t links = row(CutLimit{each}, "equally");
    row(CutLimit{kMax, counts.keyFor(static_cast<double>(links))}, "by error");
  }
  std::printf("\n");
}

// What --link-error asks for, and what lights find that the bake knew nothing of.
void errorTable(const CutLevel& level, Context& context) {
  const float radius = levelRadius(level.hierarchy, nodeGeometry(level.hierarchy, level.placed.surfels));
  const Truth truth = untrainedTruth(level, context);
  std::printf("\n| asked for %% | links a cache | suns: median RMSE %% | spots | torch | all | found / asked |");
  std::printf("\n|---|---|---|---|---|---|---|");
  for (const float error : {0.4f, 0.2f, 0.1f, 0.05f, 0.025f}) {
    const CutReads cut =
        cutCaches(level, {CutKey::readError, PullWeight::importance, CutLimit{65535, -1.0f, keySumOf(error, radius)}});
    std::printf("\n| %g | %.1f |", 100.0 * double{error},
                static_cast<double>(cut.links) / static_cast<double>(cut.reads.size()));
    std::printf(" %.2f |", printMedians(level, truth, cut) / double{error});
    std::fflush(stdout);
  }
  std::printf("\n");
}

// Noise of the rays: two runs of the same light differ by sqrt(2) times the error of one.
void noiseTable(const CutLevel& level, std::uint32_t rays, Context& context) {
  const LitSenders lit = ownLights(level, context).lit;
  std::printf("\n| rays |");
  for (const std::string& name : lit.name) std::printf(" %s: irradiance %% | band 0 %% | band 1 %% |", name.c_str());
  std::printf("\n|---|");
  for (std::size_t l = 0; l < lit.count(); ++l) std::printf("---|---|---|");
  for (const std::uint32_t k : {rays / 4, rays}) {
    const auto a = gatherLeaves(level, k, 101, context), b = gatherLeaves(level, k, 102, context);
    std::printf("\n| %u |", k);
    for (std::size_t light = 0; light < lit.count(); ++light) {
      double error[3] = {}, square[3] = {};
      for (std::size_t c = 0; c < a.size(); ++c) {
        if (!level.onSurface(c)) continue;
        glm::dvec3 direction[2] = {};
        double sum[2][2] = {};
        for (int run = 0; run < 2; ++run) {
          for (const Arrival& x : run ? b[c] : a[c]) {
            const double sent = x.weight * lit.value[level.hierarchy.sender(x.leaf) * lit.count() + light];
            sum[run][0] += sent * x.cosine;
            sum[run][1] += sent;
            direction[run] += sent * glm::dvec3(x.direction);
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

// The whole stage, timed.
void printLinks(const CutLevel& level, const BakeOptions& options, Context& context) {
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpuStart = std::clock();
  const TracedLinks traced = orExit(traceLinks(*level.tracer, level.placed.surfels, level.placed.map, level.hierarchy,
                                               level.caches, options.links, 1, context));
  const double cpuSeconds = static_cast<double>(std::clock() - cpuStart) / CLOCKS_PER_SEC;
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto& s = traced.statistics;
  std::printf(
      "%s: n_S %u, n_C %u, K %u; links %u in %.2f s (%.2f s of CPU); visible leaves %.0f a cache; back faces %.3f, "
      "misses %.3f, unmapped %.4f of all rays\n",
      level.scene.name.c_str(), level.placed.surfels.count(), level.caches.count(), options.links.raysPerCache,
      traced.links.count(), seconds, cpuSeconds, s.visibleLeavesMean, s.backFaceShare, s.missShare, s.unmappedShare);
  std::fflush(stdout);
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
  const auto level = orExit(loadCutLevel(argv[1], options, context));

  const std::string only = argc > 5 ? argv[5] : "";
  if (only.empty()) printLinks(*level, options, context);
  if (only.empty() || only == "cuts") cutTable(*level, context);
  if (only.empty() || only == "lights") lightTable(*level, context);
  if (only.empty() || only == "budget") budgetTable(*level, context);
  if (only.empty() || only == "error") errorTable(*level, context);
  if (only.empty() || only == "noise") noiseTable(*level, options.links.raysPerCache, context);
  return 0;
}

}  // namespace
}  // namespace relume::test

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s LEVEL.glb [surfels [caches [rays [cuts|lights|budget|error|noise]]]]\n", argv[0]);
    return 1;
  }
  return relume::test::run(argc, argv);
}
