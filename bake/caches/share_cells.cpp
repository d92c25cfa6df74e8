// SPDX-License-Identifier: MIT
// See share_cells.h.
#include "bake/caches/share_cells.h"

#include "bake/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_map>

namespace relume {
namespace {

constexpr int kMaxRounds = 8;
constexpr std::size_t kMostRejects = 4;
// Beyond this share of near hits a cache lies in a gap that nothing looks into.
constexpr float kMaxNearShare = 0.9f;

// Reach of a cell that stands for `share` of a full texel, in texels.
float reachOf(float share) { return 0.3f + 0.6f * (1.0f - share); }
// Least cosine between the normals of cell and cache.
float cosineOf(float share) { return glm::mix(0.65f, 0.97f, std::min(1.0f, 2.0f * share)); }

// Caches by place.
class CacheHash {
 public:
  explicit CacheHash(float size) : inverse_(1.0f / size) {}
  void add(std::uint32_t cache, const glm::vec3& p) { table_[key(cellOf(p))].push_back(cache); }
  void remove(std::uint32_t cache, const glm::vec3& p) { std::erase(table_[key(cellOf(p))], cache); }
  template <class Visit>
  void near(const glm::vec3& p, float radius, Visit&& visit) const {
    const glm::ivec3 low = cellOf(p - radius), high = cellOf(p + radius);
    for (int z = low.z; z <= high.z; ++z) {
      for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
          const auto found = table_.find(key({x, y, z}));
          if (found == table_.end()) continue;
          for (const std::uint32_t cache : found->second) visit(cache);
        }
      }
    }
  }

 private:
  glm::ivec3 cellOf(const glm::vec3& p) const { return glm::ivec3(glm::floor(glm::clamp(p * inverse_, -1e6f, 1e6f))); }
  static std::uint64_t key(const glm::ivec3& c) {
    const auto part = [](int v) { return static_cast<std::uint64_t>(v + (1 << 20)) & 0x1FFFFFu; };
    return part(c.x) | (part(c.y) << 21) | (part(c.z) << 42);
  }
  float inverse_;
  std::unordered_map<std::uint64_t, std::vector<std::uint32_t>> table_;
};

enum class State : std::uint8_t { open, owner, sharer, dropped };

class Sharer {
 public:
  Sharer(const Scene& scene, const PatchSet& set, const CellSet& cells, const Prober* prober, float maxBackFaceShare, float minChartTexels)
      : scene_(scene), set_(set), cells_(cells), prober_(prober), maxBackFaceShare_(maxBackFaceShare), fullTexels_(std::max(minChartTexels, 1e-6f)),
        hash_(std::max(cells.texelSize, 1e-12f)), state_(cells.cells.size(), State::open), invalid_(cells.cells.size(), 0),
        spot_(cells.cells.size()), rejects_(cells.cells.size()) {
    for (auto& r : rejects_) r.fill(kNoCache);
    result_.cacheOfCell.assign(cells.cells.size(), kNoCache);
  }

  SharedCaches run(Context& context) {
    prepare(context);
    for (int round = 0; round < kMaxRounds && !context.cancelled(); ++round) {
      if (!assign(round + 1 == kMaxRounds)) break;
      if (!prober_) break;
      verify(context);
      settle();
    }
    if (prober_) improve(context);
    compact();
    return std::move(result_);
  }

 private:
  float localTexel(std::uint32_t cell) const { return cells_.texelSize / set_.patches[cells_.cells[cell].patch].density; }
  float shareOf(std::uint32_t cell) const {
    const float texel = localTexel(cell);
    return std::min(1.0f, cells_.cells[cell].area / (texel * texel * fullTexels_));
  }
  SurfaceSpot place(std::uint32_t cell, std::uint32_t k) const {
    const Cell& c = cells_.cells[cell];
    SurfaceSpot spot = spotOf(scene_, set_.patches[c.patch], cells_.points[c.firstPoint + k]);
    const float lift = prober_ ? prober_->liftAt(spot.positionWorld, localTexel(cell)) : 0.0f;
    spot.positionWorld += spot.normal * lift;
    return spot;
  }

