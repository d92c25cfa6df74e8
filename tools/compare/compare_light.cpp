// SPDX-License-Identifier: MIT
// See compare_light.h.
#include "tools/compare/compare_light.h"

#include "formats/color.h"
#include "formats/sh.h"
#include "relume/relighter.h"
#include "tools/compare/compare_lightings.h"
#include "tools/compare/compare_scene.h"
#include "tools/render/context_threads.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kMaxWorst = 10;
constexpr int kBands = 3;  // the diffuse lobe has nothing in band 3

int bandsOf(const Bake& bake) {
  return bake.links.kind == LinkKind::sh ? std::min<int>(kBands, static_cast<int>(bake.links.bands)) : kBands;
}

// Irradiance of every cache of a relit bake, one probe for surface caches and six for grid caches.
class CacheReader {
 public:
  CacheReader(const Bake& bake, const Relighter& relighter)
      : bake_(bake),
        luma_(relighter.lumaBands()),
        chroma_(relighter.chromaBands()),
        stride_(static_cast<std::size_t>(relighter.coefficientsPerCache())),
        coefficients_(relighter.cacheCoefficients()) {}

  std::size_t probes(std::uint32_t cache) const { return bake_.caches.normal[cache] == glm::vec3(0.0f) ? 6 : 1; }
  glm::vec3 irradiance(std::uint32_t cache, std::size_t probe) const {
    const glm::vec3 normal = probes(cache) == 1 ? bake_.caches.normal[cache] : kAirDirections[probe];
    const std::span<const float> all(coefficients_.data() + cache * stride_, stride_);
    const auto l2 = static_cast<std::size_t>(luma_ * luma_), c2 = static_cast<std::size_t>(chroma_ * chroma_);
    const glm::vec3 ycc(lobe(cache, luma_, all.first(l2), normal), lobe(cache, chroma_, all.subspan(l2, c2), normal),
                        lobe(cache, chroma_, all.subspan(l2 + c2, c2), normal));
    return glm::max(yCoCgToRgb(ycc), glm::vec3(0.0f));
  }

 private:
  float lobe(std::uint32_t cache, int bands, std::span<const float> c, const glm::vec3& normal) const {
    // Irradiance links give a surface cache one coefficient and nothing else (formats/compact_links.h).
    const bool one = bake_.links.kind == LinkKind::irradiance && probes(cache) == 1;
    return irradianceAtSurface(one ? 1 : bands, c, normal, bake_.caches.normal[cache]);
  }

  const Bake& bake_;
  int luma_, chroma_;
  std::size_t stride_;
  std::vector<float> coefficients_;
};

// `bands` 0: as the bake recommends.
Result<Relighter> makeRelighter(const Bake& bake, int bands, Context& context) {
  RelightOptions options;
  options.lumaBands = options.chromaBands = bands;
  options.parallelFor = contextParallelFor(context);
  return Relighter::create(bake, options);
}

// Whether it converged. Light of surfaces that absorb none grows for ever where none of it leaves.
Result<bool> relight(const Bake& bake, Relighter& relighter, const Lighting& lighting,
                     const std::vector<std::string>& emitters) {
  const std::vector<glm::vec3> emission = emissionOf(bake, emitters);
  LightSetup setup;
  setup.lights = lighting.lights;
  setup.surfelEmission = emission;
  setup.skyRadiance = glm::vec3(lighting.sky ? 1.0f : 0.0f);
  relighter.reset();
  const Result<int> frames = relightUntilConverged(relighter, setup, kCompareTolerance, kMaxCompareFrames);
  if (!frames) return frames.error();
  return *frames < kMaxCompareFrames;
}

// A bake as the caches are read, and as receivers read it.
struct TwoRelighters {
  Relighter caches, receivers;
};

Result<TwoRelighters> makeRelighters(const Bake& bake, Context& context) {
  Result<Relighter> caches = makeRelighter(bake, bandsOf(bake), context);
  if (!caches) return caches.error();
  Result<Relighter> receivers = makeRelighter(bake, 0, context);
  if (!receivers) return receivers.error();
  return TwoRelighters{std::move(*caches), std::move(*receivers)};
}

