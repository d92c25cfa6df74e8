// SPDX-License-Identifier: MIT
// See map_sight.h. Squares are those between the centres of four texels, named after the lowest of these.
#include "bake/caches/map_sight.h"

#include "bake/base/memory_budget.h"
#include "bake/base/parallel.h"
#include "bake/caches/cache_in_sight.h"
#include "formats/map_sight.h"
#include "formats/pack.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string>
#include <utility>

namespace relume {
namespace {

constexpr std::size_t kSquaresPerChunk = 64;
constexpr int kFirstSide = 4, kSide = 16;  // points along a square: at first, and where one of those misses a texel
// What a point costs is the weight of hidden texels that it reads, and this for each texel's width that it is moved.
constexpr float kMoveCost = 0.4f;
// Of that for a point in the body of a wall: nobody looks there, so it must not hold visible points beside it in place.
constexpr float kUnseenMoves = 0.25f;
constexpr float kLeastKept = 0.1f;   // of a point's weights must be where it is moved to, or nothing is won
constexpr float kLeastGain = 0.03f;  // a point: what a move, or a line, must save
constexpr int kLines = 16;           // directions of lines that are tried
constexpr float kGapGain = 0.03f;    // a point: for the width [texel] of what is unseen about a line in its middle
// [texel] More than rounding moves the edges of triangles by; points are further than this from their square's sides.
constexpr float kRounding = 1.0f / 64.0f;
constexpr double kListedBytes = 8.0;        // a triangle, in a square's list
constexpr double kSquareBytes = 8.0 + 4.0;  // a square, while lists are filled and words are found

// Ways to move a point: x + 3 y with what formats/map_sight.h has for either.
constexpr std::size_t kMoves = 9;
using MoveCosts = std::array<float, kMoves>;

std::array<float, 4> bilinearWeights(const glm::vec2& f) {
  return {(1.0f - f.x) * (1.0f - f.y), f.x * (1.0f - f.y), (1.0f - f.x) * f.y, f.x * f.y};
}

std::uint32_t bitsOf(std::size_t move) { return static_cast<std::uint32_t>(move % 3 | move / 3 << 2); }

constexpr std::array<bool, 4> kAllHidden{true, true, true, true};

// What each move of a point costs; hidden: by texel, lower ones first, x before y.
MoveCosts costsOf(const glm::vec2& f, const std::array<bool, 4>& hidden) {
  const auto sumHidden = [&](const std::array<float, 4>& weight) {
    float sum = 0.0f;
    for (std::size_t k = 0; k < 4; ++k) sum += hidden[k] ? weight[k] : 0.0f;
    return sum;
  };
  const std::array<float, 4> weight = bilinearWeights(f);
  const float stays = sumHidden(weight);
  const bool seesNone = hidden == kAllHidden;
  const float moveCost = seesNone ? kUnseenMoves * kMoveCost : kMoveCost;
  MoveCosts costs;
  for (std::size_t move = 0; move < kMoves; ++move) {
    const glm::vec2 to = placeInSight(packMapSight(0, 0, 0, bitsOf(move), 0), f);
    const std::array<float, 4> moved = bilinearWeights(to);
    float kept = 0.0f;
    for (std::size_t k = 0; k < 4; ++k) kept += moved[k] > 0.0f ? weight[k] : 0.0f;
    const float reads = seesNone ? 0.0f : kept < kLeastKept ? stays : sumHidden(moved);
    costs[move] = reads + moveCost * glm::distance(f, to);
  }
  return costs;
}

struct SquarePoint {
  glm::vec2 place;  // in the square [0..1]
  MoveCosts costs;
  bool isUnseen = false;  // it is in a wall and sees none of the caches
};

void add(MoveCosts& sum, const MoveCosts& costs, float times) {
  for (std::size_t move = 0; move < kMoves; ++move) sum[move] += times * costs[move];
}
std::size_t cheapest(const MoveCosts& costs) {
  return static_cast<std::size_t>(std::min_element(costs.begin(), costs.end()) - costs.begin());
}

// The cheapest word for a square's points so far, and what it costs.
struct Fit {
  std::uint32_t word = 0;
  float cost = 0.0f;
};

// A line between points parts them. It lies within a wall, and not along its face: points are too few to tell a face.
void fitLine(std::span<const SquarePoint> points, const MoveCosts& all, Fit& fit) {
  const float gapGain = kGapGain * static_cast<float>(points.size()) / 127.0f;
  std::vector<std::pair<float, std::size_t>> order(points.size());  // along the line's normal
  std::vector<float> nextSeen(points.size());                       // where the first that is seen from there on is
  for (int line = 0; line < kLines; ++line) {
    const float angle = std::numbers::pi_v<float> * static_cast<float>(line) / static_cast<float>(kLines);
    const glm::vec2 normal = glm::round(127.0f * glm::vec2(std::cos(angle), std::sin(angle)));
    for (std::size_t i = 0; i < points.size(); ++i) order[i] = {glm::dot(normal, points[i].place - 0.5f), i};
    std::sort(order.begin(), order.end());
    for (std::size_t i = order.size(); i-- > 0;) {
      const bool isOver = i + 1 == order.size() || !points[order[i].second].isUnseen;
      nextSeen[i] = isOver ? order[i].first : nextSeen[i + 1];
    }
    MoveCosts near{}, beyond = all;
    float lastSeen = 0.0f;
    for (std::size_t i = 0; i + 1 < order.size(); ++i) {
      add(near, points[order[i].second].costs, 1.0f);
      add(beyond, points[order[i].second].costs, -1.0f);
      if (i == 0 || !points[order[i].second].isUnseen) lastSeen = order[i].first;
      const float low = order[i].first, high = order[i + 1].first, offset = std::nearbyint(0.5f * (low + high));
      if (!(offset >= low && offset < high)) continue;
      const std::size_t a = cheapest(near), b = cheapest(beyond);
      const float gap = 2.0f * std::min(offset - lastSeen, nextSeen[i + 1] - offset);
      const float cost = near[a] + beyond[b] - gapGain * gap;
      if (!(cost < fit.cost)) continue;
      fit = {packMapSight(static_cast<int>(normal.x), static_cast<int>(normal.y), static_cast<int>(offset), bitsOf(a),
                          bitsOf(b)),
             cost};
    }
  }
}

// The corner of a room, whose walls run along the texels, parts them.
void fitQuarter(std::span<const SquarePoint> points, const MoveCosts& all, Fit& fit) {
  // What is below each corner between points, along both.
  constexpr auto kStride = static_cast<std::size_t>(kSide + 1);
  std::vector<MoveCosts> below(kStride * kStride, MoveCosts{});
  for (const SquarePoint& point : points) {
    const glm::uvec2 at(static_cast<float>(kSide) * point.place);
    below[kStride * (at.y + 1) + at.x + 1] = point.costs;
  }
  for (std::size_t y = 1; y < kStride; ++y) {
    for (std::size_t x = 1; x < kStride; ++x) {
      MoveCosts& sum = below[kStride * y + x];
      add(sum, below[kStride * (y - 1) + x], 1.0f);
      add(sum, below[kStride * y + x - 1], 1.0f);
      add(sum, below[kStride * (y - 1) + x - 1], -1.0f);
    }
  }
  for (std::size_t y = 1; y + 1 < kStride; ++y) {
    for (std::size_t x = 1; x + 1 < kStride; ++x) {
      const MoveCosts &both = below[kStride * y + x], &ofX = below[kStride * (kStride - 1) + x],
                      &ofY = below[kStride * y + kStride - 1];
      // Quarters by where they are below: neither, x, y, both.
      std::array<MoveCosts, 4> quarter{all, ofX, ofY, both};
      add(quarter[0], ofX, -1.0f);
      add(quarter[0], ofY, -1.0f);
      add(quarter[0], both, 1.0f);
      add(quarter[1], both, -1.0f);
      add(quarter[2], both, -1.0f);
      const glm::ivec2 corner(glm::round(127.0f * (glm::vec2(x, y) / static_cast<float>(kSide) - 0.5f)));
      for (int q = 0; q < 4; ++q) {
        const MoveCosts& beyond = quarter[static_cast<std::size_t>(q)];
        MoveCosts near = all;
        add(near, beyond, -1.0f);
        const std::size_t a = cheapest(near), b = cheapest(beyond);
        if (!(near[a] + beyond[b] < fit.cost)) continue;
        fit = {packMapSight(2 * corner.x + (q & 1), 2 * corner.y + (q >> 1), kSightQuarter, bitsOf(a), bitsOf(b)),
               near[a] + beyond[b]};
      }
    }
  }
}

// The word for a square's points: what is less simple must cost less.
std::uint32_t fitSight(std::span<const SquarePoint> points) {
  MoveCosts all{};
  for (const SquarePoint& point : points) add(all, point.costs, 1.0f);
  const float gain = kLeastGain * static_cast<float>(points.size());
  Fit fit{0, all[0] - gain};
  if (const std::size_t move = cheapest(all); all[move] < fit.cost)
    fit = {packMapSight(0, 0, 0, bitsOf(move), bitsOf(move)), all[move] - gain};
  Fit line = fit;
  fitLine(points, all, line);
  if (line.word != fit.word) fit = {line.word, line.cost - gain};
  fitQuarter(points, all, fit);
  return fit.word;
}

// A side of a triangle that is on the light map, by where its corners are there.
struct MapTriangle {
  std::array<glm::vec2, 3> corner;  // [texel] texels' centres have whole numbers
  SurfacePoint point;               // barycentrics to be filled in
  bool isBack = false;
};

class MapTriangles {
 public:
  MapTriangles(const Scene& scene, const PlacedCaches& caches)
      : scene_(scene), caches_(caches), size_(caches.lightmap.width, caches.lightmap.height) {}

