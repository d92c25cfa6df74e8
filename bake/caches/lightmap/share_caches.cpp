// SPDX-License-Identifier: MIT
// See share_cells.h.
#include "bake/caches/lightmap/share_cells.h"

#include "bake/base/morton.h"
#include "bake/base/parallel.h"
#include "bake/base/point_grid.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

namespace relume {
namespace {

// Errors are relative, for a surface of a full texel. What a cache a texel away costs (constant light on a slope):
constexpr float kErrorPerTexel = 0.4f;
// What another normal costs, for opposite ones; below kMinCosine nothing is shared.
constexpr float kErrorPerNormal = 0.4f;
constexpr float kMinCosine = 0.4f;
// What the grid costs.
constexpr float kGridError = 0.8f;
// The error a cache must save, in full texels.
constexpr float kCacheCost = 0.1f;
// Distance off the tangent planes counts so much more than along them: a shelf is not the wall.
constexpr float kOffPlane = 3.0f;
// Texels with less surface than this choose in groups of neighbours that look the same way.
constexpr float kSmallShare = 0.25f;
constexpr float kGroupTexels = 0.4f;
// A cache looks this far for texels that it could serve.
constexpr float kMaxReach = 1.6f;
// And texels that nobody serves look this far for any cache in sight, before they turn to the grid.
constexpr float kLastReach = 3.0f;
// Beyond this share of near hits a cache lies in a gap that nothing looks into.
constexpr float kMaxNearShare = 0.9f;
// Surfaces bear so many times the share of back faces that the grid bears. They bear any share of other objects' backs
// where they see so much of what the play space sees: the gap over a one-sided lamp is dark, and not inside the lamp.
// Between backs of its own object, as between the layers of a curtain, a cache would take what light the object gets.
constexpr float kTolerance = 2.0f;
constexpr float kMinSeenShare = 0.05f;
constexpr int kRounds = 4;
constexpr std::size_t kSightTests = 6;

// Cells that open a cache together: the first one is where it sits.
struct Unit {
  std::uint32_t cell = 0;  // with the most surface
  float weight = 0.0f;     // [full texels]
  bool closed = false;     // opened a cache, or cannot
  float texel = 0.0f;      // [m]
  SurfaceSpot spot;        // of the cell
};

// A unit or a cache, for those around it.
struct Neighbour {
  SurfaceSpot spot;
  std::uint32_t cache = 0;
  float texel = 0.0f;        // [m]
  float weight = 0.0f;       // [full texels]
  float error = kGridError;  // of the best cache so far
};

class Sharer {
 public:
  Sharer(const Scene& scene, const PatchSet& set, const CellSet& cells, const Prober& prober,
         const CacheOptions& options, std::size_t mostCaches)
      : scene_(scene),
        set_(set),
        cells_(cells),
        prober_(prober),
        options_(options),
        mostCaches_(mostCaches),
        reach_(std::min(kMaxReach, kGridError / kErrorPerTexel)),
        voxel_(std::max(cells.texelSize, 1e-12f)) {}

  SharedCaches run(Context& context) {
    result_.cacheOfCell.assign(cells_.cells.size(), kNoCache);
    placeCells(context);
    std::vector<std::uint32_t> open(cells_.cells.size());
    std::iota(open.begin(), open.end(), 0u);
    // Later rounds serve cells from which no cache near by is in sight, or whose cache proved invalid.
    for (int round = 0; round < kRounds && !open.empty() && !context.cancelled(); ++round) {
      makeUnits(open, context);
      if (context.cancelled()) return {};
      const std::size_t before = result_.caches.size();
      openCaches(context);
      if (result_.tooMany) return tooMany();
      if (result_.caches.size() == before && round > 0) break;
      checkCaches(before, context);
      chooseCaches(open, reach_, kGridError, context);
      std::erase_if(open, [&](std::uint32_t cell) { return result_.cacheOfCell[cell] != kNoCache; });
    }
    if (context.cancelled()) return {};
    chooseCaches(open, kLastReach, INFINITY, context);
    if (context.cancelled()) return {};
    compact();
    result_.buried = std::move(invalid_);
    return std::move(result_);
  }

 private:
  float texelOf(std::uint32_t cell) const { return cells_.texelSize / set_.patches[cells_.cells[cell].patch].density; }