// CIE 1976 L*a*b* of linear sRGB, D65, with `white` as the luminance of L* = 100.
glm::dvec3 labOf(const glm::vec3& rgb, double white) {
  const glm::dvec3 c = glm::dvec3(rgb) / white;
  const glm::dvec3 xyz((0.4124564 * c.r + 0.3575761 * c.g + 0.1804375 * c.b) / 0.95047,
                       0.2126729 * c.r + 0.7151522 * c.g + 0.0721750 * c.b,
                       (0.0193339 * c.r + 0.1191920 * c.g + 0.9503041 * c.b) / 1.08883);
  const auto f = [](double t) { return t > 216.0 / 24389.0 ? std::cbrt(t) : (24389.0 / 27.0 * t + 16.0) / 116.0; };
  return {116.0 * f(xyz.y) - 16.0, 500.0 * (f(xyz.x) - f(xyz.y)), 200.0 * (f(xyz.y) - f(xyz.z))};
}

// The value below which `share` of them lie. Takes a copy. [0..1]
double percentile(std::vector<float> values, double share) {
  if (values.empty()) return 0.0;
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

double meanOf(const std::vector<float>& values) {
  double sum = 0.0;
  for (const float v : values) sum += v;
  return values.empty() ? 0.0 : sum / static_cast<double>(values.size());
}

std::vector<glm::vec3> meansOf(const Bake& bake, const CacheReader& reader) {
  std::vector<glm::vec3> means(bake.caches.count(), glm::vec3(0.0f));
  for (std::uint32_t i = 0; i < means.size(); ++i) {
    const std::size_t probes = reader.probes(i);
    for (std::size_t k = 0; k < probes; ++k) means[i] += reader.irradiance(i, k) / static_cast<float>(probes);
  }
  return means;
}

// Norms over a pair's probes: |E_A|, |E_B - E_A|, each the root of the mean square.
struct PairNorms {
  double a = 0.0, difference = 0.0;
};

PairNorms normsOf(const CachePair& pair, const CacheReader& a, const CacheReader& b) {
  PairNorms norms;
  const std::size_t probes = a.probes(pair.a);
  for (std::size_t k = 0; k < probes; ++k) {
    const glm::dvec3 before(a.irradiance(pair.a, k)), now(b.irradiance(pair.b, k));
    norms.a += glm::dot(before, before) / static_cast<double>(probes);
    norms.difference += glm::dot(now - before, now - before) / static_cast<double>(probes);
  }
  return {std::sqrt(norms.a), std::sqrt(norms.difference)};
}

LightingDifference compareLighting(const Lighting& lighting, const Bake& bakeA, const Bake& bakeB, const CacheReader& a,
                                   const CacheReader& b, const std::vector<CachePair>& pairs,
                                   const std::vector<bool>& ignored) {
  LightingDifference d;
  d.name = lighting.name;
  d.was = lighting.was;
  d.group = lighting.group;
  d.irradianceA = meansOf(bakeA, a);
  d.irradianceB = meansOf(bakeB, b);

  // Sums over the pairs that count; the floor and the white follow from A.
  std::vector<PairNorms> norms;
  std::vector<float> brightness;
  double squaresA = 0.0, squares = 0.0, sumA = 0.0;
  std::size_t counted = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    norms.push_back(normsOf(pairs[i], a, b));
    brightness.push_back(luminance(d.irradianceA[pairs[i].a]));
    if (ignored[i]) continue;
    ++counted;
    squaresA += norms[i].a * norms[i].a;
    squares += norms[i].difference * norms[i].difference;
    sumA += norms[i].a;
    d.meanA += brightness.back();
    d.meanB += luminance(d.irradianceB[pairs[i].b]);
  }
  const double count = static_cast<double>(std::max<std::size_t>(counted, 1));
  d.meanA /= count;
  d.meanB /= count;
  d.rmse = squares == 0.0 ? 0.0 : bounded(std::sqrt(squares / squaresA));
  d.floor = 0.05 * sumA / count;
  if (!(d.floor > 0.0)) d.floor = std::max(0.05 * d.meanB, 1e-12);
  d.white = percentile(brightness, 0.95);
  if (!(d.white > 0.0)) d.white = std::max({d.meanA, d.meanB, 1e-12});

  // Each pair by itself.
  std::vector<float> changes, deltas;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    d.change.push_back(static_cast<float>(bounded(norms[i].difference / (norms[i].a + d.floor))));
    const double deltaE =
        glm::distance(labOf(d.irradianceA[pairs[i].a], d.white), labOf(d.irradianceB[pairs[i].b], d.white));
    d.deltaE.push_back(static_cast<float>(bounded(deltaE)));
    if (ignored[i]) continue;
    changes.push_back(d.change.back());
    deltas.push_back(d.deltaE.back());
  }
  if (!changes.empty()) {
    d.maxChange = *std::max_element(changes.begin(), changes.end());
    d.maxDeltaE = *std::max_element(deltas.begin(), deltas.end());
  }
  d.meanChange = meanOf(changes);
  d.p95Change = percentile(changes, 0.95);
  d.meanDeltaE = meanOf(deltas);
  d.p95DeltaE = percentile(deltas, 0.95);
  return d;
}

