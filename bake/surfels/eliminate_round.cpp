// SPDX-License-Identifier: MIT
// See eliminate_round.h.
#include "bake/surfels/eliminate_round.h"

#include "bake/base/ladder.h"
#include "bake/base/morton.h"
#include "bake/base/parallel.h"
#include "bake/base/parallel_sort.h"
#include "bake/base/point_grid.h"
#include "bake/base/random.h"

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>

namespace relume {
namespace {

constexpr float kWeightLimitBase = 0.65f;     // beta of the paper
constexpr float kWeightLimitExponent = 1.5f;  // gamma of the paper
constexpr float kQuotaSpacings = 8.0f;        // width of a quota's cube in spacings
constexpr float kQuotaWeight = 1e-3f;         // penalty of a quota that has twice its points; a pair at 0.6 D has 7e-4
constexpr double kShares = 8.0;               // in an octave, of the ladder
constexpr std::size_t kBucketsPerChunk = 512;
constexpr std::size_t kEliminationGrain = 1u << 14;
constexpr std::size_t kRegionsPerChunk = 1;
constexpr std::size_t kFewForThreads = 1u << 14;  // points: a step takes less time than threads do to begin
constexpr std::size_t kMaxOfAStep = 10;           // one of so many points may be removed in a step
constexpr std::size_t kFewPoints = 4096;          // not worth steps
constexpr std::size_t kLastShare = 64;            // once only one of so many has to go, points are removed one by one

// (1 - d / D)^8, d limited from below.
float crowding(float distanceSquared, float reach, float limit) {
  const float t = 1.0f - std::max(std::sqrt(distanceSquared) / reach, limit);
  const float t2 = t * t, t4 = t2 * t2;
  return t4 * t4;
}

// The points of a neighbourhood, one array per coordinate, so that distances to all of them are computed in vectors.
class Around {
 public:
  void clear() { point_.clear(); }
  void add(std::span<const SurfaceNode> node, std::uint32_t begin, std::uint32_t end) {
    const std::size_t first = point_.size(), count = first + (end - begin);
    point_.resize(count);
    for (std::vector<float>* each : {&x_, &y_, &z_, &distance_}) each->resize(std::max(each->size(), count));
    nearer_.resize(std::max(nearer_.size(), count));
    for (std::size_t k = first; k < count; ++k) {
      point_[k] = begin + static_cast<std::uint32_t>(k - first);
      const glm::vec3& at = node[point_[k]].positionWorld;
      x_[k] = at.x;
      y_[k] = at.y;
      z_[k] = at.z;
    }
  }
  // Call visit(point, squared distance) for those nearer to p, in the order they were added.
  template <class Visit>
  void forEachNearer(const glm::vec3& p, float limitSquared, const Visit& visit) {
    const std::size_t count = point_.size();
    for (std::size_t k = 0; k < count; ++k) {
      const float dx = x_[k] - p.x, dy = y_[k] - p.y, dz = z_[k] - p.z;
      distance_[k] = dx * dx + dy * dy + dz * dz;
    }
    std::size_t nearer = 0;
    for (std::size_t k = 0; k < count; ++k) {
      nearer_[nearer] = static_cast<std::uint32_t>(k);
      nearer += distance_[k] < limitSquared ? 1 : 0;
    }
    for (std::size_t n = 0; n < nearer; ++n) visit(point_[nearer_[n]], distance_[nearer_[n]]);
  }