  std::uint64_t sides() const { return caches_.corners.front.size() + caches_.corners.back.size(); }
  // Triangle by its number among front sides, then back sides; false where it is not on the map, or reads one point.
  bool at(std::uint64_t side, MapTriangle& out) const {
    const MapCorners& corners = caches_.corners;
    out.isBack = side >= corners.front.size();
    const auto t = static_cast<std::uint32_t>(out.isBack ? side - corners.front.size() : side);
    const TriangleCorners& uv = (out.isBack ? corners.back : corners.front)[t];
    if (uv[0] == kGridLit || uv[1] == kGridLit || uv[2] == kGridLit || (uv[0] == uv[1] && uv[0] == uv[2])) return false;
    out.point.instance = scene_.instanceOf(t);
    const Instance& instance = scene_.instances[out.point.instance];
    out.point.triangle = t - instance.firstTriangle;
    // Barycentrics weigh world corners, which a mirroring instance swaps.
    const std::array<std::uint32_t, 3> order{uv[0], uv[instance.flipped ? 2 : 1], uv[instance.flipped ? 1 : 2]};
    for (std::size_t c = 0; c < 3; ++c)
      out.corner[c] = glm::clamp(unpackUnorm16x2(order[c]) * size_ - 0.5f, glm::vec2(0.0f), size_ - 1.0f);
    return true;
  }

