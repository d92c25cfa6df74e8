// SPDX-License-Identifier: MIT
// See compare_report.h.
#include "tools/compare/compare_report.h"

#include "bake/base/read_json.h"
#include "formats/compact_links.h"
#include "formats/format_version.h"
#include "tools/base/shown_float.h"
#include "tools/compare/compare_scene.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

namespace relume {
namespace {

using Json = nlohmann::json;

Json vec3(const glm::vec3& v) { return Json::array({shownFloat(v.x), shownFloat(v.y), shownFloat(v.z)}); }
Json pairOf(const Json& a, const Json& b) { return {{"a", a}, {"b", b}}; }

std::uint64_t bytesOf(const BakeFile& file) {
  std::uint64_t bytes = 0;
  for (const ChunkInfo& c : file.chunks) bytes = std::max(bytes, c.offset + c.bytes);
  return bytes;
}

// Null where a bake has no certificate, which is no error of 0.
Json certifiedOf(const Bake& bake) {
  return bake.certificate.empty() ? Json() : Json(certifiedError(bake.certificate));
}

// Options that differ, by path; null where a bake has none of that name.
Json compareOptions(const std::string& a, const std::string& b) {
  const auto flat = [](const std::string& text) {
    const Result<Json> json = readJson(text);
    return json && json->is_object() ? json->flatten() : Json::object();
  };
  const Json flatA = flat(a), flatB = flat(b);
  std::set<std::string> names;
  for (const Json* json : {&flatA, &flatB}) {
    for (const auto& [name, value] : json->items()) names.insert(name);
  }
  Json list = Json::array();
  for (const std::string& name : names) {
    const Json before = flatA.contains(name) ? flatA[name] : Json(), now = flatB.contains(name) ? flatB[name] : Json();
    if (before == now) continue;
    std::string dotted = name.substr(name.starts_with('/') ? 1 : 0);
    std::replace(dotted.begin(), dotted.end(), '/', '.');
    list.push_back({{"name", dotted}, {"a", before}, {"b", now}});
  }
  return list;
}

Json whatWasBaked(const Bake& a, const Bake& b) {
  const Provenance &pa = a.provenance, &pb = b.provenance;
  Json parts = Json::array();
  for (const PartChange& change : compareParts(a.instances, b.instances))
    parts.push_back(
        {{"node", change.node}, {"mesh", change.mesh}, {"change", toString(change.kind)}, {"text", toString(change)}});
  return {{"sameScene", pa.sceneHash == pb.sceneHash},
          {"toolVersion", pairOf(pa.toolVersion, pb.toolVersion)},
          {"algorithmVersion", pairOf(pa.algorithmVersion, pb.algorithmVersion)},
          {"formatVersion", pairOf(formatVersionOf(a), formatVersionOf(b))},
          {"rayTracer", pairOf(pa.rayTracer, pb.rayTracer)},
          {"seed", pairOf(pa.seed, pb.seed)},
          {"options", compareOptions(pa.optionsJson, pb.optionsJson)},
          {"sceneParts", parts},
          {"viewsChanged", pa.viewHash != pb.viewHash || pa.cameraHash != pb.cameraHash}};
}

Json compareSizes(const BakeFile& a, const BakeFile& b) {
  std::map<std::string, std::pair<std::uint64_t, std::uint64_t>> bytes;
  std::map<std::string, bool> same;
  for (const ChunkInfo& c : a.chunks) bytes[c.name].first = c.bytes;
  for (const ChunkInfo& c : b.chunks) bytes[c.name].second = c.bytes;
  for (const ChunkInfo& c : a.chunks) {
    for (const ChunkInfo& other : b.chunks) {
      if (c.name == other.name) same[c.name] = c.bytes == other.bytes && c.hash == other.hash;
    }
  }
  Json list = Json::array();
  std::set<std::string> listed;
  // Bakes without emitters or certificate lack some arrays: those of B alone come last.
  for (const BakeFile* file : {&a, &b}) {
    for (const ChunkInfo& c : file->chunks) {
      if (!listed.insert(c.name).second) continue;
      list.push_back(
          {{"array", c.name}, {"a", bytes[c.name].first}, {"b", bytes[c.name].second}, {"same", same[c.name]}});
    }
  }
  return {{"a", bytesOf(a)}, {"b", bytesOf(b)}, {"arrays", list}};
}

// Surfels of B at the very place of one of A, within a surfel's width of one, and elsewhere.
Json compareSurfels(const Surfels& a, const Surfels& b) {
  std::vector<std::uint32_t> all(a.count());
  std::iota(all.begin(), all.end(), 0u);
  const float width = std::max(2.0f * std::sqrt(std::max(a.areaEach, b.areaEach) / 3.14159265f), 1e-6f);
  const PointIndex index(a.positionWorld, all, width);
  std::uint32_t same = 0, moved = 0, elsewhere = 0;
  double distance = 0.0;
  for (const glm::vec3& p : b.positionWorld) {
    const std::uint32_t near = index.nearest(p);
    if (near == PointIndex::kNothing) {
      ++elsewhere;
    } else if (a.positionWorld[near] == p) {
      ++same;
    } else {
      ++moved;
      distance += glm::distance(a.positionWorld[near], p);
    }
  }
  return {{"count", pairOf(a.count(), b.count())},
          {"areaEachM2", pairOf(shownFloat(a.areaEach), shownFloat(b.areaEach))},
          {"same", same},
          {"moved", moved},
          {"elsewhere", elsewhere},
          {"meanMoveM", moved > 0 ? distance / moved : 0.0}};
}

// How tight the clusters are: over all inner nodes, senders below times the squared diagonal of their box, each a share
// of the whole. Lower is tighter. Sky patches, which have no place, are left out.
double clusterCost(const Bake& bake) {
  const Hierarchy& h = bake.hierarchy;
  struct Box {
    glm::vec3 low{std::numeric_limits<float>::infinity()}, high{-std::numeric_limits<float>::infinity()};
    double senders = 0.0;
  };
  std::vector<Box> box(h.nodeCount());
  double cost = 0.0;
  const auto diagonal = [](const Box& b) {
    const glm::vec3 d = b.high - b.low;
    return b.senders > 0.0 ? static_cast<double>(glm::dot(d, d)) : 0.0;
  };
  for (std::uint32_t node = h.nodeCount(); node-- > 0;) {  // children come after their parent
    Box& own = box[node];
    if (h.isLeaf(node)) {
      if (h.sender(node) >= bake.surfels.count()) continue;
      own.low = own.high = bake.surfels.positionWorld[h.sender(node)];
      own.senders = 1.0;
      continue;
    }
    for (std::uint32_t child = h.child[node]; child < h.child[node] + 2; ++child) {
      own.low = glm::min(own.low, box[child].low);
      own.high = glm::max(own.high, box[child].high);
      own.senders += box[child].senders;
    }
    cost += own.senders * diagonal(own);
  }
  const double whole = box.empty() ? 0.0 : box[0].senders * diagonal(box[0]);
  return whole > 0.0 ? cost / whole : 0.0;
}

// Sum of the links' transfers of each cache: visible solid angle times y_0 / pi, at most 1.13 (sphere), 0.56
// (hemisphere).
std::vector<double> transferOf(const Bake& bake) {
  const Links& l = bake.links;
  std::vector<double> sums(l.cacheCount(), 0.0);
  for (std::uint32_t cache = 0; cache < l.cacheCount(); ++cache) {
    const bool surface = bake.caches.normal[cache] != glm::vec3(0.0f);
    for (std::uint32_t i = l.rowBegin[cache]; i < l.rowBegin[cache + 1]; ++i) {
      float first = 0.0f;
      linkCoefficients(l, i, surface, 1, std::span<float>(&first, 1));
      sums[cache] += first;
    }
  }
  return sums;
}

Json compareCaches(const Bake& a, const Bake& b, const CacheMatch& match) {
  const auto invalid = [](const Array<std::uint32_t>& cache) {
    return static_cast<std::size_t>(std::count(cache.begin(), cache.end(), kNoCache));
  };
  std::uint32_t moved = 0;
  double distance = 0.0, farthest = 0.0;
  for (const CachePair& pair : match.pairs) {
    if (!(pair.distance > 1e-5f)) continue;
    ++moved;
    distance += pair.distance;
    farthest = std::max<double>(farthest, pair.distance);
  }
  const auto map = [](const Bake& bake) {
    return Json::array({bake.caches.lightmap.width, bake.caches.lightmap.height});
  };
  const auto grid = [](const Bake& bake) {
    const glm::uvec3& r = bake.caches.grid.resolution;
    return Json::array({r.x, r.y, r.z});
  };
  return {{"count", pairOf(a.caches.count(), b.caches.count())},
          {"matched", match.pairs.size()},
          {"onlyInA", match.onlyInA},
          {"onlyInB", match.onlyInB},
          {"moved", moved},
          {"meanMoveM", moved > 0 ? distance / moved : 0.0},
          {"maxMoveM", farthest},
          {"surfaceToleranceM", match.surfaceTolerance},
          {"gridToleranceM", match.gridTolerance},
          {"gridPointsWithoutCache", pairOf(invalid(a.caches.grid.cache), invalid(b.caches.grid.cache))},
          {"texelsWithoutCache", pairOf(invalid(a.caches.lightmap.cache), invalid(b.caches.lightmap.cache))},
          {"lightmap", pairOf(map(a), map(b))},
          {"grid", pairOf(grid(a), grid(b))}};
}

Json compareLinks(const Bake& a, const Bake& b, const CacheMatch& match) {
  const std::vector<double> ta = transferOf(a), tb = transferOf(b);
  const auto statistics = [](const std::vector<double>& t) -> Json {
    const double sum = std::accumulate(t.begin(), t.end(), 0.0);
    return {{"mean", t.empty() ? 0.0 : sum / static_cast<double>(t.size())},
            {"min", t.empty() ? 0.0 : *std::min_element(t.begin(), t.end())},
            {"max", t.empty() ? 0.0 : *std::max_element(t.begin(), t.end())}};
  };
  double squares = 0.0, largest = 0.0;
  for (const CachePair& pair : match.pairs) {
    const double difference = tb[pair.b] - ta[pair.a];
    squares += difference * difference;
    largest = std::max(largest, std::abs(difference));
  }
  const double pairs = static_cast<double>(std::max<std::size_t>(match.pairs.size(), 1));
  return {{"kind", pairOf(linkKindName(a.links.kind), linkKindName(b.links.kind))},
          {"count", pairOf(a.links.count(), b.links.count())},
          {"transferPerCache", pairOf(statistics(ta), statistics(tb))},
          {"transferRmsDifference", std::sqrt(squares / pairs)},
          {"transferMaxDifference", largest}};
}

Json describeReceivers(const LightDifference& d) {
  const Receivers& r = d.receivers;
  const auto air = std::count_if(r.list.begin(), r.list.end(),
                                 [](const Receiver& receiver) { return receiver.group == Receivers::kAir; });
  Json groups = Json::array();
  for (const WorstReceivers& w : d.worstReceivers)
    groups.push_back({{"group", w.group},
                      {"air", w.air},
                      {"lighting", w.lighting},
                      {"receivers", w.receivers},
                      {"change", w.change}});
  return {{"surfaces", static_cast<std::ptrdiff_t>(r.list.size()) - air},
          {"air", air},
          {"partsCompared", r.partsMatched},
          {"partsOnlyInA", r.partsOnlyInA},
          {"partsOnlyInB", r.partsOnlyInB},
          {"partsReshaped", r.partsReshaped},
          {"lightMapLeftOut", r.withoutMap},
          {"groups", groups}};
}

Json describeLight(const LightDifference& d) {
  Json lightings = Json::array(), worst = Json::array(), nodes = Json::array();
  bool converged = true;
  for (const LightingDifference& l : d.lightings) {
    converged = converged && l.converged;
    lightings.push_back({{"name", l.name},
                         {"counted", l.counted},
                         {"converged", l.converged},
                         {"rmse", l.rmse},
                         {"meanA", l.meanA},
                         {"meanB", l.meanB},
                         {"change", {{"mean", l.meanChange}, {"p95", l.p95Change}, {"max", l.maxChange}}},
                         {"deltaE", {{"mean", l.meanDeltaE}, {"p95", l.p95DeltaE}, {"max", l.maxDeltaE}}},
                         {"receivers", {{"surfaces", l.receivers.surfaces}, {"air", l.receivers.air}}}});
    if (!l.was.empty()) lightings.back()["was"] = l.was;
  }
  for (const WorstPlace& w : d.worst)
    worst.push_back({{"positionM", vec3(w.positionWorld)},
                     {"node", w.node},
                     {"lighting", w.lighting},
                     {"change", w.change},
                     {"deltaE", w.deltaE},
                     {"cacheA", d.match.pairs[w.pair].a},
                     {"cacheB", d.match.pairs[w.pair].b},
                     {"irradianceA", vec3(w.a)},
                     {"irradianceB", vec3(w.b)}});
  for (const NodeDifference& n : d.nodes)
    nodes.push_back({{"node", n.node}, {"caches", n.caches}, {"meanChange", n.meanChange}, {"maxChange", n.maxChange}});
  const std::string frames = std::to_string(kMaxCompareFrames);
  return {{"method", "relit on the CPU " +
                         (converged ? "to convergence" : "until converged, at most " + frames + " frames") +
                         "; punctual lights without shadows"},
          {"lightings", lightings},
          {"maxRmse", d.maxRmse},
          {"maxChange", d.maxChange},
          {"maxReceiverChange", d.maxReceiverChange},
          {"maxDeltaE", d.maxDeltaE},
          {"worst", worst},
          {"nodes", nodes},
          {"receivers", describeReceivers(d)}};
}

Json judge(const LightDifference& light, const LightIgnore& ignore, const CompareBounds& bounds) {
  // A zero without the sign that the command line may have given it.
  const auto bound = [](double value) { return std::isfinite(value) ? Json(value == 0.0 ? 0.0 : value) : Json(); };
  const auto exceeds = [](double found, double given) {
    return found > given || (std::isfinite(given) && isBeyondBounds(found));
  };
  Json exceeded = Json::array();
  if (exceeds(light.maxRmse, bounds.maxRmse)) exceeded.push_back("rmse");
  if (exceeds(light.maxChange, bounds.maxCacheChange)) exceeded.push_back("cacheChange");
  if (exceeds(light.maxReceiverChange, bounds.maxReceiverChange)) exceeded.push_back("receiverChange");
  const bool caches = std::isfinite(bounds.maxRmse) || std::isfinite(bounds.maxCacheChange);
  const bool receivers = std::isfinite(bounds.maxReceiverChange);
  if (caches && light.unmatched) exceeded.push_back("unmatchedCaches");
  if (receivers && light.receivers.unmatched) exceeded.push_back("unmatchedParts");
  const bool any = caches || receivers;
  return {{"verdict", !any               ? "no bounds"
                      : exceeded.empty() ? "within bounds"
                                         : "exceeded"},
          {"maxRmse", bound(bounds.maxRmse)},
          {"maxCacheChange", bound(bounds.maxCacheChange)},
          {"maxReceiverChange", bound(bounds.maxReceiverChange)},
          {"ignored", ignore.names},
          {"exceeded", exceeded}};
}

}  // namespace

Json reportSame(const std::string& a, const std::string& b, std::uint64_t bytes, const LightIgnore& ignore,
                const CompareBounds& bounds) {
  return {{"schema", "relume-compare/2"},
          {"same", true},
          {"a", {{"file", a}, {"bytes", bytes}}},
          {"b", {{"file", b}, {"bytes", bytes}}},
          {"verdict", judge(LightDifference(), ignore, bounds)}};
}

Json reportDifference(const BakeFile& a, const BakeFile& b, const LightDifference& light, const LightIgnore& ignore,
                      const CompareBounds& bounds) {
  return {{"schema", "relume-compare/2"},
          {"same", false},
          {"a", {{"file", a.name}, {"bytes", bytesOf(a)}}},
          {"b", {{"file", b.name}, {"bytes", bytesOf(b)}}},
          {"baked", whatWasBaked(a.bake, b.bake)},
          {"sizes", compareSizes(a, b)},
          {"arrays",
           {{"surfels", compareSurfels(a.bake.surfels, b.bake.surfels)},
            {"clusterCost", pairOf(clusterCost(a.bake), clusterCost(b.bake))},
            {"certifiedError", pairOf(certifiedOf(a.bake), certifiedOf(b.bake))},
            {"caches", compareCaches(a.bake, b.bake, light.match)},
            {"links", compareLinks(a.bake, b.bake, light.match)}}},
          {"light", describeLight(light)},
          {"verdict", judge(light, ignore, bounds)}};
}

bool boundExceeded(const Json& report) { return report["verdict"]["verdict"] == "exceeded"; }

}  // namespace relume
