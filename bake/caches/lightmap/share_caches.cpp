// SPDX-License-Identifier: MIT
// See share_caches.h.
#include "bake/caches/lightmap/share_caches.h"

#include "bake/base/parallel.h"
#include "bake/base/point_grid.h"
#include "bake/caches/lightmap/texel_units.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>

namespace relume {
namespace {

// Errors are relative to the light of a full texel of surface.
// Error of a cache that is one texel away: light that changes linearly is read as constant.
constexpr float kErrorPerTexel = 0.4f;
// Error per 1 - cosine of the angle between normals. Below kMinCosine, nothing is shared.
constexpr float kErrorPerNormal = 0.4f;
constexpr float kMinCosine = 0.4f;
// Error of reading the grid instead.
constexpr float kGridError = 0.8f;
// A cache is opened when it saves at least this error [full texels], times minChartTexels.
constexpr float kCacheCost = 0.1f;
// Factor on distance off the tangent planes: a shelf must not read the caches of the wall.
constexpr float kOffPlane = 3.0f;
// [texel] How far away from a cache texels can be that it is opened for.
constexpr float kMaxReach = 1.6f;
// [texel] How far away texels that no cache serves look for any cache in sight, before they read the grid.
constexpr float kLastReach = 3.0f;
// A cache keeps off spots that are so many times as close to what they see as the median of its texel's spots: what
// stands beside one of them would light all of the texel. docs/notes/lightmap.md has what this gains.
constexpr float kMaxNearness = 1.5f;
constexpr float kFreeNearness = 0.5f;  // [1/texel] of a spot that has nothing beside it, which is taken as it is
// Spots that are not looked at have no say in that: those from which fewer rays than this share of the most open spot's
// end on what the play space sees, or nowhere (a wall inside a rib that is laid on it), and then those so close to what
// they see (a wall behind a crate).
constexpr float kMinOpenShare = 0.75f;
constexpr float kCoveredNearness = 10.0f;  // [1/texel]
// With a larger share of near hits, a cache lies in a gap into which nothing looks.
constexpr float kMaxNearShare = 0.9f;
// Caches on surfaces may see this many times the share of back faces that caches of the grid may. They may see any
// share of other objects' backs as long as they see at least kMinSeenInGap of what the play space sees: the gap above a
// one-sided lamp is dark, but it is not inside the lamp. Backs of a cache's own object always count: between the layers
// of a curtain, a cache would be used in place of those that the curtain's light falls on.
constexpr float kTolerance = 2.0f;
constexpr float kMinSeenInGap = 0.05f;
constexpr int kRounds = 4;
constexpr std::size_t kSightTests = 6;  // caches whose sight a texel tests

// A unit or a cache, as those around it see it.
struct Neighbour {
  SurfaceSpot spot;
  std::uint32_t cache = 0;
  float texelSize = 0.0f;    // [m]
  float weight = 0.0f;       // [full texels]
  float error = kGridError;  // of the best cache so far
};

class Sharer {
 public:
  Sharer(const Scene& scene, const PatchSet& set, const PatchTexels& texels, const Prober& prober,
         const CacheOptions& options, std::size_t maxCaches)
      : scene_(scene),
        set_(set),
        texels_(texels),
        prober_(prober),
        options_(options),
        maxCaches_(maxCaches),
        reach_(std::min(kMaxReach, kGridError / kErrorPerTexel)),
        texelSize_(std::max(texels.texelSize, 1e-12f)) {}