 private:
  const Scene& scene_;
  const PlacedCaches& caches_;
  glm::vec2 size_;
};

// The least and the largest x of a triangle from y to y + 1, which it reaches.
glm::vec2 rangeInRow(const std::array<glm::vec2, 3>& corner, float y) {
  constexpr float kMax = std::numeric_limits<float>::max();
  glm::vec2 range(kMax, -kMax);
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::vec2 &a = corner[k], &b = corner[(k + 1) % 3];
    if (std::max(a.y, b.y) < y || std::min(a.y, b.y) > y + 1.0f) continue;
    // Of the edge's part in the row, the end towards `from`.
    const auto endAt = [y](const glm::vec2& from, const glm::vec2& to) {
      const float in = glm::clamp(from.y, y, y + 1.0f);
      return in == from.y ? from.x : from.x + (in - from.y) / (to.y - from.y) * (to.x - from.x);
    };
    for (const float x : {endAt(a, b), endAt(b, a)}) range = {std::min(range.x, x), std::max(range.y, x)};
  }
  return range;
}

// The triangles over each square: of square s those from begin[s] to begin[s + 1], by MapTriangles' numbers.
struct TrianglesBySquare {
  std::vector<std::uint64_t> begin;
  std::vector<std::uint64_t> side;
};

Result<TrianglesBySquare> sortBySquare(const MapTriangles& triangles, const Lightmap& map, Context& context) {
  TrianglesBySquare sorted;
  sorted.begin.assign(std::size_t{map.width} * map.height + 1, 0);
  const auto visit = [&](const auto& each) {
    for (std::uint64_t side = 0; side < triangles.sides() && !context.cancelled(); ++side) {
      MapTriangle triangle;
      if (!triangles.at(side, triangle)) continue;
      const auto& [a, b, c] = triangle.corner;
      const glm::uvec2 low(glm::min(a, glm::min(b, c))), high(glm::max(a, glm::max(b, c)));
      for (std::uint32_t y = low.y; y <= high.y; ++y) {
        // Not all of the bounding box: that of a long sliver has far more squares than it crosses.
        const glm::vec2 range = rangeInRow(triangle.corner, static_cast<float>(y));
        const auto first = std::max(low.x, static_cast<std::uint32_t>(std::max(0.0f, range.x - kRounding)));
        const auto last = std::min(high.x, static_cast<std::uint32_t>(range.y + kRounding));
        for (std::uint32_t x = first; x <= last; ++x) each(std::size_t{y} * map.width + x, side);
      }
    }
  };
  visit([&](std::size_t square, std::uint64_t) { ++sorted.begin[square + 1]; });
  for (std::size_t s = 1; s < sorted.begin.size(); ++s) sorted.begin[s] += sorted.begin[s - 1];
  const auto listed = static_cast<double>(sorted.begin.back()), squares = static_cast<double>(map.cache.size());
  if (const Status reserved =
          reserveMemory(context, "light map", kListedBytes * listed + kSquareBytes * squares,
                        std::to_string(sorted.begin.back()) + " places of triangles between its texels",
                        "lower --lightmap-caches or --lightmap");
      !reserved)
    return reserved.error();
  sorted.side.resize(sorted.begin.back());
  std::vector<std::uint64_t> next(sorted.begin.begin(), sorted.begin.end() - 1);
  visit([&](std::size_t square, std::uint64_t side) { sorted.side[next[square]++] = side; });
  return sorted;
}

class SquareSight {
 public:
  SquareSight(const RayTracer& tracer, const PlacedCaches& caches)
      : tracer_(tracer), caches_(caches), triangles_(tracer.scene(), caches) {}
  const MapTriangles& triangles() const { return triangles_; }

