// SPDX-License-Identifier: MIT
// Sample elimination for Poisson disk sample sets (Yuksel 2015): of too many candidates, remove again and again the one
// that is most crowded, where neighbour j at distance d crowds candidate i by (1 - d / D)^8. Removing goes on below the
// wanted count with D growing, halving by halving; read backwards, the order of removal is progressive.
//
// Deviation: a queue of buckets in place of the paper's heap; what falls into one bucket is as crowded to 1 in 65536.
// Deviation: elimination alone gives boundaries and scattered small parts more than their area's share, because they
// are crowded less. Surfels must be of equal area, so every cell of space has a quota by its share of the candidates,
// and being above it adds to the crowding of its points. Being below it takes nothing from that: in a cell with a quota
// of a few points it would keep pairs that all but touch.
#include "bake/surfels/eliminate.h"

#include "bake/parallel.h"
#include "bake/surfels/neighbours.h"
#include "bake/surfels/point_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

namespace relume {
namespace {

constexpr float kWeightLimitBase = 0.65f;     // beta of the paper
constexpr float kWeightLimitExponent = 1.5f;  // gamma of the paper
constexpr float kQuotaCellSpacings = 8.0f;    // size of a quota's cell in spacings
constexpr float kQuotaWeight = 1e-3f;         // crowding of a cell twice as full as its quota; a pair at 0.6 D: 7e-4
constexpr std::size_t kCellsPerChunk = 512;

// A cell of space that should keep its share of the points.
struct QuotaCell {
  std::uint32_t left = 0;        // points that are not removed yet
  std::uint32_t quota = 0;       // points that should stay
  std::uint32_t nextUpdate = 0;  // when so many are left, the penalty is set anew
  float penalty = 0.0f;

  // Every change makes the keys of all the cell's points out of date, so the penalty falls in steps: large ones while
  // the cell is far too full.
  void update() {
    const float above = left > quota ? static_cast<float>(left - quota) : 0.0f;
    penalty = kQuotaWeight * above / (static_cast<float>(quota) + 1.0f);
    const std::uint32_t step = std::max({1u, left > quota ? (left - quota) / 3 : 0u, quota / 16});
    nextUpdate = left > step ? left - step : 0;
  }
  void remove() {
    if (--left <= nextUpdate) update();
  }
};

// What removing a point changes of its neighbours and needs of them, in half a cache line.
struct alignas(32) Point {
  glm::vec3 positionWorld{0.0f};
  float weight = 0.0f;
  float reach = 0.0f;  // [m] D
  std::uint32_t quotaCell = 0;
  std::uint32_t next = 0;  // in its bucket of the queue
  bool gone = false;
};

// One round: candidates sorted by grid cell, their neighbours and weights.
struct Round {
  std::vector<std::uint32_t> source;  // index of each point among the candidates
  std::vector<SurfaceNode> node;
  std::vector<Point> points;
  std::vector<std::size_t> neighbourBegin;
  std::vector<std::uint32_t> neighbour;
  std::vector<QuotaCell> cells;
  float limit = 0.0f;  // distances below limit * D crowd no more than at it

  // How much a point is in the way: by its neighbours, and by its cell's excess over its quota. Only ever falls.
  float excess(const Point& point) const { return point.weight + cells[point.quotaCell].penalty; }
};

// (1 - d / D)^8, d limited from below.
float crowding(float distanceSquared, float reach, float limit) {
  const float t = 1.0f - std::max(std::sqrt(distanceSquared) / reach, limit);
  const float t2 = t * t, t4 = t2 * t2;
  return t4 * t4;
}

// Spread the low 21 bits to every third bit.
std::uint64_t spreadBits(std::uint64_t v) {
  v &= 0x1FFFFF;
  v = (v | v << 32) & 0x1F00000000FFFFull;
  v = (v | v << 16) & 0x1F0000FF0000FFull;
  v = (v | v << 8) & 0x100F00F00F00F00Full;
  v = (v | v << 4) & 0x10C30C30C30C30C3ull;
  v = (v | v << 2) & 0x1249249249249249ull;
  return v;
}

// Give every cell of space its share of `count`, rounding errors carried on along a Morton curve, emitter by emitter.
void setQuotas(Round& round, std::uint32_t count, float cellSize) {
  struct Place {
    std::uint32_t emitter, point;
    std::uint64_t morton;
  };
  const std::size_t n = round.node.size();
  glm::vec3 low = round.node[0].positionWorld;
  for (const SurfaceNode& node : round.node) {
    for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], node.positionWorld[k]);
  }
  std::vector<Place> places(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    std::uint64_t morton = 0;
    for (int k = 0; k < 3; ++k) {
      const float cell = std::min((round.node[i].positionWorld[k] - low[k]) / cellSize, 2097151.0f);
      morton |= spreadBits(static_cast<std::uint64_t>(cell)) << k;
    }
    places[i] = {round.node[i].emitter, i, morton};
  }
  std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    if (a.emitter != b.emitter) return a.emitter < b.emitter;
    return a.morton != b.morton ? a.morton < b.morton : a.point < b.point;
  });

  const auto rounded = [&](std::size_t points) { return (2 * points * count + n) / (2 * n); };
  for (std::size_t begin = 0, end = 0; begin < n; begin = end) {
    while (end < n && places[end].emitter == places[begin].emitter && places[end].morton == places[begin].morton) {
      round.points[places[end].point].quotaCell = static_cast<std::uint32_t>(round.cells.size());
      ++end;
    }
    QuotaCell& cell = round.cells.emplace_back();
    cell.left = static_cast<std::uint32_t>(end - begin);
    cell.quota = static_cast<std::uint32_t>(rounded(end) - rounded(begin));
    cell.update();
  }
}

