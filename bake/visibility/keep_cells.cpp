// SPDX-License-Identifier: MIT
// See keep_cells.h.
#include "bake/visibility/keep_cells.h"

#include "bake/visibility/surface_parts.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <mutex>

namespace relume {
namespace {

constexpr double kDroppedHits = 0.005;        // share of the hits in dropped cells
constexpr double kDroppedDensity = 0.1;       // and they are hit less than this share of the mean
constexpr std::uint32_t kFillNeighbours = 2;  // of six, that make a cell seen

// Drop the thinly hit cells (kDroppedHits); needs each cell's area.
std::vector<CellHits> dropThin(const Scene& scene, const CellGrid& grid, std::vector<CellHits> cells, double totalArea,
                               bool hasLarge, Context& context) {
  // Sum areas in fixed point, so that the order of additions does not matter.
  const double unit = totalArea * 0x1p-52;
  const CellIndex index(cells);
  const CellTree tree = hasLarge ? CellTree(grid, cells, 0) : CellTree();
  std::vector<std::atomic<std::uint64_t>> area(cells.size());
  forEachTriangle(scene, context, [&](std::uint32_t i, std::uint32_t, const auto& corners, float triangle) {
    const glm::vec3 normal = crossOf(corners);
    std::vector<std::size_t> found;
    const double parts = forEachPart(corners, triangle, grid.size, tree, i, [&](const glm::vec3& p) {
      for (const std::uint64_t key : grid.keys(i, p, normal)) found.push_back(index.find(key));
    });
    const auto share = static_cast<std::uint64_t>(triangle / unit / parts);
    for (const std::size_t at : found) {
      if (at < cells.size()) area[at].fetch_add(share, std::memory_order_relaxed);
    }
  });

  // Sort by hits per area; drop from the thin end. A cell whose surface no part's centre fell into is kept.
  double hits = 0.0, seen = 0.0;
  std::vector<std::pair<double, std::uint32_t>> byDensity(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const double count = static_cast<double>(cells[i].direct) + cells[i].bounced;
    const double a = static_cast<double>(area[i].load()) * unit;
    byDensity[i] = {a > 0.0 ? count / a : std::numeric_limits<double>::infinity(), static_cast<std::uint32_t>(i)};
    hits += count;
    seen += a;
  }
  std::sort(byDensity.begin(), byDensity.end());
  double dropped = 0.0;
  for (const auto& [density, i] : byDensity) {
    dropped += static_cast<double>(cells[i].direct) + cells[i].bounced;
    if (dropped > kDroppedHits * hits || density > kDroppedDensity * hits / std::max(seen, unit)) break;
    cells[i].key = 0;
  }
  std::erase_if(cells, [](const CellHits& c) { return c.key == 0; });
  return cells;
}

// Add the cells between kept ones: hits are random, and a thinly hit surface would be full of holes.
void fillHoles(const Scene& scene, const CellGrid& grid, std::vector<CellHits>& cells, bool hasLarge,
               Context& context) {
  const CellIndex index(cells);
  const CellTree tree = hasLarge ? CellTree(grid, cells, 1) : CellTree();
  std::vector<CellHits> filled;
  std::mutex mutex;
  forEachTriangle(scene, context, [&](std::uint32_t i, std::uint32_t, const auto& corners, float area) {
    const glm::vec3 normal = crossOf(corners);
    std::vector<CellHits> found;
    forEachPart(corners, area, grid.size, tree, i, [&](const glm::vec3& p) {
      for (std::size_t side = 0; side < 2; ++side) {
        CellHits cell = grid.cell(i, p, side == 0 ? normal : -normal);
        if (index.contains(cell.key)) continue;
        std::uint32_t around = 0, direct = 0;
        for (const std::uint64_t neighbour : grid.neighbours(i, p, side == 0 ? normal : -normal)) {
          const std::size_t at = index.find(neighbour);
          if (at == cells.size()) continue;
          ++around;
          direct += cells[at].direct > 0 ? 1 : 0;
        }
        if (around < kFillNeighbours) continue;
        cell.direct = direct > 0 ? 1 : 0;
        cell.bounced = 1;
        found.push_back(cell);
      }
    });
    if (found.empty()) return;
    const std::lock_guard lock(mutex);
    filled.insert(filled.end(), found.begin(), found.end());
  });
  // A cell that several triangles found has the same neighbours each time.
  const auto byKey = [](const CellHits& a, const CellHits& b) { return a.key < b.key; };
  cells.insert(cells.end(), filled.begin(), filled.end());
  std::sort(cells.begin(), cells.end(), byKey);
  cells.erase(std::unique(cells.begin(), cells.end(), [](const auto& a, const auto& b) { return a.key == b.key; }),
              cells.end());
}

}  // namespace

std::vector<CellHits> keepCells(const Scene& scene, const CellGrid& grid, std::vector<CellHits> cells, double totalArea,
                                bool hasLarge, Context& context) {
  std::vector<CellHits> kept = dropThin(scene, grid, std::move(cells), totalArea, hasLarge, context);
  if (!context.cancelled()) fillHoles(scene, grid, kept, hasLarge, context);
  return kept;
}

}  // namespace relume