bool hasNode(const Bake& bake, const std::string& name) {
  return std::any_of(bake.instances.begin(), bake.instances.end(),
                     [&](const BakedInstance& instance) { return instance.node == name; });
}

// Whether a name of --ignore is the lighting's, or its group's.
bool isNamed(const Lighting& lighting, const std::string& name) {
  return lighting.name == name || lighting.group == name ||
         (!lighting.was.empty() && "emitter " + lighting.was == name);
}

// Add a node of --ignore, and what A calls it where only B has that name: caches and receivers go by A's names.
void addNode(const std::string& node, const Bake& a, const Bake& b, std::vector<std::string>& nodes) {
  nodes.push_back(node);
  if (hasNode(a, node) || !hasNode(b, node)) return;
  const std::vector<std::optional<std::size_t>> before = answersOf(a.instances, b.instances);
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i] && b.instances[i].node == node) nodes.push_back(a.instances[*before[i]].node);
  }
}

// Split --ignore into lightings and nodes. Emitters and nodes may be of other levels; any other name must mean
// something.
Status applyIgnore(const LightIgnore& ignore, const Bake& a, const Bake& b, const std::vector<Lighting>& lightings,
                   std::vector<bool>& lightingOff, std::vector<std::string>& nodes, Context& context) {
  lightingOff.assign(lightings.size(), false);
  for (const std::string& name : ignore.names) {
    if (name.starts_with("node:")) {
      const std::string node = name.substr(5);
      if (node.empty())
        return Error{ErrorCode::usage, "--ignore: expected the name of a node behind \"node:\"; found none"};
      addNode(node, a, b, nodes);
      if (!hasNode(a, node) && !hasNode(b, node))
        context.message(Severity::warning, "--ignore: neither bake has a node \"" + node + "\"");
      continue;
    }
    bool found = name == "sky" || name == "suns" || name == "points" || name == "emitters";
    for (std::size_t i = 0; i < lightings.size(); ++i) {
      if (!isNamed(lightings[i], name)) continue;
      lightingOff[i] = true;
      found = true;
    }
    if (found) continue;
    constexpr std::string_view kEmitter = "emitter ";
    if (name.starts_with(kEmitter) && name.size() > kEmitter.size()) {
      context.message(Severity::warning, "--ignore: neither bake has a lighting \"" + name +
                                             "\"; the strongest emitting nodes have one each");
      continue;
    }
    std::string known = "sky, suns, points, emitters, node:NAME";
    for (const Lighting& lighting : lightings) known += ", " + lighting.name;
    return Error{ErrorCode::usage, "--ignore: expected one of " + known + "; found \"" + name + "\""};
  }
  return done();
}

// The nodes that A's caches stand on.
struct CacheNodes {
  explicit CacheNodes(const Bake& a) : nodes(nodesOfParts(a.instances)) {
    for (const std::uint32_t part : partsOfCaches(a))
      ofCache.push_back(part == PointIndex::kNothing ? kNone : nodes.ofPart[part]);
  }

  PartNodes nodes;
  std::vector<std::uint32_t> ofCache;  // [Size n_C] index into the nodes; kNone: far from all
};

// For the few places that a list shows: however far the nearest surfel is.
std::string nearestNode(const Bake& bake, const PartNodes& nodes, const glm::vec3& p) {
  const Surfels& s = bake.surfels;
  std::uint32_t best = 0;
  for (std::uint32_t i = 1; i < s.count(); ++i) {
    if (glm::distance(s.positionWorld[i], p) < glm::distance(s.positionWorld[best], p)) best = i;
  }
  return s.count() > 0 ? nodes.texts[nodes.ofPart[s.instance[best]]] : "";
}

