// SPDX-License-Identifier: MIT
// See describe.h.
#include "tools/cli/describe.h"

#include "bake/base/printed.h"
#include "bake/base/read_json.h"
#include "bake/budget/runtime_cost.h"
#include "bake/import/check_mesh.h"
#include "formats/decimal.h"
#include "formats/format_version.h"
#include "tools/base/shown_float.h"
#include "tools/render/scene_bounds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <string>
#include <vector>

namespace relume {
namespace {

using Json = nlohmann::json;

Json vec3(const glm::vec3& v) { return Json::array({shownFloat(v.x), shownFloat(v.y), shownFloat(v.z)}); }

// Points sorted into the buckets of a uniform grid, so that neighbours are found in 27 short ranges.
class BucketGrid {
 public:
  // bucketSize [m] is halved while most points crowd into few buckets, as they do in a bake that claims an area it does
  // not have.
  BucketGrid(std::span<const glm::vec3> points, float bucketSize)
      : points_(points), bucketSize_(bucketSize), order_(points.size()) {
    constexpr int kTries = 64;
    sort();
    for (int i = 0; i < kTries && isCrowded(); ++i) {
      bucketSize_ *= 0.5f;
      sort();
    }
  }

  // Distance to the nearest other point, or the size of a bucket if none is nearer.
  float nearest(std::uint32_t self) const {
    float best = bucketSize_ * bucketSize_;
    const glm::ivec3 center = bucketOf(points_[self]);
    for (int n = 0; n < 27; ++n) {
      const std::uint64_t k = key(center + glm::ivec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1));
      auto at = std::lower_bound(sorted_.begin(), sorted_.end(), k);
      for (; at != sorted_.end() && *at == k; ++at) {
        const std::uint32_t other = order_[static_cast<std::size_t>(at - sorted_.begin())];
        const glm::vec3 d = points_[other] - points_[self];
        if (other != self) best = std::min(best, d.x * d.x + d.y * d.y + d.z * d.z);
        if (best == 0.0f) return 0.0f;
      }
    }
    return std::sqrt(best);
  }

 private:
  void sort() {
    std::iota(order_.begin(), order_.end(), 0u);
    key_.clear();
    for (const glm::vec3& p : points_) key_.push_back(key(bucketOf(p)));
    std::sort(order_.begin(), order_.end(),
              [&](std::uint32_t a, std::uint32_t b) { return key_[a] != key_[b] ? key_[a] < key_[b] : a < b; });
    sorted_.clear();
    for (const std::uint32_t i : order_) sorted_.push_back(key_[i]);
  }

  // Whether the mean point shares its bucket with very many.
  bool isCrowded() const {
    constexpr double kMax = 1024.0;
    double pairs = 0.0;
    for (std::size_t begin = 0, end = 0; begin < sorted_.size(); begin = end) {
      while (end < sorted_.size() && sorted_[end] == sorted_[begin]) ++end;
      pairs += static_cast<double>(end - begin) * static_cast<double>(end - begin);
    }
    return pairs > kMax * static_cast<double>(sorted_.size());
  }

  glm::ivec3 bucketOf(const glm::vec3& p) const {
    const auto index = [&](float v) { return static_cast<int>(std::clamp(std::floor(v / bucketSize_), -1e6f, 1e6f)); };
    return {index(p.x), index(p.y), index(p.z)};
  }
  static std::uint64_t key(const glm::ivec3& c) {
    const auto bits = [](int v) { return static_cast<std::uint64_t>(v + (1 << 20)) & 0x1FFFFF; };
    return bits(c.x) | bits(c.y) << 21 | bits(c.z) << 42;
  }