// Find every point's neighbours, cell by cell of a grid of that size, and their crowding.
void findNeighbours(Round& round, const PointGrid& grid, Context& context) {
  struct Part {
    std::vector<std::uint32_t> count, neighbour;
  };
  const std::size_t chunks = (grid.cellCount() + kCellsPerChunk - 1) / kCellsPerChunk;
  std::vector<Part> parts(chunks);
  parallelChunks(context, "", grid.cellCount(), kCellsPerChunk, [&](std::size_t begin, std::size_t end) {
    Part& part = parts[begin / kCellsPerChunk];
    std::vector<std::pair<std::uint32_t, std::uint32_t>> runs;
    for (std::size_t cell = begin; cell < end; ++cell) {
      runs.clear();
      grid.forEachRun(round.node[grid.cellBegin(cell)].positionWorld, 1,
                      [&](std::uint32_t b, std::uint32_t e) { runs.emplace_back(b, e); });
      for (std::uint32_t i = grid.cellBegin(cell); i < grid.cellBegin(cell + 1); ++i) {
        const SurfaceNode& a = round.node[i];
        const float reach = round.points[i].reach;
        const std::size_t before = part.neighbour.size();
        float weight = 0.0f;
        for (const auto& [runBegin, runEnd] : runs) {
          for (std::uint32_t j = runBegin; j < runEnd; ++j) {
            const glm::vec3 apart = round.node[j].positionWorld - a.positionWorld;
            const float d2 = glm::dot(apart, apart);
            if (d2 >= reach * reach || j == i || !areNeighbours(a, round.node[j], apart, d2)) continue;
            part.neighbour.push_back(j);
            weight += crowding(d2, reach, round.limit);
          }
        }
        part.count.push_back(static_cast<std::uint32_t>(part.neighbour.size() - before));
        round.points[i].weight = weight;
      }
    }
  });

  round.neighbourBegin.assign(1, 0);
  round.neighbourBegin.reserve(round.node.size() + 1);
  std::size_t total = 0;
  for (const Part& part : parts) {
    for (const std::uint32_t c : part.count) round.neighbourBegin.push_back(total += c);
  }
  round.neighbour.resize(total);
  parallelChunks(context, "", chunks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      const std::size_t firstPoint = grid.cellBegin(c * kCellsPerChunk);
      std::copy(parts[c].neighbour.begin(), parts[c].neighbour.end(),
                round.neighbour.begin() + static_cast<std::ptrdiff_t>(round.neighbourBegin[firstPoint]));
      parts[c] = {};
    }
  });
}

// Points by their excess, in buckets of equal width, the most crowded first. A point's bucket may be out of date:
// excesses only fall, so it is an upper bound, renewed when the point comes up.
class CrowdedQueue {
 public:
  explicit CrowdedQueue(Round& round) : round_(round), head_(kBuckets, kEnd) {
    float high = -std::numeric_limits<float>::infinity();
    for (const Point& point : round.points) high = std::max(high, round.excess(point));
    perUnit_ = kBuckets / std::max(high, 1e-6f);
    for (std::uint32_t i = 0; i < round.points.size(); ++i) push(i);
    current_ = kBuckets - 1;
  }
  // Take out the most crowded point. [not empty]
  std::uint32_t pop() {
    for (;;) {
      while (head_[current_] == kEnd) --current_;
      const std::uint32_t i = head_[current_];
      head_[current_] = round_.points[i].next;
      if (bucketOf(i) >= current_) return i;
      push(i);
    }
  }