void findWorst(const Bake& a, const CacheNodes& caches, LightDifference& d) {
  const float apart = 3.0f * std::max(d.match.surfaceTolerance, d.match.gridTolerance);
  std::vector<std::uint32_t> order(d.match.pairs.size());
  std::iota(order.begin(), order.end(), 0u);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t x, std::uint32_t y) { return d.greatestChange[x] > d.greatestChange[y]; });
  for (const std::uint32_t i : order) {
    if (d.worst.size() == kMaxWorst || !(d.greatestChange[i] > 0.0f)) break;
    WorstPlace place;
    place.pair = i;
    place.positionWorld = a.caches.positionWorld[d.match.pairs[i].a];
    if (std::any_of(d.worst.begin(), d.worst.end(),
                    [&](const WorstPlace& w) { return glm::distance(w.positionWorld, place.positionWorld) < apart; }))
      continue;
    for (const LightingDifference& l : d.lightings) {
      if (!l.counted || !(l.change[i] > place.change)) continue;
      place.lighting = l.name;
      place.change = l.change[i];
      place.deltaE = l.deltaE[i];
      place.a = l.irradianceA[d.match.pairs[i].a];
      place.b = l.irradianceB[d.match.pairs[i].b];
    }
    const std::uint32_t node = caches.ofCache[d.match.pairs[i].a];
    place.node = node != kNone ? caches.nodes.texts[node] : nearestNode(a, caches.nodes, place.positionWorld);
    d.worst.push_back(place);
  }
}

void sumByNode(const CacheNodes& caches, LightDifference& d) {
  std::map<std::pair<std::string, std::uint32_t>, NodeDifference> byNode;
  for (std::size_t i = 0; i < d.match.pairs.size(); ++i) {
    if (d.greatestChange[i] < 0.0f) continue;
    const std::uint32_t at = caches.ofCache[d.match.pairs[i].a];
    NodeDifference& node = byNode[{at != kNone ? caches.nodes.texts[at] : "", at}];
    ++node.caches;
    node.meanChange += d.greatestChange[i];
    node.maxChange = std::max<double>(node.maxChange, d.greatestChange[i]);
  }
  for (auto& [key, node] : byNode) {
    node.node = key.first;
    node.meanChange /= node.caches;
    d.nodes.push_back(node);
  }
  std::stable_sort(d.nodes.begin(), d.nodes.end(),
                   [](const NodeDifference& x, const NodeDifference& y) { return x.maxChange > y.maxChange; });
}

// Keep each group's worst lighting.
void keepWorstReceivers(const LightingDifference& lighting, LightDifference& d) {
  for (const GroupChange& g : lighting.receivers.groups) {
    WorstReceivers& worst = d.worstReceivers[g.group];
    worst.receivers = g.receivers;
    if (!(g.change > worst.change)) continue;
    worst.lighting = lighting.name;
    worst.change = g.change;
  }
}

}  // namespace

LightIgnore splitIgnore(const std::vector<std::string>& arguments, const Bake& a, const Bake& b) {
  const std::vector<Lighting> lightings = makeLightings(a, b);
  LightIgnore ignore;
  for (const std::string& argument : arguments) {
    const auto isLighting = [&](const Lighting& lighting) { return isNamed(lighting, argument); };
    bool isName =
        argument.find(',') == std::string::npos || std::any_of(lightings.begin(), lightings.end(), isLighting);
    if (argument.starts_with("node:")) isName |= hasNode(a, argument.substr(5)) || hasNode(b, argument.substr(5));
    if (isName) {
      ignore.names.push_back(argument);
      continue;
    }
    std::istringstream list(argument);
    for (std::string name; std::getline(list, name, ',');) {
      if (!name.empty()) ignore.names.push_back(name);
    }
  }
  return ignore;
}

Status checkIgnore(const LightIgnore& ignore, const Bake& a, const Bake& b, Context& context) {
  std::vector<bool> lightingOff;
  std::vector<std::string> nodes;
  return applyIgnore(ignore, a, b, makeLightings(a, b), lightingOff, nodes, context);
}

