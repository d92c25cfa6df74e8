// SPDX-License-Identifier: MIT
// Where receivers are read: see compare_receivers.h.
#include "tools/compare/compare_receivers.h"

#include "formats/pack.h"
#include "relume/bake/provenance.h"
#include "runtime/shared/stencil.h"
#include "tools/compare/compare_scene.h"
#include "tools/compare/fit_bake.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory_resource>
#include <optional>
#include <set>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kSurfaceReceivers = 32768, kMinOnPart = 8, kSurfels = 8192, kAirPoints = 4096;

using PartIndex = std::map<PartKey, std::uint32_t>;

PartIndex indexParts(std::span<const BakedInstance> parts) {
  PartIndex index;
  for (PartKey& key : partKeys(parts)) index.emplace(std::move(key), static_cast<std::uint32_t>(index.size()));
  return index;
}

// One side of a part's triangles on a bake's light map, as a renderer looks them up: what is not there reads the grid.
class SideOfPart {
 public:
  SideOfPart(const Bake& bake, std::uint32_t part, bool back)
      : map_(bake.caches.lightmap), corners_(back ? map_.backCornerUv : map_.cornerUv) {
    if (part < map_.parts.size()) part_ = &map_.parts[part];
  }

  std::uint32_t triangles() const { return part_ ? part_->triangleCount : 0; }
  bool onMap(std::uint32_t t) const {
    return t < triangles() && first(t) + 2 < corners_.size() && corners_[first(t)] != kGridLit &&
           corners_[first(t) + 1] != kGridLit && corners_[first(t) + 2] != kGridLit;
  }
  // A point's light-map coordinates; weights of the corners in glTF order. Only where onMap().
  glm::vec2 at(std::uint32_t t, const glm::vec3& weight) const {
    return weight.x * corner(t, 0) + weight.y * corner(t, 1) + weight.z * corner(t, 2);
  }
  // [texel²]
  double area(std::uint32_t t) const {
    const glm::dvec2 size(map_.width, map_.height);
    const glm::dvec2 u = size * glm::dvec2(corner(t, 1) - corner(t, 0)),
                     v = size * glm::dvec2(corner(t, 2) - corner(t, 0));
    return 0.5 * std::abs(u.x * v.y - u.y * v.x);
  }

 private:
  std::uint64_t first(std::uint32_t t) const { return part_->firstCorner + std::uint64_t{3} * t; }
  glm::vec2 corner(std::uint32_t t, std::uint32_t k) const { return unpackUnorm16x2(corners_[first(t) + k]); }

  const Lightmap& map_;
  const Array<std::uint32_t>& corners_;
  const LightmapPart* part_ = nullptr;
};

// Points spread over triangles of given areas: `count` of them at even steps along the sum of areas.
struct Sample {
  std::uint32_t triangle = 0;
  glm::vec3 weight{1.0f / 3.0f};  // of the corners
};

std::vector<Sample> spread(const std::vector<double>& area, std::size_t count) {
  double total = 0.0;
  for (const double a : area) total += a;
  std::vector<Sample> samples;
  if (!(total > 0.0) || !std::isfinite(total)) return samples;
  const double step = total / static_cast<double>(count);
  double sum = 0.0;
  std::size_t next = 0;
  for (std::uint32_t t = 0; t < area.size(); ++t) {
    sum += area[t];
    for (; next < count && (static_cast<double>(next) + 0.5) * step <= sum; ++next) {
      // R2 sequence, folded into the triangle.
      const double k = static_cast<double>(next) + 1.0;
      double u = k * 0.7548776662466927, v = k * 0.5698402909980532;
      u -= std::floor(u);
      v -= std::floor(v);
      if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
      samples.push_back({t, glm::vec3(1.0 - u - v, u, v)});
    }
  }
  return samples;
}

// Position and normals of a point of the light map, from the caches it copies from.
struct Spot {
  glm::vec3 positionWorld{0.0f}, normal{0.0f}, planeNormal{0.0f};
};

