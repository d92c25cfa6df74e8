// SPDX-License-Identifier: MIT
// See place_grid.h. A point that sees too many back faces is inside geometry: it moves a little, or is dropped. A point
// that sees nothing of what the play space sees is dropped, too: no receiver comes there. Where surfaces are so small
// and so far apart that no point sees enough of them, receivers are asked instead.
#include "bake/caches/grid/place_grid.h"

#include "bake/base/parallel.h"
#include "bake/caches/charts/patches.h"
#include "bake/caches/grid/refine_grid.h"
#include "bake/caches/grid/relocate.h"
#include "bake/caches/grid/see_depths.h"
#include "bake/caches/receiver_sight.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace relume {
namespace {

// Smallest share of a point's rays that must end on surfaces that the play space sees.
constexpr float kMinSeenShare = 0.05f;
// How far a point may move along each axis, in spacings of its level.
constexpr float kMaxMove = 0.4f;
// The layout is tried again, with another count, when the number of valid points is off by more than this share. Trials
// estimate that number from every n-th point, but from at least kEnoughPoints.
constexpr double kCloseEnough = 0.05;
constexpr std::size_t kEnoughPoints = 1024;
// Positions nearer to a bad one than this share of the free distance around it are taken to be as bad.
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

enum class Verdict : std::uint8_t { dropped, kept, moved };

struct Probed {
  std::vector<glm::vec3> position;  // [m] [Size points]
  std::vector<Verdict> verdict;
};

// Find a valid position for every n-th point (n = every), and drop those that have none. With `receivers`, a position
// counts as in the play space when one of them sees it.
Probed probePoints(const Prober& prober, const GridLayout& layout, const std::vector<GridPoint>& points,
                   std::size_t every, float maxBackFaceShare, Context& context,
                   const ReceiverSight* receivers = nullptr) {
  Probed probed;
  probed.position.resize(points.size());
  probed.verdict.assign(points.size(), Verdict::dropped);
  const std::vector<glm::vec3> offsets = moves();
  const std::size_t asked = (points.size() + every - 1) / every;
  parallelChunks(context, "grid", asked, 16, [&](std::size_t begin, std::size_t end) {
    std::vector<glm::vec4> bad;  // bad positions of the point, each with the radius within which others are as bad
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
        const bool inPlaySpace =
            receivers != nullptr ? !inside && receivers->sees({p, glm::vec3(0.0f)}) : around.seen >= kMinSeenShare;
        // Outside the play space, no nearby position is any better.
        if (k == 0 && !inside && !inPlaySpace) break;
        if (inside || !inPlaySpace) {
          bad.emplace_back(p, kSameShare * around.free);
          continue;
        }
        probed.position[i] = p;
        probed.verdict[i] = k == 0 ? Verdict::kept : Verdict::moved;
        break;
      }
    }
  });
  return probed;
}

}  // namespace

Result<PlacedGrid> placeGrid(const RayTracer& tracer, const PlaySpace& playSpace, const CacheOptions& options,
                             Context& context) {
  PlacedGrid result;
  const Prober prober(tracer, playSpace);

  // 1. Lattice and bricks, laid again if many points have no valid position
  const bool byCount = options.gridResolution == glm::uvec3(0) && !(options.gridSpacing > 0.0f);
  // Surfaces too large for the light map read the grid, which gets the caches that they would have had.
  const double wanted =
      options.gridCaches +
      (options.gridCaches > 0 && byCount ? options.lightmapCaches * wideShare(tracer.scene(), playSpace) : 0.0);
  double count = wanted, minOff = INFINITY;
  GridLayout layout;
  std::vector<GridPoint> points;
  Probed probed;
  std::size_t every = 1;  // every n-th point has been probed
  for (int pass = 0; pass < 3 && !context.cancelled(); ++pass) {
    Result<GridLayout> laidOut = layoutGrid(tracer, playSpace, options, count, context);
    if (!laidOut) return laidOut.error();
    GridLayout trial = std::move(*laidOut);
    std::vector<GridPoint> trialPoints = pointsOf(trial);
    const std::size_t trialEvery = byCount ? std::max<std::size_t>(1, trialPoints.size() / kEnoughPoints) : 1;
    Probed trialProbed = probePoints(prober, trial, trialPoints, trialEvery, options.maxBackFaceShare, context);
    const auto dropped = std::count(trialProbed.verdict.begin(), trialProbed.verdict.end(), Verdict::dropped);
    const double valid =
        static_cast<double>(trialPoints.size() - static_cast<std::size_t>(dropped)) * static_cast<double>(trialEvery);
    const double off = byCount && valid > 0.0 ? std::abs(std::log(valid / wanted)) : 0.0;
    if (off < minOff) {
      minOff = off;
      layout = std::move(trial);
      points = std::move(trialPoints);
      probed = std::move(trialProbed);
      every = trialEvery;
    }
    if (off < kCloseEnough) break;
    count *= std::clamp(wanted / valid, 0.25, 4.0);
  }
  if (context.cancelled()) return cancelledError();
  if (points.empty()) return PlacedGrid{};
  if (every > 1) probed = probePoints(prober, layout, points, 1, options.maxBackFaceShare, context);
  if (std::all_of(probed.verdict.begin(), probed.verdict.end(), [](Verdict v) { return v == Verdict::dropped; })) {
    const ReceiverSight receivers(playSpace, prober, context);
    probed = probePoints(prober, layout, points, 1, options.maxBackFaceShare, context, &receivers);
  }

  // 2. Numbers of the valid points
  std::vector<std::uint32_t> cache(points.size(), kNoCache);
  double moved = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (probed.verdict[i] == Verdict::dropped) continue;
    cache[i] = static_cast<std::uint32_t>(result.position.size());
    result.position.push_back(probed.position[i]);
    moved += probed.verdict[i] == Verdict::moved;
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

  // 3. How far the caches see
  grid.depth = seeDepths(tracer, result.position, grid.depthUnit(), context);
  context.figure("grid_points", static_cast<double>(points.size()));
  context.figure("grid_bricks", grid.brickCount());
  context.figure("grid_caches", static_cast<double>(result.position.size()));
  context.figure("grid_moved", moved);
  return result;
}

}  // namespace relume
