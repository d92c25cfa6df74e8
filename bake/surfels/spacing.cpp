// SPDX-License-Identifier: MIT
// See spacing.h.
#include "bake/surfels/spacing.h"

#include "bake/base/parallel.h"
#include "bake/base/point_grid.h"
#include "bake/surfels/neighbours.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume {

Spacing measureSpacing(std::span<const SurfaceSample> surfels, float spacing, Context& context) {
  std::vector<glm::vec3> position;
  position.reserve(surfels.size());
  for (const SurfaceSample& s : surfels) position.push_back(s.positionWorld);
  const PointGrid grid(position, spacing, context);
  std::vector<SurfaceNode> node;
  node.reserve(surfels.size());
  for (const std::uint32_t i : grid.order()) {
    node.push_back({surfels[i].positionWorld, surfels[i].normal, surfels[i].emitter});
  }

  // Look in the first ring of buckets around, and in the second one only if a nearer point may be there.
  std::vector<float> nearest(surfels.size(), std::numeric_limits<float>::infinity());
  parallelChunks(context, "", node.size(), 8192, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto visit = [&](std::uint32_t b, std::uint32_t e) {
        for (std::uint32_t j = b; j < e; ++j) {
          const glm::vec3 apart = node[j].positionWorld - node[i].positionWorld;
          const float d2 = glm::dot(apart, apart);
          if (d2 < nearest[i] && j != i && areNeighbours(node[i], node[j], apart, d2)) nearest[i] = d2;
        }
      };
      grid.forEachRun(node[i].positionWorld, 1, visit);
      if (nearest[i] > spacing * spacing) grid.forEachRunOfShell(node[i].positionWorld, 2, visit);
    }
  });

  Spacing result;
  double sum = 0.0, squares = 0.0;
  std::size_t count = 0;
  float min = std::numeric_limits<float>::infinity();
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    const float d = std::sqrt(nearest[i]);
    if (!(d <= 2.0f * spacing) || surfels[grid.order()[i]].density > 1.0f) continue;
    min = std::min(min, d);
    sum += d;
    squares += double{d} * d;
    ++count;
  }
  if (count == 0) return result;
  const double mean = sum / static_cast<double>(count);
  result.min = min;
  result.mean = static_cast<float>(mean);
  const double variance = std::max(0.0, squares / static_cast<double>(count) - mean * mean);
  result.cv = mean > 0.0 ? static_cast<float>(std::sqrt(variance) / mean) : 0.0f;
  return result;
}

}  // namespace relume