 private:
  std::vector<std::uint32_t> point_, nearer_;
  std::vector<float> x_, y_, z_, distance_;
};

// Buckets of excesses, each 1/32 of the excess wide.
constexpr int kBucketShift = 18;
constexpr std::size_t kExcessBuckets = std::size_t{1} << (31 - kBucketShift);
std::size_t bucketOf(float excess) { return excess > 0.0f ? std::bit_cast<std::uint32_t>(excess) >> kBucketShift : 0; }

// Whether the mean point has so many points around its bucket that the lists of neighbours would grow with the square
// of the points. Where a thousand layers coincide, the spacing that their area asks for reaches all of them.
bool isCrowded(const PointGrid& grid, std::span<const glm::vec3> position) {
  constexpr double kMaxAround = 4096.0;
  constexpr std::size_t kAsked = 1024;
  const std::size_t step = std::max<std::size_t>(1, position.size() / kAsked);
  double around = 0.0, asked = 0.0;
  for (std::size_t p = 0; p < position.size(); p += step, asked += 1.0)
    grid.forEachRun(position[p], 1, [&](std::uint32_t begin, std::uint32_t end) { around += end - begin; });
  return around > kMaxAround * asked;
}

}  // namespace

// The penalty falls in steps, which are larger while there are far too many points: each step makes the keys of all the
// quota's points out of date.
void EliminationRound::Quota::update() {
  const float above = left > wanted ? static_cast<float>(left - wanted) : 0.0f;
  penalty = kQuotaWeight * above / (static_cast<float>(wanted) + 1.0f);
  const std::uint32_t step = std::max({1u, left > wanted ? (left - wanted) / 3 : 0u, wanted / 16});
  nextUpdate = left > step ? left - step : 0;
}

EliminationRound::EliminationRound(std::span<const SurfaceSample> candidates, std::span<const std::uint32_t> points,
                                   std::uint32_t count, float spacing, Context& context)
    : count_(count), left_(points.size()) {
  std::vector<glm::vec3> position(points.size());
  const auto forEachPoint = [&](const auto& visit) {
    parallelChunks(context, "", points.size(), kEliminationGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) visit(i);
    });
  };
  forEachPoint([&](std::size_t i) { position[i] = candidates[points[i]].positionWorld; });
  PointGrid grid(position, spacing, context);
  constexpr int kTries = 24;
  for (int i = 0; i < kTries && isCrowded(grid, position) && !context.cancelled(); ++i) {
    spacing *= 0.5f;
    grid = PointGrid(position, spacing, context);
  }
  if (context.cancelled()) return;
  std::vector<SurfaceNode> node;
  resizeByThreads(context, node, points.size());
  forEachPoint([&](std::size_t i) {
    const SurfaceSample& sample = candidates[points[grid.order()[i]]];
    node[i] = {sample.positionWorld, sample.normal, sample.emitter};
  });
  // Of the ladder: a few candidates more or fewer somewhere must not change how crowded all others are.
  share_ = onLadder(static_cast<double>(count) / static_cast<double>(points.size()), kShares);
  sortByQuota(node, kQuotaSpacings * spacing, context);
  if (context.cancelled()) return;

  source_.resize(points.size());
  forEachPoint([&](std::size_t i) {
    const std::uint32_t source = points[grid.order()[i]];
    source_[rank_[i]] = source;
    points_[rank_[i]].positionWorld = node[i].positionWorld;
    points_[rank_[i]].reach = spacing / std::sqrt(candidates[source].density);
  });
  const auto share = static_cast<float>(share_);
  limit_ = kWeightLimitBase * (1.0f - std::pow(share, kWeightLimitExponent));
  findNeighbours(node, grid, context);
}

// Sort the points by their quotas' cubes along a Morton curve, emitter by emitter. Every quota gets its share of
// `count`, rounded at random by where its cube is, so that what points there are elsewhere has no say.
void EliminationRound::sortByQuota(std::span<const SurfaceNode> node, float cubeSize, Context& context) {
  struct SortKey {
    std::uint32_t emitter, point;
    std::uint64_t morton;
  };
  const std::size_t n = node.size();
  glm::vec3 low = node[0].positionWorld;
  for (const SurfaceNode& each : node) {
    for (int k = 0; k < 3; ++k) low[k] = std::min(low[k], each.positionWorld[k]);
  }
  low = glm::floor(low / cubeSize) * cubeSize;
  std::vector<SortKey> sorted(n);
  parallelChunks(context, "", n, kEliminationGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      sorted[i] = {node[i].emitter, static_cast<std::uint32_t>(i), mortonOf((node[i].positionWorld - low) / cubeSize)};
    }
  });
  sortByThreads(context, sorted, [](const SortKey& a, const SortKey& b) {
    if (a.emitter != b.emitter) return a.emitter < b.emitter;
    return a.morton != b.morton ? a.morton < b.morton : a.point < b.point;
  });
  if (context.cancelled()) return;

  resizeByThreads(context, points_, n);
  rank_.resize(n);
  for (std::size_t begin = 0, end = 0; begin < n; begin = end) {
    const SortKey& first = sorted[begin];
    const bool opens =
        begin == 0 || first.emitter != sorted[begin - 1].emitter || first.morton >> 3 != sorted[begin - 1].morton >> 3;
    if (opens) {
      ofColour_[first.morton >> 3 & 7].push_back(static_cast<std::uint32_t>(regions_.size()));
      regions_.emplace_back();
    }
    while (end < n && sorted[end].emitter == first.emitter && sorted[end].morton == first.morton) {
      rank_[sorted[end].point] = static_cast<std::uint32_t>(end);
      points_[end].quota = static_cast<std::uint32_t>(quotas_.size());
      regions_.back().left.push_back(static_cast<std::uint32_t>(end));
      ++end;
    }
    Quota& quota = quotas_.emplace_back();
    quota.left = static_cast<std::uint32_t>(end - begin);
    const double round = static_cast<double>(mix64(first.morton ^ std::uint64_t{first.emitter} << 32) >> 11) * 0x1p-53;
    quota.wanted = static_cast<std::uint32_t>(share_ * quota.left + round);
    quota.update();
  }
}