  // The word of a square with these triangles.
  std::uint32_t of(std::uint32_t square, std::span<const std::uint64_t> sides) const {
    const Lightmap& map = caches_.lightmap;
    const std::uint32_t x = square % map.width, y = square / map.width;
    const std::uint32_t right = std::min(x + 1, map.width - 1), up = std::min(y + 1, map.height - 1);
    const auto cacheAt = [&](std::uint32_t column, std::uint32_t row) {
      return map.cache[std::size_t{row} * map.width + column];
    };
    Square at{glm::vec2(x, y), {cacheAt(x, y), cacheAt(right, y), cacheAt(x, up), cacheAt(right, up)}, sides};
    const std::uint32_t first = at.cache[0];
    if (std::all_of(at.cache.begin(), at.cache.end(), [&](std::uint32_t cache) { return cache == first; })) return 0;
    bool isAnyHidden = false;
    std::vector<SquarePoint> points = pointsOf(at, kFirstSide, isAnyHidden);
    if (!isAnyHidden) return 0;
    points = pointsOf(at, kSide, isAnyHidden);
    return fitSight(points);
  }

 private:
  struct Square {
    glm::vec2 low;  // [texel]
    std::array<std::uint32_t, 4> cache;
    std::span<const std::uint64_t> sides;
  };

