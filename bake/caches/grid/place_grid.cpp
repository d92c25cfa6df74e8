// SPDX-License-Identifier: MIT
// See place_grid.h. A point inside geometry, by the back faces it sees, moves within its cell or goes; a point that
// sees nothing of what the play space sees is where no receiver comes.
#include "bake/caches/grid/place_grid.h"

#include "bake/base/parallel.h"
#include "bake/caches/charts/patches.h"
#include "bake/caches/grid/refine_grid.h"
#include "bake/caches/grid/relocate.h"
#include "bake/caches/grid/see_depths.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relume {
namespace {

// Least share of rays that must end on surfaces the play space sees.
constexpr float kMinSeenShare = 0.05f;
// How far a point may move along each axis, in spacings of its level.
constexpr float kMaxMove = 0.4f;
// The count is corrected for points without a valid place when more than this share is missing. One point in a few, but
// so many, tell how many are.
constexpr double kCloseEnough = 0.05;
constexpr std::size_t kEnoughPoints = 1024;
// Places within this share of the distance from a bad place to what is nearest to it are as bad.
constexpr float kSameShare = 0.7f;

// Offsets to try, nearest first: the point itself, then a 5 x 5 x 5 lattice within the reach of a move.
std::vector<glm::vec3> moves() {
  std::vector<glm::vec3> result;
  for (int z = -2; z <= 2; ++z) {
    for (int y = -2; y <= 2; ++y) {
      for (int x = -2; x <= 2; ++x) result.push_back(glm::vec3(x, y, z) * (0.5f * kMaxMove));
    }
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const glm::vec3& a, const glm::vec3& b) { return glm::dot(a, a) < glm::dot(b, b); });
  return result;
}

enum class Verdict : std::uint8_t { dropped, inPlace, moved };

struct Places {
  std::vector<glm::vec3> position;  // [m] [Size points]
  std::vector<Verdict> verdict;
};

// Find a valid place for every so many-th point; drop the others.
Places findPlaces(const Prober& prober, const GridLayout& layout, const std::vector<GridPoint>& points,
                  std::size_t every, float maxBackFaceShare, Context& context) {
  Places places;
  places.position.resize(points.size());
  places.verdict.assign(points.size(), Verdict::dropped);
  const std::vector<glm::vec3> offsets = moves();
  const std::size_t asked = (points.size() + every - 1) / every;
  parallelChunks(context, "grid", asked, 16, [&](std::size_t begin, std::size_t end) {
    std::vector<glm::vec4> bad;  // places of a point and how far around it is the same
    for (std::size_t i = begin * every; i < end * every && i < points.size(); i += every) {
      const glm::vec3 reach = (points[i].refined ? 0.5f : 1.0f) * layout.spacing;
      const float contact = 0.02f * std::min({reach.x, reach.y, reach.z});
      const glm::vec3 point = layout.originWorld + glm::vec3(points[i].fine) * 0.5f * layout.spacing;
      bad.clear();
      for (std::size_t k = 0; k < offsets.size(); ++k) {
        const glm::vec3 p = point + offsets[k] * reach;
        if (std::any_of(bad.begin(), bad.end(),
                        [&](const glm::vec4& b) { return glm::distance(glm::vec3(b), p) < b.w; }))
          continue;
        const Surroundings around = prober.probe(p, glm::vec3(0.0f), contact);
        const bool inside = around.back > maxBackFaceShare || around.back + around.near > 0.9f;
        // Outside the play space, no nearby position is any better.
        if (k == 0 && !inside && around.seen < kMinSeenShare) break;
        if (inside || around.seen < kMinSeenShare) {
          bad.emplace_back(p, kSameShare * around.free);
          continue;
        }
        places.position[i] = p;
        places.verdict[i] = k == 0 ? Verdict::inPlace : Verdict::moved;
        break;
      }
    }
  });
  return places;
}

}  // namespace

Result<PlacedGrid> placeGrid(const RayTracer& tracer, const PlaySpace& playSpace, const CacheOptions& options,
                             Context& context) {
  PlacedGrid result;
  const Prober prober(tracer, playSpace);

  // 1. Lattice and bricks, once more where many points have no valid place
  const bool byCount = options.gridResolution == glm::uvec3(0) && !(options.gridSpacing > 0.0f);
  // What is too large for the light map reads the grid: the caches that it would have had go there.
  const double wanted =
      options.gridCaches +
      (options.gridCaches > 0 && byCount ? options.lightmapCaches * wideShare(tracer.scene(), playSpace) : 0.0);
  double count = wanted, minOff = INFINITY;
  GridLayout layout;
  std::vector<GridPoint> points;
  Places places;
  std::size_t every = 1;  // so many-th point has been asked
  for (int pass = 0; pass < 3 && !context.cancelled(); ++pass) {
    Result<GridLayout> laidOut = layoutGrid(tracer, playSpace, options, count, context);
    if (!laidOut) return laidOut.error();
    GridLayout trial = std::move(*laidOut);
    std::vector<GridPoint> trialPoints = pointsOf(trial);
    const std::size_t trialEvery = byCount ? std::max<std::size_t>(1, trialPoints.size() / kEnoughPoints) : 1;
    Places trialPlaces = findPlaces(prober, trial, trialPoints, trialEvery, options.maxBackFaceShare, context);
    const auto dropped = std::count(trialPlaces.verdict.begin(), trialPlaces.verdict.end(), Verdict::dropped);
    const double valid =
        static_cast<double>(trialPoints.size() - static_cast<std::size_t>(dropped)) * static_cast<double>(trialEvery);
    const double off = byCount && valid > 0.0 ? std::abs(std::log(valid / wanted)) : 0.0;
    if (off < minOff) {
      minOff = off;
      layout = std::move(trial);
      points = std::move(trialPoints);
      places = std::move(trialPlaces);
      every = trialEvery;
    }
    if (off < kCloseEnough) break;
    count *= std::clamp(wanted / valid, 0.25, 4.0);
  }
  if (context.cancelled()) return cancelledError();
  if (points.empty()) return PlacedGrid{};
  if (every > 1) places = findPlaces(prober, layout, points, 1, options.maxBackFaceShare, context);

  // 2. Indices of the valid ones
  std::vector<std::uint32_t> cache(points.size(), kNoCache);
  double moved = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (places.verdict[i] == Verdict::dropped) continue;
    cache[i] = static_cast<std::uint32_t>(result.position.size());
    result.position.push_back(places.position[i]);
    moved += places.verdict[i] == Verdict::moved;
  }
  CacheGrid& grid = result.grid;
  grid.resolution = layout.resolution;
  grid.originWorld = layout.originWorld;
  grid.spacing = layout.spacing;
  std::vector<std::uint32_t> fine = brickPoints(layout);
  for (std::uint32_t& word : fine) {
    if (word < kHangingPoint) word = cache[word];
  }
  cache.resize(std::size_t{layout.resolution.x} * layout.resolution.y * layout.resolution.z);
  grid.cache = std::move(cache);
  grid.fine = std::move(fine);
  grid.brick = std::move(layout.brick);

  // 3. How far they see
  grid.depth = seeDepths(tracer, result.position, grid.depthUnit(), context);
  context.figure("grid_points", static_cast<double>(points.size()));
  context.figure("grid_bricks", grid.brickCount());
  context.figure("grid_caches", static_cast<double>(result.position.size()));
  context.figure("grid_moved", moved);
  return result;
}

}  // namespace relume