  std::span<const glm::vec3> points_;
  float bucketSize_;
  std::vector<std::uint32_t> order_;
  std::vector<std::uint64_t> key_, sorted_;
};

Json describeChunks(std::span<const ChunkInfo> chunks) {
  Json list = Json::array();
  for (const ChunkInfo& c : chunks) {
    list.push_back({{"name", c.name},
                    {"type", toString(c.type)},
                    {"shape", c.shape},
                    {"offset", c.offset},
                    {"bytes", c.bytes},
                    {"xxh3", hexadecimal(c.hash)}});
    if (c.coding != kUncoded) list.back()["coding"] = hexadecimal(c.coding);
  }
  return list;
}

Json describeDrivable(const Emitters& emitters) {
  Json list = Json::array();
  for (const DrivableMaterial& m : emitters.materials)
    list.push_back({{"material", m.name}, {"surfels", m.entryCount}, {"images", m.textured}, {"marked", m.marked}});
  return list;
}

Json describeSurfels(const Bake& bake) {
  const Surfels& s = bake.surfels;
  const SpacingStatistics spacing = surfelSpacing(s);
  const auto emitters = std::count_if(s.emission.begin(), s.emission.end(),
                                      [](const glm::vec3& e) { return e.x > 0.0f || e.y > 0.0f || e.z > 0.0f; });
  const auto onGrid = std::count(s.receiver.begin(), s.receiver.end(), kGridReceiver);
  return {{"count", s.count()},
          {"emitters", emitters},
          {"drivable", describeDrivable(bake.emitters)},
          {"areaEachM2", shownFloat(s.areaEach)},
          {"areaTotalM2", static_cast<double>(s.areaEach) * s.count()},
          {"readFromGrid", onGrid},
          {"spacingMinM", spacing.min},
          {"spacingMeanM", spacing.mean},
          {"spacingVariation", spacing.variation},
          {"spacingMinOfDensest", spacing.densest > 0.0 ? spacing.min / spacing.densest : 0.0}};
}

Json describeCaches(const Caches& c) {
  const auto valid = [](const Array<std::uint32_t>& cache) {
    return static_cast<std::size_t>(std::count_if(cache.begin(), cache.end(), [](auto i) { return i != kNoCache; }));
  };
  const auto corners = c.lightmap.cornerUv.size();
  const auto gridLit = std::count(c.lightmap.cornerUv.begin(), c.lightmap.cornerUv.end(), kGridLit);
  const auto onGrid = std::count(c.normal.begin(), c.normal.end(), glm::vec3(0.0f));
  const auto parted = std::count_if(c.lightmap.sight.begin(), c.lightmap.sight.end(), [](auto w) { return w != 0; });
  return {{"count", c.count()},
          {"grid",
           {{"resolution", {c.grid.resolution.x, c.grid.resolution.y, c.grid.resolution.z}},
            {"originM", vec3(c.grid.originWorld)},
            {"spacingM", vec3(c.grid.spacing)},
            {"points", c.grid.cache.size()},
            {"valid", valid(c.grid.cache)},
            {"bricks", c.grid.brickCount()},
            {"cells", c.grid.brick.size()},
            {"finestSpacingM", shownFloat(c.grid.finestSpacing())},
            {"knowsDepths", !c.grid.depth.empty()},
            {"caches", onGrid}}},
          {"lightmap",
           {{"width", c.lightmap.width},
            {"height", c.lightmap.height},
            {"filledTexels", valid(c.lightmap.cache)},
            {"packing", c.lightmap.cache.empty() ? 0.0
                                                 : static_cast<double>(valid(c.lightmap.cache)) /
                                                       static_cast<double>(c.lightmap.cache.size())},
            {"caches", c.count() - onGrid},
            {"partedSquares", parted},
            {"triangles", corners / 3},
            {"gridLitTriangles", gridLit / 3}}}};
}

Json describeLinks(const Links& l) {
  std::uint32_t min = std::numeric_limits<std::uint32_t>::max(), max = 0, empty = 0;
  for (std::uint32_t i = 0; i < l.cacheCount(); ++i) {
    const std::uint32_t row = l.rowBegin[i + 1] - l.rowBegin[i];
    min = std::min(min, row);
    max = std::max(max, row);
    empty += row == 0;
  }
  const std::size_t bytes = 4 * (l.shNode.size() + l.head.size() + l.shape.size()) + 2 * l.shCoefficients.size() +
                            sizeof(ConeLink) * l.cone.size();
  return {{"kind", linkKindName(l.kind)},
          {"bands", l.bands},
          {"count", l.count()},
          {"bytesEach", l.count() > 0 ? static_cast<double>(bytes) / l.count() : 0.0},
          {"perCacheMin", l.cacheCount() > 0 ? min : 0},
          {"perCacheMax", max},
          {"perCacheMean", l.cacheCount() > 0 ? static_cast<double>(l.count()) / l.cacheCount() : 0.0},
          {"cachesWithoutLinks", empty}};
}

// A light as it is used, and as the file has it where that is another unit.
Json describeLight(const SceneLight& light, LightUnit inFile) {
  const char* types[] = {"directional", "point", "spot"};
  const bool directional = light.kind == LightKind::directional;
  Json described = {{"name", light.name},
                    {"type", types[static_cast<int>(light.kind)]},
                    {"intensity", vec3(light.intensity)},
                    {"unit", directional ? "W/m^2" : "W/sr"}};
  if (!directional) described["positionM"] = vec3(light.positionWorld);
  if (inFile == LightUnit::photometric) {
    described["intensityInFile"] = vec3(light.intensity * static_cast<float>(kLumensPerWatt));
    described["unitInFile"] = directional ? "lx" : "cd";
  }
  return described;
}

}  // namespace