Result<LightDifference> compareLight(const Bake& a, const Bake& b, const Scene* scene, const LightIgnore& ignore,
                                     Context& context) {
  LightDifference d;
  const std::vector<Lighting> lightings = makeLightings(a, b);
  std::vector<bool> off;
  std::vector<std::string> ignoredNodes;
  if (const Status status = applyIgnore(ignore, a, b, lightings, off, ignoredNodes, context); !status)
    return status.error();

  // Match caches by place
  d.match = matchCaches(a, b);
  const CacheNodes caches(a);
  const auto isIgnored = [&](const std::string& name) {
    return std::find(ignoredNodes.begin(), ignoredNodes.end(), name) != ignoredNodes.end();
  };
  std::vector<bool> ignored;
  for (const CachePair& pair : d.match.pairs) {
    const std::uint32_t node = caches.ofCache[pair.a];
    ignored.push_back(node != kNone && isIgnored(caches.nodes.names[node]));
  }
  d.unmatched =
      2 * d.match.pairs.size() < a.caches.count() || (d.match.pairs.empty() && d.match.onlyInA + d.match.onlyInB > 0);

  // Choose receivers
  d.receivers = placeReceivers(a, b, scene);
  std::vector<bool> ignoredGroups(d.receivers.groups.size(), false);
  for (std::uint32_t g = 0; g < ignoredGroups.size(); ++g) {
    const ReceiverGroup& group = d.receivers.groups[g];
    d.worstReceivers.push_back({group.text, "", g == Receivers::kAir, 0, 0.0});
    ignoredGroups[g] = g != Receivers::kAir && isIgnored(group.node);
  }

  // Relight both under each lighting
  Result<TwoRelighters> relightersA = makeRelighters(a, context), relightersB = makeRelighters(b, context);
  if (!relightersA) return relightersA.error();
  if (!relightersB) return relightersB.error();
  d.greatestChange.assign(d.match.pairs.size(), 0.0f);
  for (std::size_t i = 0; i < lightings.size(); ++i) {
    bool converged = true;
    for (const bool second : {false, true}) {
      TwoRelighters& relighters = second ? *relightersB : *relightersA;
      for (Relighter* relighter : {&relighters.caches, &relighters.receivers}) {
        if (!context.progress("relight", static_cast<double>(i) / static_cast<double>(lightings.size())))
          context.cancel();
        if (context.cancelled()) return cancelledError();
        const Result<bool> lit =
            relight(second ? b : a, *relighter, lightings[i], second ? lightings[i].emittersB : lightings[i].emittersA);
        if (!lit) return lit.error();
        converged = converged && *lit;
      }
    }
    const CacheReader readerA(a, relightersA->caches), readerB(b, relightersB->caches);
    d.lightings.push_back(compareLighting(lightings[i], a, b, readerA, readerB, d.match.pairs, ignored));
    LightingDifference& l = d.lightings.back();
    l.receivers = compareReceivers(d.receivers, ignoredGroups, relightersA->receivers, relightersB->receivers);
    l.counted = !off[i];
    l.converged = converged;
    if (!l.counted) continue;
    keepWorstReceivers(l, d);
    d.maxRmse = std::max(d.maxRmse, l.rmse);
    d.maxChange = std::max(d.maxChange, l.maxChange);
    d.maxDeltaE = std::max(d.maxDeltaE, l.maxDeltaE);
    for (std::size_t k = 0; k < l.change.size(); ++k) d.greatestChange[k] = std::max(d.greatestChange[k], l.change[k]);
  }
  context.progress("relight", 1.0);
  for (std::size_t k = 0; k < ignored.size(); ++k) {
    if (ignored[k]) d.greatestChange[k] = -1.0f;
  }
  findWorst(a, caches, d);
  sumByNode(caches, d);
  std::erase_if(d.worstReceivers, [](const WorstReceivers& w) { return !(w.change > 0.0); });
  std::stable_sort(d.worstReceivers.begin(), d.worstReceivers.end(),
                   [](const WorstReceivers& x, const WorstReceivers& y) { return x.change > y.change; });
  if (!d.worstReceivers.empty()) d.maxReceiverChange = d.worstReceivers.front().change;
  return d;
}

}  // namespace relume