// Find every point's neighbours, bucket by bucket of the grid, and their crowding.
void EliminationRound::findNeighbours(std::span<const SurfaceNode> node, const PointGrid& grid, Context& context) {
  struct Part {
    std::vector<std::uint32_t> neighbour;  // in the grid's order, point by point
  };
  const std::size_t chunks = (grid.bucketCount() + kBucketsPerChunk - 1) / kBucketsPerChunk;
  std::vector<Part> parts(chunks);
  std::vector<std::uint32_t> found(node.size());  // neighbours of each point in the grid's order
  parallelChunks(context, "", grid.bucketCount(), kBucketsPerChunk, [&](std::size_t begin, std::size_t end) {
    Part& part = parts[begin / kBucketsPerChunk];
    Around around;
    for (std::size_t bucket = begin; bucket < end; ++bucket) {
      around.clear();
      grid.forEachRun(node[grid.bucketBegin(bucket)].positionWorld, 1,
                      [&](std::uint32_t b, std::uint32_t e) { around.add(node, b, e); });
      for (std::uint32_t i = grid.bucketBegin(bucket); i < grid.bucketBegin(bucket + 1); ++i) {
        const SurfaceNode& a = node[i];
        Point& point = points_[rank_[i]];
        const std::size_t before = part.neighbour.size();
        around.forEachNearer(a.positionWorld, point.reach * point.reach, [&](std::uint32_t j, float d2) {
          const SurfaceNode& b = node[j];
          if (j == i || !areNeighbours(a, b, b.positionWorld - a.positionWorld, d2)) return;
          part.neighbour.push_back(rank_[j]);
          point.weight += crowding(d2, point.reach, limit_);
        });
        found[i] = static_cast<std::uint32_t>(part.neighbour.size() - before);
      }
    }
  });

  // Join the parts, in the order of the points.
  if (context.cancelled()) return;
  neighbourBegin_.assign(node.size() + 1, 0);
  for (std::size_t i = 0; i < node.size(); ++i) neighbourBegin_[rank_[i] + 1] = found[i];
  for (std::size_t i = 0; i < node.size(); ++i) neighbourBegin_[i + 1] += neighbourBegin_[i];
  neighbour_ = std::make_unique_for_overwrite<std::uint32_t[]>(neighbourBegin_.back());
  parallelChunks(context, "", chunks, 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      const std::size_t lastBucket = std::min((c + 1) * kBucketsPerChunk, grid.bucketCount());
      auto from = parts[c].neighbour.begin();
      for (std::uint32_t i = grid.bucketBegin(c * kBucketsPerChunk); i < grid.bucketBegin(lastBucket); ++i) {
        std::copy(from, from + found[i], &neighbour_[neighbourBegin_[rank_[i]]]);
        from += found[i];
      }
      parts[c] = {};
    }
  });
}

void EliminationRound::remove(std::uint32_t i) {
  Point& a = points_[i];
  a.gone = true;
  quotas_[a.quota].remove();
  for (std::size_t k = neighbourBegin_[i]; k < neighbourBegin_[i + 1]; ++k) {
    Point& b = points_[neighbour_[k]];
    if (b.gone) continue;
    const glm::vec3 apart = b.positionWorld - a.positionWorld;
    b.weight -= crowding(glm::dot(apart, apart), b.reach, limit_);
  }
}

// The lowest excess above which at most `most` points are. Excesses only fall, so no more than those will go.
float EliminationRound::chooseStep(std::size_t max, Context& context) const {
  constexpr std::size_t kPart = 16;  // [regions]
  std::vector<std::vector<std::uint32_t>> parts((regions_.size() + kPart - 1) / kPart);
  parallelChunks(context, "", regions_.size(), kPart, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t>& part = parts[begin / kPart];
    part.assign(kExcessBuckets, 0);
    for (std::size_t r = begin; r < end; ++r) {
      for (const std::uint32_t i : regions_[r].left) ++part[bucketOf(excess(points_[i]))];
    }
  });
  std::vector<std::uint32_t> all(kExcessBuckets, 0);
  for (const std::vector<std::uint32_t>& part : parts) {
    for (std::size_t i = 0; i < part.size(); ++i) all[i] += part[i];
  }
  std::size_t above = 0, bucket = kExcessBuckets;
  for (; bucket > 1; --bucket) {
    above += all[bucket - 1];
    if (above > max) break;
  }
  return std::bit_cast<float>(static_cast<std::uint32_t>(bucket << kBucketShift));
}