  // Large cells choose first.
  void prepare(Context& context) {
    order_.resize(cells_.cells.size());
    std::iota(order_.begin(), order_.end(), 0u);
    std::vector<float> share(order_.size());
    parallelChunks(context, "", order_.size(), 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        spot_[i] = place(static_cast<std::uint32_t>(i), 0);
        share[i] = shareOf(static_cast<std::uint32_t>(i));
      }
    });
    std::stable_sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) { return share[a] > share[b]; });
  }

  // The best cache a cell may share, or kNoCache. Distance along the normal counts three times: shelves are not walls.
  std::uint32_t bestCache(std::uint32_t cell) const {
    const float share = shareOf(cell), reach = reachOf(share) * localTexel(cell), cosine = cosineOf(share);
    const SurfaceSpot& spot = spot_[cell];
    std::uint32_t best = kNoCache;
    float least = reach * reach;
    hash_.near(spot.positionWorld, reach, [&](std::uint32_t cache) {
      const SurfaceCache& other = result_.caches[cache];
      const float agree = glm::dot(other.normal, spot.normal);
      if (agree < cosine) return;
      if (std::find(rejects_[cell].begin(), rejects_[cell].end(), cache) != rejects_[cell].end()) return;
      const glm::vec3 way = other.positionWorld - spot.positionWorld;
      const float off = std::max(std::abs(glm::dot(way, spot.normal)), std::abs(glm::dot(way, other.normal)));
      const float cost = glm::dot(way, way) + 8.0f * off * off + 0.25f * reach * reach * (1.0f - agree);
      if (cost < least || (cost == least && cache < best)) {
        least = cost;
        best = cache;
      }
    });
    return best;
  }

  // Give every open cell a cache near by or one of its own. False when none was open.
  bool assign(bool last) {
    bool any = false;
    fresh_.clear();
    tentative_.clear();
    for (const std::uint32_t cell : order_) {
      if (state_[cell] != State::open) continue;
      any = true;
      const std::uint32_t best = bestCache(cell);
      if (best != kNoCache) {
        state_[cell] = State::sharer;
        result_.cacheOfCell[cell] = best;
        tentative_.push_back(cell);
      } else if (invalid_[cell] || last) {
        state_[cell] = State::dropped;
      } else {
        state_[cell] = State::owner;
        result_.cacheOfCell[cell] = static_cast<std::uint32_t>(result_.caches.size());
        owner_.push_back(cell);
        result_.caches.push_back({spot_[cell].positionWorld, spot_[cell].normal});
        hash_.add(result_.cacheOfCell[cell], spot_[cell].positionWorld);
        fresh_.push_back(cell);
      }
    }
    return any;
  }

  // The first place of a cell from which few rays see the inside of things.
  bool findPlace(std::uint32_t cell, SurfaceSpot& spot, bool& moved) const {
    const float contact = 0.02f * localTexel(cell);
    for (std::uint32_t k = 0; k < cells_.cells[cell].pointCount; ++k) {
      const SurfaceSpot candidate = place(cell, k);
      if (candidate.normal == glm::vec3(0.0f)) continue;
      const Surroundings around = prober_->probe(candidate.positionWorld, candidate.normal, contact);
      if (around.back > maxBackFaceShare_ || around.back + around.near > kMaxNearShare) continue;
      spot = candidate;
      moved = k > 0;
      return true;
    }
    return false;
  }

  void verify(Context& context) {
    verdict_.assign(fresh_.size(), 0);
    parallelChunks(context, "check caches", fresh_.size(), 64, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        bool moved = false;
        if (findPlace(fresh_[i], spot_[fresh_[i]], moved)) verdict_[i] = moved ? 2 : 1;
      }
    });
    inSight_.assign(tentative_.size(), 0);
    parallelChunks(context, "", tentative_.size(), 1024, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) inSight_[i] = sees(tentative_[i], result_.cacheOfCell[tentative_[i]]);
    });
  }

  bool sees(std::uint32_t cell, std::uint32_t cache) const {
    // Look over the surface's own unevenness.
    const SurfaceCache& other = result_.caches[cache];
    const float lift = 0.05f * glm::distance(spot_[cell].positionWorld, other.positionWorld);
    return prober_->connected(spot_[cell].positionWorld + spot_[cell].normal * lift, other.positionWorld + other.normal * lift);
  }

  void settle() {
    for (std::size_t i = 0; i < fresh_.size(); ++i) {
      const std::uint32_t cell = fresh_[i], cache = result_.cacheOfCell[cell];
      hash_.remove(cache, result_.caches[cache].positionWorld);
      if (verdict_[i] == 0) {
        state_[cell] = State::open;
        invalid_[cell] = 1;
        result_.cacheOfCell[cell] = kNoCache;
        owner_[cache] = kNone;
        continue;
      }
      result_.statistics.moved += verdict_[i] == 2;
      result_.caches[cache] = {spot_[cell].positionWorld, spot_[cell].normal};
      hash_.add(cache, spot_[cell].positionWorld);
    }
    for (std::size_t i = 0; i < tentative_.size(); ++i) {
      const std::uint32_t cell = tentative_[i], cache = result_.cacheOfCell[cell];
      if (inSight_[i] && owner_[cache] != kNone) continue;
      state_[cell] = State::open;
      result_.cacheOfCell[cell] = kNoCache;
      auto& rejects = rejects_[cell];
      const auto free = std::find(rejects.begin(), rejects.end(), kNoCache);
      if (free != rejects.end()) *free = cache;
    }
  }

  // Now that all caches are known, let sharers read the nearest one.
  void improve(Context& context) {
    std::vector<std::uint32_t> better(cells_.cells.size(), kNoCache);
    parallelChunks(context, "", cells_.cells.size(), 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const auto cell = static_cast<std::uint32_t>(i);
        if (state_[cell] != State::sharer) continue;
        const std::uint32_t best = bestCache(cell);
        if (best != kNoCache && best != result_.cacheOfCell[cell] && sees(cell, best)) better[cell] = best;
      }
    });
    for (std::size_t cell = 0; cell < better.size(); ++cell) {
      if (better[cell] != kNoCache) result_.cacheOfCell[cell] = better[cell];
    }
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
    for (std::size_t cell = 0; cell < state_.size(); ++cell) {
      std::uint32_t& cache = result_.cacheOfCell[cell];
      if (cache != kNoCache) cache = renamed[cache];
      result_.statistics.shared += state_[cell] == State::sharer;
      result_.statistics.dropped += cache == kNoCache;
    }
  }

  const Scene& scene_;
  const PatchSet& set_;
  const CellSet& cells_;
  const Prober* prober_;
  float maxBackFaceShare_;
  const float fullTexels_;  // [texel²] surface that deserves a cache of its own
  CacheHash hash_;
  std::vector<State> state_;
  std::vector<std::uint8_t> invalid_;   // every place of the cell is behind or inside something
  std::vector<SurfaceSpot> spot_;       // of a cell
  std::vector<std::array<std::uint32_t, kMostRejects>> rejects_;  // caches out of the cell's sight
  std::vector<std::uint32_t> order_;    // cells, fullest first
  std::vector<std::uint32_t> owner_;    // cell of a cache; kNone = invalid
  std::vector<std::uint32_t> fresh_, tentative_;  // cells that got, or share, a cache this round
  std::vector<std::uint8_t> verdict_, inSight_;
  SharedCaches result_;
};

}  // namespace

SharedCaches shareCells(const Scene& scene, const PatchSet& set, const CellSet& cells, const Prober* prober,
                        float maxBackFaceShare, float minChartTexels, Context& context) {
  return Sharer(scene, set, cells, prober, maxBackFaceShare, minChartTexels).run(context);
}

}  // namespace relume
