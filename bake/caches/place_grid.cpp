// SPDX-License-Identifier: MIT
// See place_grid.h. A point inside geometry, by the back faces it sees, moves within its cell or goes; a point that
// sees nothing of what the play space sees is where no receiver comes.
#include "bake/caches/place_grid.h"

#include "bake/caches/relocate.h"
#include "bake/parallel.h"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace relume {
namespace {

constexpr std::uint32_t kMostAlong = 1024;
// Least share of rays that must end on surfaces the play space sees.
constexpr float kMinSeenShare = 0.05f;
// How far a point may move along each axis, in cells.
constexpr float kMaxMove = 0.4f;

// The box around everything the play space sees, and the receivers themselves.
void seenBounds(const RayTracer& tracer, const PlaySpace& playSpace, glm::vec3& low, glm::vec3& high) {
  low = glm::vec3(INFINITY);
  high = -low;
  const auto add = [&](const glm::vec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  };
  const Scene& scene = tracer.scene();
  for (const Instance& instance : scene.instances) {
    if (instance.mode != BakeMode::fixed) continue;
    const auto triangles = static_cast<std::uint32_t>(scene.meshes[instance.mesh].triangle.size());
    for (std::uint32_t t = 0; t < triangles; ++t) {
      const std::size_t side = 2 * (static_cast<std::size_t>(instance.firstTriangle) + t);
      if (!playSpace.visible[side] && !playSpace.visible[side + 1]) continue;
      for (const glm::vec3& p : scene.corners(instance, t)) add(p);
    }
  }
  const glm::vec3 sceneLow = tracer.boundsMin(), sceneHigh = tracer.boundsMax();
  for (const glm::vec3& p : playSpace.receivers) add(glm::clamp(p, sceneLow, sceneHigh));
  if (!(low.x <= high.x)) {
    low = sceneLow;
    high = sceneHigh;
  }
}

// Points along each axis for a spacing that cells of a cube share; points sit in the middle of their cells, so that
// none lies on the walls.
glm::uvec3 resolutionFor(const glm::vec3& extent, double spacing) {
  glm::uvec3 resolution;
  for (int k = 0; k < 3; ++k) resolution[k] = static_cast<std::uint32_t>(std::clamp(std::round(extent[k] / spacing), 1.0, static_cast<double>(kMostAlong)));
  return resolution;
}

double countOf(const glm::uvec3& r) { return static_cast<double>(r.x) * r.y * r.z; }

glm::uvec3 chooseResolution(const glm::vec3& extent, const CacheOptions& options) {
  if (options.gridResolution != glm::uvec3(0)) return glm::max(options.gridResolution, glm::uvec3(1));
  if (options.gridSpacing > 0.0f) return resolutionFor(extent, options.gridSpacing);
  if (options.gridCaches == 0) return glm::uvec3(0);
  // The finest spacing that keeps to the count.
  double fine = 1e-6 * std::max({extent.x, extent.y, extent.z}), coarse = 2.0 * std::max({extent.x, extent.y, extent.z});
  for (int i = 0; i < 64; ++i) {
    const double middle = std::sqrt(fine * coarse);
    (countOf(resolutionFor(extent, middle)) > options.gridCaches ? fine : coarse) = middle;
  }
  return resolutionFor(extent, coarse);
}

// Offsets to try, nearest first: the point itself, then a 5 x 5 x 5 lattice within the reach of a move.
std::vector<glm::vec3> moves() {
  std::vector<glm::vec3> result;
  for (int z = -2; z <= 2; ++z) {
    for (int y = -2; y <= 2; ++y) {
      for (int x = -2; x <= 2; ++x) result.push_back(glm::vec3(x, y, z) * (0.5f * kMaxMove));
    }
  }
  std::stable_sort(result.begin(), result.end(), [](const glm::vec3& a, const glm::vec3& b) { return glm::dot(a, a) < glm::dot(b, b); });
  return result;
}

}  // namespace

PlacedGrid placeGrid(const RayTracer& tracer, const PlaySpace& playSpace, const CacheOptions& options, Context& context) {
  PlacedGrid result;
  glm::vec3 low, high;
  seenBounds(tracer, playSpace, low, high);
  const glm::vec3 extent = glm::max(high - low, glm::vec3(1e-4f));
  CacheGrid& grid = result.grid;
  grid.resolution = chooseResolution(extent, options);
  if (countOf(grid.resolution) == 0.0) return result;
  grid.spacing = extent / glm::vec3(grid.resolution);
  grid.originWorld = low + 0.5f * grid.spacing;

  // Find a valid place for every point.
  const std::size_t count = std::size_t{grid.resolution.x} * grid.resolution.y * grid.resolution.z;
  const Prober prober(tracer, playSpace);
  const std::vector<glm::vec3> offsets = moves();
  const float contact = 0.02f * std::min({grid.spacing.x, grid.spacing.y, grid.spacing.z});
  std::vector<glm::vec3> place(count);
  std::vector<std::uint8_t> verdict(count, 0);  // 0 dropped, 1 in place, 2 moved
  parallelChunks(context, "grid", count, 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const glm::vec3 lattice(static_cast<float>(i % grid.resolution.x), static_cast<float>(i / grid.resolution.x % grid.resolution.y),
                              static_cast<float>(i / grid.resolution.x / grid.resolution.y));
      const glm::vec3 point = grid.originWorld + lattice * grid.spacing;
      for (std::size_t k = 0; k < offsets.size(); ++k) {
        const glm::vec3 p = point + offsets[k] * grid.spacing;
        const Surroundings around = prober.probe(p, glm::vec3(0.0f), contact);
        const bool inside = around.back > options.maxBackFaceShare || around.back + around.near > 0.9f;
        // Outside the play space every place of the cell is.
        if (k == 0 && !inside && around.seen < kMinSeenShare) break;
        if (inside || around.seen < kMinSeenShare) continue;
        place[i] = p;
        verdict[i] = k == 0 ? 1 : 2;
        break;
      }
    }
  });

  std::vector<std::uint32_t> cache(count, kNoCache);
  double moved = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    if (verdict[i] == 0) continue;
    cache[i] = static_cast<std::uint32_t>(result.position.size());
    result.position.push_back(place[i]);
    moved += verdict[i] == 2;
  }
  grid.cache = std::move(cache);
  context.figure("grid_points", static_cast<double>(count));
  context.figure("grid_caches", static_cast<double>(result.position.size()));
  context.figure("grid_moved", moved);
  return result;
}

}  // namespace relume