// Remove the points of a region at or above a step, the most crowded first.
void EliminationRound::reduceRegion(Region& region, float step) {
  const auto lower = [](const Removal& a, const Removal& b) {
    return a.excess != b.excess ? a.excess < b.excess : a.point > b.point;
  };
  std::vector<Removal> heap;
  for (const std::uint32_t i : region.left) {
    const float e = excess(points_[i]);
    if (e >= step) heap.push_back({e, i});
  }
  if (heap.empty()) return;
  std::make_heap(heap.begin(), heap.end(), lower);
  while (!heap.empty()) {
    std::pop_heap(heap.begin(), heap.end(), lower);
    const std::uint32_t i = heap.back().point;
    const float known = heap.back().excess, e = excess(points_[i]);
    heap.pop_back();
    if (e < step) continue;
    if (e < known && !heap.empty() && e < heap.front().excess) {
      heap.push_back({e, i});
      std::push_heap(heap.begin(), heap.end(), lower);
      continue;
    }
    remove(i);
    region.removed.push_back({e, i});
  }
  std::erase_if(region.left, [&](std::uint32_t i) { return points_[i].gone; });
}

// One step in all regions. False when nothing was removed.
bool EliminationRound::stepDown(float step, std::vector<std::uint32_t>& removed, Context& context) {
  for (const std::vector<std::uint32_t>& colour : ofColour_) {
    const std::size_t grain = left_ < kFewForThreads ? colour.size() : kRegionsPerChunk;
    parallelChunks(context, "", colour.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t r = begin; r < end; ++r) reduceRegion(regions_[colour[r]], step);
    });
  }
  std::vector<Removal> all;
  for (Region& region : regions_) {
    all.insert(all.end(), region.removed.begin(), region.removed.end());
    region.removed.clear();
  }
  // In the order of their crowding, so that any part of them is spread over all regions.
  sortByThreads(context, all, [](const Removal& a, const Removal& b) {
    return a.excess != b.excess ? a.excess > b.excess : a.point < b.point;
  });
  if (context.cancelled()) return false;
  for (const Removal& each : all) removed.push_back(source_[each.point]);
  left_ -= all.size();
  return !all.empty();
}

// Points by their excess, in buckets of equal width, the most crowded first. A point's bucket may be out of date:
// excesses only fall, so it is an upper bound, renewed when the point comes up.
class EliminationRound::Queue {
 public:
  explicit Queue(EliminationRound& round) : round_(round), head_(kBuckets, kEnd) {
    float high = -std::numeric_limits<float>::infinity();
    for (const Point& point : round.points_) {
      if (!point.gone) high = std::max(high, round.excess(point));
    }
    perUnit_ = kBuckets / std::max(high, 1e-6f);
    for (std::uint32_t i = 0; i < round.points_.size(); ++i) {
      if (!round.points_[i].gone) push(i);
    }
    current_ = kBuckets - 1;
  }
  // Take out the most crowded point. [not empty]
  std::uint32_t pop() {
    for (;;) {
      while (head_[current_] == kEnd) --current_;
      const std::uint32_t i = head_[current_];
      head_[current_] = round_.points_[i].next;
      if (slotOf(i) >= current_) return i;
      push(i);
    }
  }

 private:
  static constexpr std::size_t kBuckets = 1u << 16;
  static constexpr std::uint32_t kEnd = 0xFFFFFFFFu;
  std::size_t slotOf(std::uint32_t i) const {
    const float at = round_.excess(round_.points_[i]) * perUnit_;
    return at > 0.0f ? std::min(static_cast<std::size_t>(at), kBuckets - 1) : 0;
  }
  void push(std::uint32_t i) {
    const std::size_t slot = slotOf(i);
    round_.points_[i].next = head_[slot];
    head_[slot] = i;
  }

  EliminationRound& round_;
  std::vector<std::uint32_t> head_;
  std::size_t current_ = 0;
  float perUnit_ = 1.0f;
};

std::vector<std::uint32_t> EliminationRound::run(std::vector<std::uint32_t>& removed, Context& context) {
  if (context.cancelled()) return {};
  // Many at a time while there are many to go.
  const double all = static_cast<double>(left_);
  while (left_ > kFewPoints && left_ - count_ > left_ / kLastShare) {
    const std::size_t max = std::min(left_ - count_, left_ / kMaxOfAStep);
    const float step = chooseStep(max, context);
    if (!stepDown(step, removed, context)) break;
    if (!context.progress("surfels", 0.1 + 0.4 * (1.0 - static_cast<double>(left_) / all))) return {};
  }

  // The rest one by one.
  if (context.cancelled()) return {};
  Queue queue(*this);
  for (; left_ > count_; --left_) {
    if (left_ % 1024 == 0 && context.cancelled()) return {};
    const std::uint32_t i = queue.pop();
    remove(i);
    removed.push_back(source_[i]);
  }
  std::vector<std::uint32_t> kept;
  kept.reserve(count_);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    if (!points_[i].gone) kept.push_back(source_[i]);
  }
  std::sort(kept.begin(), kept.end());
  return context.cancelled() ? std::vector<std::uint32_t>{} : kept;
}

}  // namespace relume