  // The points of side * side that lie on a triangle; of several the first.
  std::vector<SquarePoint> pointsOf(const Square& square, int side, bool& isAnyHidden) const {
    std::vector<SquarePoint> points;
    std::vector<bool> isTaken(static_cast<std::size_t>(side * side), false);
    for (const std::uint64_t number : square.sides) {
      MapTriangle triangle;
      if (!triangles_.at(number, triangle)) continue;
      const glm::vec2 a = triangle.corner[0] - square.low, ab = triangle.corner[1] - triangle.corner[0],
                      ac = triangle.corner[2] - triangle.corner[0];
      const float area = ab.x * ac.y - ab.y * ac.x;
      if (!(std::abs(area) > 0.0f)) continue;
      for (int i = 0; i < side * side; ++i) {
        if (isTaken[static_cast<std::size_t>(i)]) continue;
        const glm::vec2 f = (glm::vec2(i % side, i / side) + 0.5f) / static_cast<float>(side), way = f - a;
        const glm::vec2 w((way.x * ac.y - way.y * ac.x) / area, (ab.x * way.y - ab.y * way.x) / area);
        if (!(w.x >= 0.0f && w.y >= 0.0f && w.x + w.y <= 1.0f)) continue;
        triangle.point.barycentric = w;
        const std::array<bool, 4> hidden = hiddenFrom(square, triangle);
        isAnyHidden |= hidden != std::array<bool, 4>{};
        points.push_back({f, costsOf(f, hidden), hidden == kAllHidden});
        isTaken[static_cast<std::size_t>(i)] = true;
      }
    }
    return points;
  }

  std::array<bool, 4> hiddenFrom(const Square& square, const MapTriangle& triangle) const {
    const Scene& scene = tracer_.scene();
    const SurfacePoint& point = triangle.point;
    const std::array<glm::vec3, 3> corner = scene.corners(scene.instances[point.instance], point.triangle);
    const glm::vec3 position =
        corner[0] + point.barycentric.x * (corner[1] - corner[0]) + point.barycentric.y * (corner[2] - corner[0]);
    const glm::vec3 front = geometricNormal(scene, point), normal = triangle.isBack ? -front : front;
    std::array<bool, 4> hidden{};
    for (std::size_t k = 0; k < 4; ++k)
      hidden[k] = square.cache[k] == kNoCache || !seesCache(tracer_, caches_, square.cache[k], position, normal);
    return hidden;
  }

  const RayTracer& tracer_;
  const PlacedCaches& caches_;
  MapTriangles triangles_;
};

}  // namespace

Result<std::vector<std::uint32_t>> findMapSight(const RayTracer& tracer, const PlacedCaches& caches, Context& context) {
  std::vector<std::uint32_t> words;
  if (caches.corners.front.empty()) return words;
  const SquareSight sight(tracer, caches);
  const Result<TrianglesBySquare> lists = sortBySquare(sight.triangles(), caches.lightmap, context);
  if (!lists) return lists.error();
  const TrianglesBySquare& sorted = *lists;
  words.assign(caches.lightmap.cache.size(), 0);
  parallelChunks(context, "", words.size(), kSquaresPerChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t square = begin; square < end; ++square) {
      const std::uint64_t first = sorted.begin[square], count = sorted.begin[square + 1] - first;
      if (count > 0)
        words[square] = sight.of(static_cast<std::uint32_t>(square), std::span(sorted.side).subspan(first, count));
    }
  });
  if (std::all_of(words.begin(), words.end(), [](std::uint32_t word) { return word == 0; })) words.clear();
  return words;
}

}  // namespace relume