SpacingStatistics surfelSpacing(const Surfels& surfels) {
  SpacingStatistics s;
  const std::uint32_t n = surfels.count();
  const double area = static_cast<double>(surfels.areaEach) * n;
  if (n < 2 || !(area > 0.0)) return s;
  s.densest = std::sqrt(2.0 * area / (std::sqrt(3.0) * n));
  // Buckets of four times the densest spacing: a surfel without a neighbour so near counts with that distance.
  const BucketGrid grid(surfels.positionWorld, static_cast<float>(4.0 * s.densest));
  double sum = 0.0, squares = 0.0;
  s.min = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < n; ++i) {
    const double d = grid.nearest(i);
    s.min = std::min(s.min, d);
    sum += d;
    squares += d * d;
  }
  s.mean = sum / n;
  s.variation = s.mean > 0.0 ? std::sqrt(std::max(0.0, squares / n - s.mean * s.mean)) / s.mean : 0.0;
  return s;
}

namespace {

// [%] of a squared error; an estimate below 0, which is one of nearly none, is 0.
double percentOf(double squared) { return 100.0 * std::sqrt(std::max(squared, 0.0)); }

const char* testLightName(std::uint32_t kind) {
  switch (static_cast<TestLightKind>(kind)) {
    case TestLightKind::sky:
      return "sky";
    case TestLightKind::sun:
      return "sun";
    case TestLightKind::lamp:
      return "lamp";
  }
  return "unknown";
}

// Parts that have receivers, worst first. Estimates below 0 are of parts that add nearly none: they are no share, and
// take nothing off the others.
Json describeParts(const Bake& bake) {
  const Certificate& c = bake.certificate;
  std::vector<std::uint32_t> order;
  double sum = 0.0;
  for (std::uint32_t i = 0; i < c.partError.size(); ++i) {
    if (c.partReceivers[i] == 0) continue;
    order.push_back(i);
    sum += std::max(static_cast<double>(c.partError[i]), 0.0);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return c.partError[a] > c.partError[b]; });
  Json parts = Json::array();
  for (const std::uint32_t i : order) {
    const double error = static_cast<double>(c.partError[i]);
    parts.push_back({{"node", bake.instances[i].node},
                     {"receivers", c.partReceivers[i]},
                     {"squaredError", c.partError[i]},
                     {"share", error > 0.0 ? error / sum : 0.0}});
  }
  return parts;
}

}  // namespace

Json describeCertificate(const Bake& bake) {
  const Certificate& c = bake.certificate;
  if (c.empty()) return {};
  Json lights = Json::array();
  for (std::size_t i = 0; i < c.lightKind.size(); ++i)
    lights.push_back({{"kind", testLightName(c.lightKind[i])},
                      {"squaredError", c.squaredError[i]},
                      {"standardError", c.standardError[i]}});
  return {{"error", certifiedError(c)}, {"lights", lights}, {"parts", describeParts(bake)}};
}

std::string certificateText(const Bake& bake) {
  const Certificate& c = bake.certificate;
  if (c.empty()) return {};
  std::string text = printed("certified error %.1f %% (", 100.0 * static_cast<double>(certifiedError(c)));
  for (std::size_t i = 0; i < c.lightKind.size(); ++i)
    text += printed("%s%s %.1f", i > 0 ? ", " : "", testLightName(c.lightKind[i]),
                    percentOf(static_cast<double>(c.squaredError[i])));
  return text + ")";
}

std::string costText(const Bake& bake) {
  const RuntimeCost cost = runtimeCost(bake);
  return printed("%.1f MiB and %.2f ms a frame in a game", cost.bytes / 1048576.0, cost.frameMs);
}