  SurfaceSpot placeOf(std::uint32_t cell, std::uint32_t k) const {
    const Cell& c = cells_.cells[cell];
    SurfaceSpot spot = spotOf(scene_, set_.patches[c.patch], cells_.points[c.firstPoint + k]);
    spot.positionWorld += spot.normal * prober_.liftAt(spot.positionWorld, texelOf(cell));
    return spot;
  }

  void placeCells(Context& context) {
    spot_.resize(cells_.cells.size());
    share_.resize(cells_.cells.size());
    invalid_.assign(cells_.cells.size(), 0);
    parallelChunks(context, "", spot_.size(), 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto cell = static_cast<std::uint32_t>(i);
        spot_[i] = placeOf(cell, 0);
        share_[i] = std::min(1.0f, cells_.cells[i].area / (texelOf(cell) * texelOf(cell)));
      }
    });
    low_ = glm::vec3(INFINITY);
    for (const SurfaceSpot& spot : spot_) low_ = glm::min(low_, spot.positionWorld);
  }

  std::uint64_t groupOf(const glm::vec3& p) const { return mortonOf((p - low_) / (kGroupTexels * voxel_)); }

  // The face of a cube that a normal goes through.
  static std::uint32_t sideOf(const glm::vec3& n) {
    const glm::vec3 a = glm::abs(n);
    const int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
    return static_cast<std::uint32_t>(2 * axis + (n[axis] < 0.0f ? 1 : 0));
  }

  // Group the small cells; order by weight.
  void makeUnits(const std::vector<std::uint32_t>& open, Context& context) {
    struct Small {
      std::uint64_t voxel;
      std::uint32_t look, cell;
    };
    std::vector<Small> small;
    unit_.clear();
    for (const std::uint32_t cell : open) {
      if (share_[cell] >= kSmallShare) {
        unit_.push_back({cell, share_[cell], invalid_[cell] != 0, texelOf(cell), spot_[cell]});
        continue;
      }
      small.push_back({groupOf(spot_[cell].positionWorld), sideOf(spot_[cell].normal), cell});
    }
    std::sort(small.begin(), small.end(), [](const Small& a, const Small& b) {
      if (a.voxel != b.voxel) return a.voxel < b.voxel;
      return a.look != b.look ? a.look < b.look : a.cell < b.cell;
    });
    for (std::size_t begin = 0; begin < small.size();) {
      Unit unit{kNone, 0.0f, true, 0.0f, {}};
      std::size_t end = begin;
      for (; end < small.size() && small[end].voxel == small[begin].voxel && small[end].look == small[begin].look;
           ++end) {
        const std::uint32_t cell = small[end].cell;
        unit.weight += share_[cell];
        const bool better = unit.cell == kNone || invalid_[cell] < invalid_[unit.cell] ||
                            (invalid_[cell] == invalid_[unit.cell] && share_[cell] > share_[unit.cell]);
        if (better) unit.cell = cell;
      }
      unit.closed = invalid_[unit.cell] != 0;
      unit.texel = texelOf(unit.cell);
      unit.spot = spot_[unit.cell];
      unit_.push_back(unit);
      begin = end;
    }
    std::stable_sort(unit_.begin(), unit_.end(), [](const Unit& a, const Unit& b) { return a.weight > b.weight; });
    std::vector<glm::vec3> position(unit_.size());
    for (std::size_t u = 0; u < unit_.size(); ++u) position[u] = unit_[u].spot.positionWorld;
    units_ = PointGrid(position, voxel_, context);
    nearUnit_.clear();
    for (const std::uint32_t u : units_.order())
      nearUnit_.push_back({unit_[u].spot, 0, unit_[u].texel, unit_[u].weight, kGridError});
  }

  // Relative error of lighting `spot`, with texels of the given size, by a cache elsewhere; infinite = not at all.
  static float errorOf(const SurfaceSpot& spot, float texel, const glm::vec3& position, const glm::vec3& normal) {
    const float agree = glm::dot(normal, spot.normal);
    if (agree < kMinCosine) return INFINITY;
    const glm::vec3 way = position - spot.positionWorld;
    const float off = std::max(std::abs(glm::dot(way, spot.normal)), std::abs(glm::dot(way, normal)));
    const float distance = std::sqrt(glm::dot(way, way) + (kOffPlane * kOffPlane - 1.0f) * off * off);
    return kErrorPerTexel * distance / texel + kErrorPerNormal * (1.0f - agree);
  }