 private:
  static constexpr std::size_t kBuckets = 1u << 16;
  static constexpr std::uint32_t kEnd = 0xFFFFFFFFu;
  std::size_t bucketOf(std::uint32_t i) const {
    const float at = round_.excess(round_.points[i]) * perUnit_;
    return at > 0.0f ? std::min(static_cast<std::size_t>(at), kBuckets - 1) : 0;
  }
  void push(std::uint32_t i) {
    const std::size_t bucket = bucketOf(i);
    round_.points[i].next = head_[bucket];
    head_[bucket] = i;
  }

  Round& round_;
  std::vector<std::uint32_t> head_;
  std::size_t current_ = 0;
  float perUnit_ = 1.0f;
};

// Remove points until `count` are left. `removed` gets them in their order, as indices among the candidates; the rest
// is returned, ascending.
std::vector<std::uint32_t> runRound(Round& round, std::uint32_t count, std::vector<std::uint32_t>& removed,
                                    Context& context) {
  constexpr std::size_t kCheckEvery = 1u << 16;
  CrowdedQueue queue(round);
  for (std::size_t left = round.points.size(); left > count; --left) {
    const std::uint32_t i = queue.pop();
    Point& a = round.points[i];
    a.gone = true;
    round.cells[a.quotaCell].remove();
    removed.push_back(round.source[i]);
    for (std::size_t k = round.neighbourBegin[i]; k < round.neighbourBegin[i + 1]; ++k) {
      Point& b = round.points[round.neighbour[k]];
      if (b.gone) continue;
      const glm::vec3 apart = b.positionWorld - a.positionWorld;
      b.weight -= crowding(glm::dot(apart, apart), b.reach, round.limit);
    }
    if (left % kCheckEvery == 0 && !context.progress("surfels", 0.1 + 0.4 * count / static_cast<double>(left)))
      return {};
  }
  std::vector<std::uint32_t> kept;
  kept.reserve(count);
  for (std::size_t i = 0; i < round.points.size(); ++i) {
    if (!round.points[i].gone) kept.push_back(round.source[i]);
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

// Reduce `points` (indices among the candidates) to `count`.
std::vector<std::uint32_t> reduce(std::span<const SurfaceSample> candidates, std::span<const std::uint32_t> points,
                                  std::uint32_t count, float spacing, std::vector<std::uint32_t>& removed,
                                  Context& context) {
  Round round;
  std::vector<glm::vec3> position(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) position[i] = candidates[points[i]].positionWorld;
  const PointGrid grid(position, spacing, context);
  round.source.resize(points.size());
  round.node.resize(points.size());
  round.points.resize(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    round.source[i] = points[grid.order()[i]];
    const SurfaceSample& sample = candidates[round.source[i]];
    round.node[i] = {sample.positionWorld, sample.normal, sample.emitter};
    round.points[i].positionWorld = sample.positionWorld;
    round.points[i].reach = spacing / std::sqrt(sample.density);
  }
  const float share = static_cast<float>(count) / static_cast<float>(points.size());
  round.limit = kWeightLimitBase * (1.0f - std::pow(share, kWeightLimitExponent));
  setQuotas(round, count, kQuotaCellSpacings * spacing);
  findNeighbours(round, grid, context);
  if (context.cancelled()) return {};
  return runRound(round, count, removed, context);
}

}  // namespace

Result<std::vector<std::uint32_t>> eliminateSamples(std::span<const SurfaceSample> candidates, std::uint32_t count,
                                                    float spacing, Context& context) {
  std::vector<std::uint32_t> points(candidates.size());
  std::iota(points.begin(), points.end(), 0u);
  std::vector<std::uint32_t> removed;
  removed.reserve(candidates.size());
  if (points.size() > count) points = reduce(candidates, points, count, spacing, removed, context);

  // Go on removing, half by half, for the order.
  removed.clear();
  for (std::uint32_t left = count; left > 1 && !context.cancelled();) {
    const std::uint32_t half = left / 2;
    const float wider = spacing * std::sqrt(static_cast<float>(count) / static_cast<float>(half));
    points = reduce(candidates, points, half, wider, removed, context);
    left = half;
    context.progress("surfels", 0.7 - 0.2 * left / count);
  }
  if (context.cancelled()) return cancelledError();
  points.insert(points.end(), removed.rbegin(), removed.rend());
  return points;
}

}  // namespace relume