Json describeBake(const Bake& bake, std::span<const ChunkInfo> chunks, std::uint64_t fileHash, bool packed) {
  const Provenance& p = bake.provenance;
  const Result<Json> options = readJson(p.optionsJson);
  std::uint64_t bytes = 0;
  for (const ChunkInfo& c : chunks) bytes = std::max(bytes, c.offset + c.bytes);
  const RuntimeCost cost = runtimeCost(bake);
  Json instances = Json::array();
  for (const BakedInstance& i : bake.instances)
    instances.push_back(
        {{"node", i.node}, {"mesh", i.mesh}, {"material", i.material}, {"hash", hexadecimal(i.contentHash)}});
  return {{"kind", "bake"},
          {"formatVersion", packed ? packedVersionOf(bake) : formatVersionOf(bake)},
          {"bytes", bytes},
          {"hash", hexadecimal(fileHash)},
          {"provenance",
           {{"toolVersion", p.toolVersion},
            {"algorithmVersion", p.algorithmVersion},
            {"sceneHash", hexadecimal(p.sceneHash)},
            {"seed", p.seed},
            {"rayTracer", p.rayTracer},
            {"lumaBands", p.lumaBands},
            {"chromaBands", p.chromaBands}}},
          {"options", options ? *options : Json(p.optionsJson)},
          {"surfels", describeSurfels(bake)},
          {"hierarchy",
           {{"nodes", bake.hierarchy.nodeCount()},
            {"levels", bake.hierarchy.levelCount()},
            {"groups", bake.hierarchy.groupRoot.size()},
            {"skyPatches", bake.hierarchy.skyDirection.size()}}},
          {"caches", describeCaches(bake.caches)},
          {"links", describeLinks(bake.links)},
          {"atRunTime",
           {{"memoryMiB", cost.bytes / 1048576.0}, {"frameMs", cost.frameMs}, {"processor", kReferenceProcessor}}},
          {"certificate", describeCertificate(bake)},
          {"instances", instances},
          {"chunks", describeChunks(chunks)}};
}

Json describeScene(const Scene& scene, Context& context) {
  std::uint32_t fixed = 0, gridLit = 0, dynamic = 0;
  for (const Instance& instance : scene.instances)
    (instance.charted() ? fixed : instance.baked() ? gridLit : dynamic) += 1;
  const SceneBounds bounds = boundsOf(scene);

  Json cameras = Json::array(), lights = Json::array(), volumes = Json::array(), findings = Json::array();
  for (const Camera& c : scene.cameras) cameras.push_back(c.name);
  for (const SceneLight& l : scene.lights) lights.push_back(describeLight(l, scene.lightUnit));
  for (const PlayVolume& v : scene.volumes) volumes.push_back(v.name);
  for (const MeshFinding& f : checkMeshes(scene, context))
    findings.push_back({{"what", toString(f.kind)},
                        {"mesh", f.mesh < scene.meshes.size() ? scene.meshes[f.mesh].name : ""},
                        {"node", f.node},
                        {"count", f.count},
                        {"firstTriangle", f.triangle}});
  std::uint64_t meshTriangles = 0;
  for (const Mesh& m : scene.meshes) meshTriangles += m.triangle.size();
  const auto emitting = std::count_if(scene.materials.begin(), scene.materials.end(), [](const Material& m) {
    return m.emission.x > 0.0f || m.emission.y > 0.0f || m.emission.z > 0.0f;
  });
  return {{"kind", "scene"},
          {"name", scene.name},
          {"triangles", scene.triangleCount()},
          {"meshTriangles", meshTriangles},
          {"meshes", scene.meshes.size()},
          {"instances", {{"static", fixed}, {"gridLit", gridLit}, {"dynamic", dynamic}}},
          {"materials", scene.materials.size()},
          {"emittingMaterials", emitting},
          {"images", scene.images.size()},
          {"boundsMinM", bounds.empty ? Json() : vec3(bounds.min)},
          {"boundsMaxM", bounds.empty ? Json() : vec3(bounds.max)},
          {"cameras", cameras},
          {"lightUnit", scene.lightUnit == LightUnit::photometric ? "photometric" : "radiometric"},
          {"lights", lights},
          {"volumes", volumes},
          {"exportedWith", scene.exportedWith ? Json(hexadecimal(*scene.exportedWith)) : Json()},
          {"meshReport", findings}};
}

}  // namespace relume
