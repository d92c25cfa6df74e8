// SPDX-License-Identifier: MIT
// See keep_voxels.h.
#include "bake/visibility/keep_voxels.h"

#include "bake/visibility/surface_parts.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <limits>
#include <mutex>

namespace relume {
namespace {

constexpr double kDroppedHits = 0.005;        // largest share of all hits that dropped voxels may have
constexpr double kDroppedDensity = 0.1;       // dropped voxels have less than this share of the mean hits per area
constexpr std::uint32_t kFillNeighbours = 2;  // a voxel with so many of its six neighbours kept is added

// Drop the voxels with few hits per area, which takes each voxel's area.
std::vector<VoxelHits> dropThin(const Scene& scene, const VoxelGrid& grid, std::vector<VoxelHits> voxels,
                                double totalArea, bool hasLarge, Context& context) {
  // Sum the areas in fixed point: the order in which threads add must not matter.
  const double unit = totalArea * 0x1p-52;
  const VoxelIndex index(voxels);
  const VoxelTree tree = hasLarge ? VoxelTree(grid, voxels, 0) : VoxelTree();
  std::vector<std::atomic<std::uint64_t>> area(voxels.size());
  const SeenFacings seenFacings(scene.instances.size(), voxels);
  struct Memo {
    VoxelMemo<std::size_t> voxel;                       // its index
    std::vector<std::pair<std::size_t, double>> found;  // voxel, weight: of one triangle
  };
  forEachTriangle<Memo>(
      scene, 0, scene.triangleCount(), context, [&](std::uint32_t i) { return seenFacings.hasAny(i); },
      [&](std::uint32_t i, std::uint32_t, const auto& corners, float triangle, Memo& memo) {
        const std::array<std::uint32_t, 2> facings = VoxelGrid::facingsOf(i, crossOf(corners));
        if (!seenFacings.has(facings[0]) && !seenFacings.has(facings[1])) return;
        memo.found.clear();
        const double all =
            forEachPart(corners, triangle, grid.size, tree, i, context, [&](const glm::vec3& p, double weight) {
              const glm::ivec3 cube = grid.cubeOf(p);
              for (const std::uint32_t facing : facings) {
                if (!seenFacings.has(facing)) continue;
                const std::size_t at = memo.voxel.of(facing, cube, [&] { return index.find(voxelKey(facing, cube)); });
                if (at < voxels.size()) memo.found.emplace_back(at, weight);
              }
            });
        for (const auto& [at, weight] : memo.found)
          area[at].fetch_add(static_cast<std::uint64_t>(triangle / unit / all * weight), std::memory_order_relaxed);
      });

  // Sort by hits per area and drop from the low end. A voxel in which no part of a triangle has its centre has no area
  // here, and is kept.
  double hits = 0.0, seen = 0.0;
  std::vector<std::pair<double, std::uint32_t>> byDensity(voxels.size());
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const double count = static_cast<double>(voxels[i].direct) + voxels[i].bounced;
    const double a = static_cast<double>(area[i].load()) * unit;
    byDensity[i] = {a > 0.0 ? count / a : std::numeric_limits<double>::infinity(), static_cast<std::uint32_t>(i)};
    hits += count;
    seen += a;
  }
  std::sort(byDensity.begin(), byDensity.end());
  double dropped = 0.0;
  for (const auto& [density, i] : byDensity) {
    dropped += static_cast<double>(voxels[i].direct) + voxels[i].bounced;
    if (dropped > kDroppedHits * hits || density > kDroppedDensity * hits / std::max(seen, unit)) break;
    voxels[i].key = 0;
  }
  std::erase_if(voxels, [](const VoxelHits& c) { return c.key == 0; });
  return voxels;
}

// Add the voxels between kept ones.
void fillHoles(const Scene& scene, const VoxelGrid& grid, std::vector<VoxelHits>& voxels, bool hasLarge,
               Context& context) {
  const VoxelIndex index(voxels);
  const VoxelTree tree = hasLarge ? VoxelTree(grid, voxels, 1) : VoxelTree();
  std::vector<VoxelHits> filled;
  std::mutex mutex;
  const SeenFacings seenFacings(scene.instances.size(), voxels);
  // Add the voxel if it is between others. Returns true: what was done need not be done again.
  const auto fill = [&](std::uint32_t facing, const glm::ivec3& cube) {
    VoxelHits voxel{voxelKey(facing, cube), 0, 1, cube, facing};
    if (index.contains(voxel.key)) return true;
    std::uint32_t around = 0;
    for (const std::uint64_t neighbour : VoxelGrid::neighbours(facing, cube)) {
      const std::size_t at = index.find(neighbour);
      if (at == voxels.size()) continue;
      ++around;
      if (voxels[at].direct > 0) voxel.direct = 1;
    }
    if (around < kFillNeighbours) return true;
    const std::lock_guard lock(mutex);
    filled.push_back(voxel);
    return true;
  };
  forEachTriangle<VoxelMemo<bool>>(
      scene, 0, scene.triangleCount(), context, [&](std::uint32_t i) { return seenFacings.hasAny(i); },
      [&](std::uint32_t i, std::uint32_t, const auto& corners, float area, VoxelMemo<bool>& memo) {
        const std::array<std::uint32_t, 2> facings = VoxelGrid::facingsOf(i, crossOf(corners));
        if (!seenFacings.has(facings[0]) && !seenFacings.has(facings[1])) return;
        forEachPart(corners, area, grid.size, tree, i, context, [&](const glm::vec3& p, double) {
          const glm::ivec3 cube = grid.cubeOf(p);
          for (const std::uint32_t facing : facings) {
            if (seenFacings.has(facing)) memo.of(facing, cube, [&] { return fill(facing, cube); });
          }
        });
      });
  // Several triangles may have found the same voxel. Any of these entries will do: their neighbours are the same.
  const auto byKey = [](const VoxelHits& a, const VoxelHits& b) { return a.key < b.key; };
  voxels.insert(voxels.end(), filled.begin(), filled.end());
  std::sort(voxels.begin(), voxels.end(), byKey);
  voxels.erase(std::unique(voxels.begin(), voxels.end(), [](const auto& a, const auto& b) { return a.key == b.key; }),
               voxels.end());
}

}  // namespace

std::vector<VoxelHits> keepVoxels(const Scene& scene, const VoxelGrid& grid, std::vector<VoxelHits> voxels,
                                  double totalArea, bool hasLarge, Context& context) {
  std::vector<VoxelHits> kept = dropThin(scene, grid, std::move(voxels), totalArea, hasLarge, context);
  if (!context.cancelled()) fillHoles(scene, grid, kept, hasLarge, context);
  return kept;
}

}  // namespace relume