  SharedCaches run(Context& context) {
    result_.cacheOfTexel.assign(texels_.texels.size(), kNoCache);
    findSpots(context);
    std::vector<std::uint32_t> open(texels_.texels.size());
    std::iota(open.begin(), open.end(), 0u);
    // Later rounds serve texels from which no nearby cache is in sight, or whose cache proved invalid.
    for (int round = 0; round < kRounds && !open.empty() && !context.cancelled(); ++round) {
      makeUnits(open, context);
      if (context.cancelled()) return {};
      const std::size_t before = result_.caches.size();
      openCaches(context);
      if (result_.tooMany) return tooMany();
      if (result_.caches.size() == before && round > 0) break;
      checkCaches(before, context);
      chooseCaches(open, before, reach_, kGridError, context);
      std::erase_if(open, [&](std::uint32_t texel) { return result_.cacheOfTexel[texel] != kNoCache; });
    }
    if (context.cancelled()) return {};
    chooseCaches(open, result_.caches.size(), kLastReach, INFINITY, context);
    if (context.cancelled()) return {};
    compact();
    result_.buried = std::move(spots_.invalid);
    return std::move(result_);
  }

 private:
  SurfaceSpot spotAt(std::uint32_t texel, std::uint32_t k) const {
    const PatchTexel& c = texels_.texels[texel];
    SurfaceSpot spot = spotOf(scene_, set_.patches[c.patch], texels_.points[c.firstPoint + k]);
    spot.positionWorld += spot.normal * prober_.liftAt(spot.positionWorld, texelSizeOf(set_, texels_, texel));
    return spot;
  }

  void findSpots(Context& context) {
    spots_.spot.resize(texels_.texels.size());
    spots_.share.resize(texels_.texels.size());
    spots_.invalid.assign(texels_.texels.size(), 0);
    parallelChunks(context, "", spots_.spot.size(), 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto texel = static_cast<std::uint32_t>(i);
        spots_.spot[i] = spotAt(texel, 0);
        spots_.share[i] = std::min(
            1.0f, texels_.texels[i].area / (texelSizeOf(set_, texels_, texel) * texelSizeOf(set_, texels_, texel)));
      }
    });
    spots_.low = glm::vec3(INFINITY);
    for (const SurfaceSpot& spot : spots_.spot) spots_.low = glm::min(spots_.low, spot.positionWorld);
  }

  // The units of the open texels, for searches around each.
  void makeUnits(const std::vector<std::uint32_t>& open, Context& context) {
    unit_ = makeTexelUnits(set_, texels_, spots_, open);
    std::vector<glm::vec3> position(unit_.size());
    for (std::size_t u = 0; u < unit_.size(); ++u) position[u] = unit_[u].spot.positionWorld;
    units_ = PointGrid(position, texelSize_, context);
    nearUnit_.clear();
    for (const std::uint32_t u : units_.order())
      nearUnit_.push_back({unit_[u].spot, 0, unit_[u].texelSize, unit_[u].weight, kGridError});
  }

  // Relative error when a cache elsewhere lights `spot`, whose texels have the given size; infinite = it must not.
  static float errorOf(const SurfaceSpot& spot, float texelSize, const glm::vec3& position, const glm::vec3& normal) {
    const float agree = glm::dot(normal, spot.normal);
    if (agree < kMinCosine) return INFINITY;
    const glm::vec3 way = position - spot.positionWorld;
    const float off = std::max(std::abs(glm::dot(way, spot.normal)), std::abs(glm::dot(way, normal)));
    const float distance = std::sqrt(glm::dot(way, way) + (kOffPlane * kOffPlane - 1.0f) * off * off);
    return kErrorPerTexel * distance / texelSize + kErrorPerNormal * (1.0f - agree);
  }

  // Visit the neighbours within a radius of p, and return how many were tested. `neighbour` is in the grid's order.
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

