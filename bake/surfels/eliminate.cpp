// SPDX-License-Identifier: MIT
// Sample elimination for Poisson disk sample sets (Yuksel 2015). Of too many candidates, the most crowded one is
// removed again and again, where a neighbour at distance d adds (1 - d / D)^8 to a candidate's crowding. Removal goes
// on below the wanted count, where D grows each time the count has halved. Read backwards, the order of removal is
// progressive.
//
// Deviation: steps down the crowding and a queue of buckets in place of the paper's heap (eliminate_round.h).
// Deviation: elimination alone leaves more points on boundaries and on scattered small parts than their area's share,
// because points there are crowded less. Surfels must be of equal area, so every cube of space has a quota by its share
// of the candidates, and being above it adds to the crowding of its points. Being below it takes nothing from that: in
// a cube with a quota of a few points it would keep pairs that all but touch.
#include "bake/surfels/eliminate.h"

#include "bake/surfels/eliminate_round.h"

#include <cmath>
#include <numeric>

namespace relume {

Result<std::vector<std::uint32_t>> eliminateSamples(std::span<const SurfaceSample> candidates, std::uint32_t count,
                                                    float spacing, Context& context) {
  std::vector<std::uint32_t> points(candidates.size());
  std::iota(points.begin(), points.end(), 0u);
  std::vector<std::uint32_t> removed;
  removed.reserve(candidates.size());
  const auto reduce = [&](std::uint32_t left, float reach) {
    points = EliminationRound(candidates, points, left, reach, context).run(removed, context);
  };
  if (points.size() > count) reduce(count, spacing);

  // Go on removing, half of the points at a time, to find the order.
  removed.clear();
  for (std::uint32_t left = count; left > 1 && !context.cancelled();) {
    const std::uint32_t half = left / 2;
    reduce(half, spacing * std::sqrt(static_cast<float>(count) / static_cast<float>(half)));
    left = half;
    context.progress("surfels", 0.7 - 0.2 * left / count);
  }
  if (context.cancelled()) return cancelledError();
  points.insert(points.end(), removed.rbegin(), removed.rend());
  return points;
}

}  // namespace relume