  // Visit the points of a grid no farther than a radius. Returns how many were asked. [neighbour: in the grid's order]
  template <class Visit>
  static std::uint64_t forEachNear(const PointGrid& grid, std::span<Neighbour> neighbour, const glm::vec3& p,
                                   float radius, const Visit& visit) {
    std::uint64_t pairs = 0;
    grid.forEachRunIn(grid.boxAround(p, radius), [&](std::uint32_t begin, std::uint32_t end) {
      pairs += end - begin;
      for (Neighbour& each : neighbour.subspan(begin, end - begin)) {
        const glm::vec3 way = each.spot.positionWorld - p;
        if (glm::dot(way, way) <= radius * radius) visit(each);
      }
    });
    return pairs;
  }

  // Walk the units, heaviest first, and open a cache where it saves its cost. Caches of earlier rounds are not asked:
  // what is open now does not see them.
  void openCaches(const Context& context) {
    std::vector<std::pair<Neighbour*, float>> served;
    const float cost = kCacheCost * options_.minChartTexels;
    for (Unit& unit : unit_) {
      if (context.cancelled()) return;
      if (unit.closed || unit.weight <= 0.0f) continue;
      const SurfaceSpot& spot = unit.spot;
      served.clear();
      float saved = 0.0f;
      const auto serve = [&](Neighbour& other) {
        const float error = errorOf(other.spot, other.texel, spot.positionWorld, spot.normal);
        if (error >= other.error) return;
        saved += other.weight * (other.error - error);
        served.emplace_back(&other, error);
      };
      result_.statistics.pairs += forEachNear(units_, nearUnit_, spot.positionWorld, reach_ * unit.texel, serve);
      // Full texels earn their cache by themselves, so that what lies around them does not decide.
      if (saved < cost) continue;
      for (const auto& [other, error] : served) other->error = error;
      unit.closed = true;
      owner_.push_back(unit.cell);
      result_.caches.push_back({spot.positionWorld, spot.normal});
      result_.tooMany = result_.caches.size() - invalidCaches_ > mostCaches_;
      if (result_.tooMany) return;
    }
  }

  SharedCaches tooMany() const {
    SharedCaches none;
    none.tooMany = true;
    none.statistics.pairs = result_.statistics.pairs;
    return none;
  }

  // The first place of a cell from which few rays see the inside of things, or else the one that sees least of it, as
  // long as most of what it sees is fronts, for one-sided levels show their backs, or it looks out at what matters.
  // 0 none, 1 its middle, 2 another.
  int findPlace(std::uint32_t cell) {
    const float contact = 0.02f * texelOf(cell), tolerance = kTolerance * options_.maxBackFaceShare;
    const std::uint32_t own = set_.patches[cells_.cells[cell].patch].instance;
    float least = INFINITY;
    int verdict = 0;
    for (std::uint32_t k = 0; k < cells_.cells[cell].pointCount; ++k) {
      const SurfaceSpot candidate = placeOf(cell, k);
      if (candidate.normal == glm::vec3(0.0f)) continue;
      const Surroundings around = prober_.probe(candidate.positionWorld, candidate.normal, contact, own);
      const bool outside = around.back <= tolerance && around.back + around.near <= kMaxNearShare;
      const bool gap = around.ownBack == 0.0f && around.seen >= kMinSeenShare;
      if ((!outside && !gap) || around.back >= least) continue;
      spot_[cell] = candidate;
      verdict = k == 0 ? 1 : 2;
      if (around.back <= options_.maxBackFaceShare) break;
      least = around.back;
    }
    return verdict;
  }