std::optional<Spot> spotOnMap(const Caches& caches, const PackedMap& map, const glm::vec2& uv) {
  const Stencil stencil = lightmapStencil(map, uv);
  const float total = stencil.total();
  if (!(total > 0.0f)) return std::nullopt;
  Spot spot;
  for (std::size_t k = 0; k < static_cast<std::size_t>(stencil.count); ++k) {
    spot.positionWorld += stencil.weight[k] / total * caches.positionWorld[stencil.cache[k]];
    spot.normal += stencil.weight[k] * caches.normal[stencil.cache[k]];
  }
  const float length = glm::length(spot.normal);
  if (!(length > 0.0f)) return std::nullopt;
  spot.normal /= length;
  spot.planeNormal = spot.normal;
  return spot;
}

class Placer {
 public:
  Placer(const Bake& a, const Bake& b, const Scene* scene)
      : a_(a),
        b_(b),
        mapA_(a.caches, std::pmr::new_delete_resource()),
        mapB_(b.caches, std::pmr::new_delete_resource()),
        scene_(scene),
        nodes_(nodesOfParts(a.instances)),
        groupOf_(nodes_.names.size(), Receivers::kAir),
        hasReceivers_(a.instances.size(), false) {
    out_.groups.push_back({"", "the air"});
  }

  Receivers run() {
    pairParts();
    out_.withoutMap = lacksCoordinates(a_) || lacksCoordinates(b_);
    if (!out_.withoutMap) placeOnSurfaces();
    if (scene_ == nullptr) placeAtSurfels();
    placeInAir();
    out_.partsMatched = static_cast<std::uint32_t>(std::count(hasReceivers_.begin(), hasReceivers_.end(), true));
    return std::move(out_);
  }

 private:
  struct Pair {
    std::uint32_t a, b, instance = 0;  // parts of the bakes, instance of the scene
    std::uint32_t triangles = 0;
    bool still = false;  // neither moved nor reshaped
  };

  // Add a receiver to its node's group.
  void addOnPart(std::uint32_t part, Receiver receiver) {
    const std::uint32_t node = nodes_.ofPart[part];
    if (groupOf_[node] == Receivers::kAir) {
      groupOf_[node] = static_cast<std::uint32_t>(out_.groups.size());
      out_.groups.push_back({nodes_.names[node], nodes_.texts[node]});
    }
    receiver.group = groupOf_[node];
    hasReceivers_[part] = true;
    out_.list.push_back(receiver);
  }

  // Whether triangle t of one is triangle t of the other.
  static bool sameTriangles(std::uint64_t hash, std::uint32_t count, std::uint64_t otherHash,
                            std::uint32_t otherCount) {
    return hash == otherHash || count == otherCount;
  }

  void pairParts() {
    const std::vector<std::optional<std::size_t>> answers = answersOf(a_.instances, b_.instances);
    const std::vector<PartKey> keysB = partKeys(b_.instances);
    const std::vector<BakedInstance> now = scene_ ? describeInstances(*scene_) : std::vector<BakedInstance>{};
    const PartIndex ofScene = indexParts(now);
    const auto& partsA = a_.caches.lightmap.parts;
    const auto& partsB = b_.caches.lightmap.parts;
    std::uint32_t found = 0, notInScene = 0;
    for (std::uint32_t k = 0; k < answers.size(); ++k) {
      if (!answers[k]) continue;
      const auto i = static_cast<std::uint32_t>(*answers[k]);
      ++found;
      const BakedInstance &before = a_.instances[i], &after = b_.instances[k];
      const std::uint32_t countA = i < partsA.size() ? partsA[i].triangleCount : 0;
      const std::uint32_t countB = k < partsB.size() ? partsB[k].triangleCount : 0;
      Pair pair{i, k};
      pair.triangles = std::max(countA, countB);
      pair.still = before.geometryHash == after.geometryHash && before.transformHash == after.transformHash;
      bool same = sameTriangles(before.geometryHash, countA, after.geometryHash, countB);
      if (scene_) {
        const auto instance = ofScene.find(keysB[k]);
        if (instance == ofScene.end()) {
          ++notInScene;
          continue;
        }
        pair.instance = instance->second;
        pair.triangles =
            static_cast<std::uint32_t>(scene_->meshes[scene_->instances[pair.instance].mesh].triangle.size());
        const std::uint64_t hash = now[pair.instance].geometryHash;
        same = sameTriangles(before.geometryHash, countA, hash, pair.triangles) &&
               sameTriangles(after.geometryHash, countB, hash, pair.triangles);
        if (!scene_->instances[pair.instance].baked()) continue;
      }
      if (same)
        pairs_.push_back(pair);
      else
        ++out_.partsReshaped;
    }
    out_.partsOnlyInA = static_cast<std::uint32_t>(a_.instances.size()) - found;
    out_.partsOnlyInB = static_cast<std::uint32_t>(b_.instances.size()) - found;
    out_.unmatched = 2 * (std::size_t{out_.partsOnlyInA} + out_.partsReshaped + notInScene) > a_.instances.size();
    std::sort(pairs_.begin(), pairs_.end(), [](const Pair& x, const Pair& y) { return x.a < y.a; });
  }