  // Go through the units, heaviest first, and open a cache where it saves its cost. Caches of earlier rounds are left
  // out: the texels that are still open do not see them. Whom a unit's cache would serve is found for many at a time,
  // by all threads; errors only fall, so that those it serves in its turn are among them.
  void openCaches(Context& context) {
    constexpr std::size_t kLeast = 32, kMost = 2048, kGrain = 32;  // [units] at a time
    constexpr std::size_t kMuch = std::size_t{1} << 19;            // neighbours: fewer units then, for their memory
    std::vector<Served> mayServe(std::min(kMost, unit_.size()));
    std::vector<Served::Reached> served;
    const float cost = kCacheCost * options_.minChartTexels;
    std::size_t count = 0, atATime = kMost / 8;
    for (std::size_t first = 0; first < unit_.size(); first += count) {
      count = std::min(atATime, unit_.size() - first);
      parallelChunks(context, "", count, kGrain, [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) findServed(unit_[first + i], mayServe[i]);
      });
      if (context.cancelled()) return;
      std::size_t found = 0;
      for (std::size_t i = 0; i < count; ++i) {
        TexelUnit& unit = unit_[first + i];
        result_.statistics.pairs += mayServe[i].pairs;
        found += mayServe[i].neighbour.size();
        served.clear();
        float saved = 0.0f;
        for (const Served::Reached& each : mayServe[i].neighbour) {
          const Neighbour& other = nearUnit_[each.unit];
          if (each.error >= other.error) continue;
          saved += other.weight * (other.error - each.error);
          served.push_back(each);
        }
        // (A full texel saves that much by itself, whatever lies around it.)
        if (!unit.mayOpen() || saved < cost) continue;
        for (const Served::Reached& each : served) nearUnit_[each.unit].error = each.error;
        unit.closed = true;
        owner_.push_back(unit.texel);
        result_.caches.push_back({unit.spot.positionWorld, unit.spot.normal});
        result_.tooMany = result_.caches.size() - invalidCaches_ > maxCaches_;
        if (result_.tooMany) return;
      }
      atATime = found > kMuch ? std::max(kLeast, atATime / 2) : std::min(kMost, 2 * atATime);
    }
  }

  // The neighbours that a cache of a unit would serve, with their errors then.
  struct Served {
    struct Reached {
      std::uint32_t unit = 0;  // in nearUnit_
      float error = 0.0f;
    };
    std::vector<Reached> neighbour;
    std::uint64_t pairs = 0;  // that were tested
  };
  void findServed(const TexelUnit& unit, Served& served) {
    served.neighbour.clear();
    served.pairs = 0;
    if (!unit.mayOpen()) return;
    const SurfaceSpot& spot = unit.spot;
    served.pairs =
        forEachNear(units_, nearUnit_, spot.positionWorld, reach_ * unit.texelSize, [&](const Neighbour& other) {
          const float error = errorOf(other.spot, other.texelSize, spot.positionWorld, spot.normal);
          if (error >= other.error) return;
          served.neighbour.push_back({static_cast<std::uint32_t>(&other - nearUnit_.data()), error});
        });
  }

  SharedCaches tooMany() const {
    SharedCaches none;
    none.tooMany = true;
    none.statistics.pairs = result_.statistics.pairs;
    return none;
  }

  struct ProbedSpot {
    std::uint32_t point = 0;  // of the texel's
    SurfaceSpot spot;
    float back = 0.0f, open = 0.0f, nearness = 0.0f;  // of its Surroundings; open: seen or missed
  };

  // Of spots from which few rays meet back faces, the first that is not much closer to something than most of them are.
  static const ProbedSpot& chooseOpen(const std::vector<ProbedSpot>& spots, float texelSize) {
    float mostOpen = 0.0f;
    for (const ProbedSpot& each : spots) mostOpen = std::max(mostOpen, each.open);
    const auto isLookedAt = [&](const ProbedSpot& each) { return each.open >= kMinOpenShare * mostOpen; };
    std::vector<float> nearness, covered;
    for (const ProbedSpot& each : spots)
      if (isLookedAt(each))
        (each.nearness * texelSize < kCoveredNearness ? nearness : covered).push_back(each.nearness);
    if (nearness.empty()) nearness.swap(covered);
    const auto middle = nearness.begin() + static_cast<std::ptrdiff_t>((nearness.size() - 1) / 2);
    std::nth_element(nearness.begin(), middle, nearness.end());
    return *std::find_if(spots.begin(), spots.end(), [&](const ProbedSpot& each) {
      return isLookedAt(each) && each.nearness <= kMaxNearness * *middle;
    });
  }

  // Choose a spot of a texel: among those from which few rays meet back faces, or otherwise the one from which the
  // fewest do. Spots that see mostly backs count only if they see enough of what the play space sees. 0 = none, 1 = the
  // texel's middle, 2 = another.
  int chooseSpot(std::uint32_t texel) {
    const float size = texelSizeOf(set_, texels_, texel), contact = 0.02f * size;
    const float tolerance = kTolerance * options_.maxBackFaceShare;
    const std::uint32_t own = set_.patches[texels_.texels[texel].patch].instance;
    std::vector<ProbedSpot> open;
    ProbedSpot least;
    least.back = INFINITY;
    for (std::uint32_t k = 0; k < texels_.texels[texel].pointCount; ++k) {
      const SurfaceSpot spot = spotAt(texel, k);
      if (spot.normal == glm::vec3(0.0f)) continue;
      const Surroundings around = prober_.probe(spot.positionWorld, spot.normal, contact, own);
      const bool outside = around.back <= tolerance && around.back + around.near <= kMaxNearShare;
      const bool gap = around.ownBack == 0.0f && around.seen >= kMinSeenInGap;
      if (!outside && !gap) continue;
      const ProbedSpot probed{k, spot, around.back, around.seen + around.missed, around.nearness};
      if (around.back <= options_.maxBackFaceShare) open.push_back(probed);
      if (around.back < least.back) least = probed;
      if (!open.empty() && open[0].nearness * size <= kFreeNearness) break;
    }
    if (!std::isfinite(least.back)) return 0;
    const ProbedSpot& chosen = open.empty() ? least : chooseOpen(open, size);
    spots_.spot[texel] = chosen.spot;
    return chosen.point == 0 ? 1 : 2;
  }

  void checkCaches(std::size_t first, Context& context) {
    std::vector<std::uint8_t> verdict(result_.caches.size() - first, 0);
    parallelChunks(context, "check caches", verdict.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) verdict[i] = static_cast<std::uint8_t>(chooseSpot(owner_[first + i]));
    });
    for (std::size_t i = 0; i < verdict.size(); ++i) {
      const auto cache = static_cast<std::uint32_t>(first + i);
      const std::uint32_t texel = owner_[cache];
      if (verdict[i] == 0) {
        spots_.invalid[texel] = 1;
        owner_[cache] = kNone;
        ++invalidCaches_;
        continue;
      }
      result_.statistics.moved += verdict[i] == 2;
      result_.caches[cache] = {spots_.spot[texel].positionWorld, spots_.spot[texel].normal};
      result_.cacheOfTexel[texel] = cache;
    }
  }

  bool inSight(std::uint32_t texel, std::uint32_t cache) const {
    // Lift both ends, to look over the unevenness of the surface.
    const SurfaceCache& other = result_.caches[cache];
    const float lift = 0.05f * glm::distance(spots_.spot[texel].positionWorld, other.positionWorld);
    return prober_.connected(spots_.spot[texel].positionWorld + spots_.spot[texel].normal * lift,
                             other.positionWorld + other.normal * lift);
  }

  // The valid ones of caches [begin, end), for searches near a texel.
  struct NearCaches {
    PointGrid grid;
    std::vector<Neighbour> cache;  // in the grid's order
  };
  NearCaches validCaches(std::size_t begin, std::size_t end, Context& context) const {
    std::vector<std::uint32_t> valid;
    std::vector<glm::vec3> position;
    for (std::size_t c = begin; c < end; ++c) {
      if (owner_[c] == kNone) continue;
      valid.push_back(static_cast<std::uint32_t>(c));
      position.push_back(result_.caches[c].positionWorld);
    }
    NearCaches near{PointGrid(position, texelSize_, context), {}};
    for (const std::uint32_t k : near.grid.order())
      near.cache.push_back({{position[k], result_.caches[valid[k]].normal}, valid[k]});
    return near;
  }

  // Let texels without a cache of their own read the cache of least error among those in sight. Caches before `fresh`
  // were asked for within reach_ and kGridError: those among the best that serve a texel no better than before are not
  // in its sight. (Who is among the best of all was among the best of the former.)
  void chooseCaches(const std::vector<std::uint32_t>& open, std::size_t fresh, float reach, float maxError,
                    Context& context) {
    constexpr float kSurely = 0.999f;  // within reach_, whatever is rounded
    const bool isWider = reach > reach_ || maxError > kGridError;
    NearCaches old = validCaches(0, fresh, context), added = validCaches(fresh, owner_.size(), context);
    parallelChunks(context, "", open.size(), 256, [&](std::size_t begin, std::size_t end) {
      struct Candidate {
        float error;
        std::uint32_t cache;
        bool isHidden;
        bool operator<(const Candidate& o) const { return error != o.error ? error < o.error : cache < o.cache; }
      };
      std::vector<Candidate> candidates;
      for (std::size_t i = begin; i < end; ++i) {
        const std::uint32_t texel = open[i];
        if (result_.cacheOfTexel[texel] != kNoCache) continue;
        candidates.clear();
        const SurfaceSpot& spot = spots_.spot[texel];
        const float texelSize = texelSizeOf(set_, texels_, texel), asked = kSurely * reach_ * texelSize;
        const auto collect = [&](NearCaches& caches, bool wasAsked) {
          forEachNear(caches.grid, caches.cache, spot.positionWorld, reach * texelSize, [&](const Neighbour& near) {
            const float error = errorOf(spot, texelSize, near.spot.positionWorld, near.spot.normal);
            if (!(error < maxError)) return;
            const glm::vec3 way = near.spot.positionWorld - spot.positionWorld;
            candidates.push_back(
                {error, near.cache, wasAsked && error < kGridError && glm::dot(way, way) <= asked * asked});
          });
        };
        collect(added, false);
        if (candidates.empty() && !isWider) continue;
        collect(old, true);
        const std::size_t tests = std::min(kSightTests, candidates.size());
        std::partial_sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(tests),
                          candidates.end());
        for (std::size_t k = 0; k < tests; ++k) {
          if (candidates[k].isHidden || !inSight(texel, candidates[k].cache)) continue;
          result_.cacheOfTexel[texel] = candidates[k].cache;
          break;
        }
      }
    });
  }

  // Close the gaps that invalid caches left.
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
    for (std::uint32_t& cache : result_.cacheOfTexel) {
      if (cache == kNoCache) continue;
      cache = renamed[cache];
      ++lit;
    }
    result_.statistics.shared = lit - count;
    result_.statistics.dropped = static_cast<std::uint32_t>(result_.cacheOfTexel.size()) - lit;
  }

  const Scene& scene_;
  const PatchSet& set_;
  const PatchTexels& texels_;
  const Prober& prober_;
  const CacheOptions& options_;
  const std::size_t maxCaches_;
  const float reach_;      // [texel] beyond which nothing is shared
  const float texelSize_;  // [m]
  TexelSpots spots_;
  std::vector<TexelUnit> unit_;
  std::vector<std::uint32_t> owner_;  // texel of each cache; kNone = invalid
  std::size_t invalidCaches_ = 0;     // among result_.caches
  PointGrid units_;
  std::vector<Neighbour> nearUnit_;  // the units in the grid's order
  SharedCaches result_;
};

}  // namespace

float ownCacheTexels(const CacheOptions& options) { return kCacheCost * options.minChartTexels / kGridError; }

SharedCaches shareCaches(const Scene& scene, const PatchSet& set, const PatchTexels& texels, const Prober& prober,
                         const CacheOptions& options, std::size_t maxCaches, Context& context) {
  return Sharer(scene, set, texels, prober, options, maxCaches).run(context);
}

}  // namespace relume