  void checkCaches(std::size_t first, Context& context) {
    std::vector<std::uint8_t> verdict(result_.caches.size() - first, 0);
    parallelChunks(context, "check caches", verdict.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) verdict[i] = static_cast<std::uint8_t>(findPlace(owner_[first + i]));
    });
    for (std::size_t i = 0; i < verdict.size(); ++i) {
      const auto cache = static_cast<std::uint32_t>(first + i);
      const std::uint32_t cell = owner_[cache];
      if (verdict[i] == 0) {
        invalid_[cell] = 1;
        owner_[cache] = kNone;
        ++invalidCaches_;
        continue;
      }
      result_.statistics.moved += verdict[i] == 2;
      result_.caches[cache] = {spot_[cell].positionWorld, spot_[cell].normal};
      result_.cacheOfCell[cell] = cache;
    }
  }

  bool inSight(std::uint32_t cell, std::uint32_t cache) const {
    // Look over the surface's own unevenness.
    const SurfaceCache& other = result_.caches[cache];
    const float lift = 0.05f * glm::distance(spot_[cell].positionWorld, other.positionWorld);
    return prober_.connected(spot_[cell].positionWorld + spot_[cell].normal * lift,
                             other.positionWorld + other.normal * lift);
  }

  // Cells without a cache of their own read the one of least error among those in sight.
  void chooseCaches(const std::vector<std::uint32_t>& open, float reach, float maxError, Context& context) {
    std::vector<std::uint32_t> valid;
    std::vector<glm::vec3> position;
    for (std::uint32_t c = 0; c < owner_.size(); ++c) {
      if (owner_[c] == kNone) continue;
      valid.push_back(c);
      position.push_back(result_.caches[c].positionWorld);
    }
    const PointGrid grid(position, voxel_, context);
    std::vector<Neighbour> nearCache;
    for (const std::uint32_t k : grid.order())
      nearCache.push_back({{position[k], result_.caches[valid[k]].normal}, valid[k]});
    parallelChunks(context, "", open.size(), 256, [&](std::size_t begin, std::size_t end) {
      std::vector<std::pair<float, std::uint32_t>> candidates;
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t cell = open[i];
        if (result_.cacheOfCell[cell] != kNoCache) continue;
        candidates.clear();
        const float texel = texelOf(cell);
        forEachNear(grid, nearCache, spot_[cell].positionWorld, reach * texel, [&](const Neighbour& near) {
          const float error = errorOf(spot_[cell], texel, near.spot.positionWorld, near.spot.normal);
          if (error < maxError) candidates.emplace_back(error, near.cache);
        });
        const std::size_t tests = std::min(kSightTests, candidates.size());
        std::partial_sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(tests),
                          candidates.end());
        for (std::size_t k = 0; k < tests; ++k) {
          if (!inSight(cell, candidates[k].second)) continue;
          result_.cacheOfCell[cell] = candidates[k].second;
          break;
        }
      }
    });
  }

  // Close the gaps that invalid owners left.
  void compact() {
    std::vector<std::uint32_t> renamed(result_.caches.size(), kNoCache);
    std::uint32_t count = 0;
    for (std::size_t c = 0; c < renamed.size(); ++c) {
      if (owner_[c] == kNone) continue;
      result_.caches[count] = result_.caches[c];
      renamed[c] = count++;
    }
    result_.caches.resize(count);
    std::uint32_t lit = 0;
    for (std::uint32_t& cache : result_.cacheOfCell) {
      if (cache == kNoCache) continue;
      cache = renamed[cache];
      ++lit;
    }
    result_.statistics.shared = lit - count;
    result_.statistics.dropped = static_cast<std::uint32_t>(result_.cacheOfCell.size()) - lit;
  }

  const Scene& scene_;
  const PatchSet& set_;
  const CellSet& cells_;
  const Prober& prober_;
  const CacheOptions& options_;
  const std::size_t mostCaches_;
  const float reach_;                  // [texel] beyond which nothing is shared
  const float voxel_;                  // [m]
  std::vector<SurfaceSpot> spot_;      // of a cell
  std::vector<float> share_;           // of a full texel that a cell's surface is, [0..1]
  std::vector<std::uint8_t> invalid_;  // every place of the cell is behind or inside something
  std::vector<Unit> unit_;
  std::vector<std::uint32_t> owner_;  // cell of a cache; kNone = invalid
  std::size_t invalidCaches_ = 0;     // among result_.caches
  PointGrid units_;
  std::vector<Neighbour> nearUnit_;  // the units in the grid's order
  glm::vec3 low_{0.0f};              // [m] of all cells
  SharedCaches result_;
};

}  // namespace

float ownCacheTexels(const CacheOptions& options) { return kCacheCost * options.minChartTexels / kGridError; }

SharedCaches shareCells(const Scene& scene, const PatchSet& set, const CellSet& cells, const Prober& prober,
                        const CacheOptions& options, std::size_t mostCaches, Context& context) {
  return Sharer(scene, set, cells, prober, options, mostCaches).run(context);
}

}  // namespace relume