  // [m²] with a scene, else [texel²] of the larger of the two maps' triangles; 0 where neither map has one.
  std::vector<double> areasOf(const Pair& pair, bool back) const {
    const SideOfPart sideA(a_, pair.a, back), sideB(b_, pair.b, back);
    std::vector<double> area(pair.triangles, 0.0);
    for (std::uint32_t t = 0; t < pair.triangles; ++t) {
      const bool onA = sideA.onMap(t), onB = sideB.onMap(t);
      if (scene_ != nullptr) {
        // Backs are seen where a light map has them.
        if (back && !onA && !onB) continue;
        const auto corner = scene_->corners(scene_->instances[pair.instance], t);
        const glm::dvec3 u(corner[1] - corner[0]), v(corner[2] - corner[0]);
        area[t] = 0.5 * glm::length(glm::cross(u, v));
      } else {
        // A small triangle's corners may share one point of the map.
        constexpr double kMin = 0.01;
        area[t] = std::max(onA ? std::max(sideA.area(t), kMin) : 0.0, onB ? std::max(sideB.area(t), kMin) : 0.0);
      }
      if (!std::isfinite(area[t])) area[t] = 0.0;
    }
    return area;
  }

  void placeOnSurfaces() {
    std::vector<std::array<double, 2>> area(pairs_.size());
    double total = 0.0;
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      for (const bool back : {false, true}) {
        double& sum = area[i][back ? 1 : 0];
        for (const double a : areasOf(pairs_[i], back)) sum += a;
        total += sum;
      }
    }
    for (std::size_t i = 0; i < pairs_.size(); ++i) {
      for (const bool back : {false, true}) {
        const double share = area[i][back ? 1 : 0] / total;
        if (!(share > 0.0)) continue;
        const auto count = static_cast<std::size_t>(share * static_cast<double>(kSurfaceReceivers));
        for (const Sample& sample : spread(areasOf(pairs_[i], back), std::max(count, kMinOnPart)))
          addOnTriangle(pairs_[i], back, sample);
      }
    }
  }

  void addOnTriangle(const Pair& pair, bool back, const Sample& sample) {
    const SideOfPart sideA(a_, pair.a, back), sideB(b_, pair.b, back);
    Receiver r;
    r.a.onMap = sideA.onMap(sample.triangle);
    r.b.onMap = sideB.onMap(sample.triangle);
    if (r.a.onMap) r.a.uv = sideA.at(sample.triangle, sample.weight);
    if (r.b.onMap) r.b.uv = sideB.at(sample.triangle, sample.weight);
    std::optional<Spot> spotA, spotB;
    if (scene_ != nullptr) {
      spotA = spotB = spotInScene(pair.instance, back, sample);
    } else {
      if (r.a.onMap) spotA = spotOnMap(a_.caches, mapA_, r.a.uv);
      if (r.b.onMap) spotB = spotOnMap(b_.caches, mapB_, r.b.uv);
      if (!spotA) spotA = spotB;
      if (pair.still) spotB = spotA;
    }
    // Where B has a part that was moved off the map only its surfels tell.
    if (!spotA || !spotB) return;
    put(*spotA, r.a);
    put(*spotB, r.b);
    addOnPart(pair.a, r);
  }

  Spot spotInScene(std::uint32_t instance, bool back, const Sample& sample) const {
    const bool mirrored = scene_->instances[instance].flipped;
    const glm::vec2 bc =
        mirrored ? glm::vec2(sample.weight.z, sample.weight.y) : glm::vec2(sample.weight.y, sample.weight.z);
    const SurfacePoint point{instance, sample.triangle, bc};
    const auto corner = scene_->corners(scene_->instances[instance], sample.triangle);
    const float side = back ? -1.0f : 1.0f;
    return {(1.0f - bc.x - bc.y) * corner[0] + bc.x * corner[1] + bc.y * corner[2],
            side * shadingNormal(*scene_, point), side * geometricNormal(*scene_, point)};
  }

  static void put(const Spot& spot, Reading& reading) {
    reading.positionWorld = spot.positionWorld;
    reading.normal = spot.normal;
    reading.planeNormal = spot.planeNormal;
  }

  // Surfaces that read the grid have no texels to say where they are: surfels do, B's of what is elsewhere in A.
  void placeAtSurfels() {
    std::vector<std::uint32_t> partOf(a_.instances.size(), kNone), movedPartOf(b_.instances.size(), kNone);
    for (const Pair& pair : pairs_) (pair.still ? partOf[pair.a] : movedPartOf[pair.b]) = pair.a;
    placeAtSurfelsOf(a_.surfels, partOf);
    placeAtSurfelsOf(b_.surfels, movedPartOf);
  }

  // partOf: A's part for each of the bake's, or kNone to leave its surfels out.
  void placeAtSurfelsOf(const Surfels& s, const std::vector<std::uint32_t>& partOf) {
    std::vector<std::uint32_t> gridded;
    for (std::uint32_t i = 0; i < s.count(); ++i) {
      if (s.receiver[i] == kGridReceiver && partOf[s.instance[i]] != kNone) gridded.push_back(i);
    }
    const std::size_t stride = gridded.size() / kSurfels + 1;
    for (std::size_t k = 0; k < gridded.size(); k += stride) {
      const std::uint32_t i = gridded[k];
      addOnPart(partOf[s.instance[i]], inGrid(s.positionWorld[i], s.normal[i]));
    }
  }

  void placeInAir() {
    std::set<std::array<float, 3>> taken;
    for (const Bake* bake : {&a_, &b_}) {
      std::vector<glm::vec3> places;
      for (std::uint32_t i = 0; i < bake->caches.count(); ++i) {
        if (bake->caches.normal[i] == glm::vec3(0.0f)) places.push_back(bake->caches.positionWorld[i]);
      }
      const std::size_t stride = places.size() / kAirPoints + 1;
      for (std::size_t i = 0; i < places.size(); i += stride) {
        const glm::vec3& p = places[i];
        if (!taken.insert({p.x, p.y, p.z}).second) continue;
        for (const glm::vec3& axis : kAirDirections) out_.list.push_back(inGrid(p, axis));
      }
    }
  }

  static Receiver inGrid(const glm::vec3& position, const glm::vec3& normal) {
    Receiver r;
    put({position, normal, normal}, r.a);
    r.b = r.a;
    return r;
  }

  const Bake &a_, &b_;
  const PackedMap mapA_, mapB_;
  const Scene* scene_;
  std::vector<Pair> pairs_;
  const PartNodes nodes_;               // of A
  std::vector<std::uint32_t> groupOf_;  // [Size nodes] kAir: none yet
  std::vector<bool> hasReceivers_;      // [Size parts of A]
  Receivers out_;
};

}  // namespace

Receivers placeReceivers(const Bake& a, const Bake& b, const Scene* scene) { return Placer(a, b, scene).run(); }

}  // namespace relume
