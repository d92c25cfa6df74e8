// SPDX-License-Identifier: MIT
// See surfel_map.h. Plain nearest neighbours cross gaps between thin layers and cost 4 % of the energy (measured); the
// cost that is minimised instead is in map_cost.h. Surfels are found ring by ring of a grid of cells one spacing wide:
// the cost is at least the squared distance, so the search ends when the next ring is farther than the best cost.
#include "bake/surfels/surfel_map.h"

#include "bake/parallel.h"
#include "bake/surfels/map_cost.h"
#include "bake/point_grid.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace relume {
namespace {

constexpr float kCellSpacings = 0.5f;        // wanted size of a cell
constexpr float kUnseenCellSpacings = 2.0f;  // on sides that the play space does not see
// A grid's cells are limited to what the areas need: slivers have long edges and little area, and huge ground planes
// may be seen in a corner only.
constexpr double kMinCells = 16.0;
constexpr double kMaxCellsPerArea = 8.0;
constexpr double kMaxCellsPerSeenArea = 32.0;
constexpr double kMaxUnseenCells = 1024.0;
constexpr std::size_t kSidesPerChunk = 512;
constexpr float kRounding = 1.0f + 1e-5f;  // a search's radius is not cut short by a rounding error
constexpr std::uint32_t kMaxAlong = (1u << 14) - 1;  // of cells along an edge: SurfelMap::Side

// A point's coordinates in the grid that starts at a corner: weights of the next two corners.
glm::vec2 toGrid(const glm::vec2& b, std::uint32_t corner) {
  const float first = 1.0f - b.x - b.y;
  return corner == 0 ? b : (corner == 1 ? glm::vec2(b.y, first) : glm::vec2(first, b.x));
}

glm::vec2 fromGrid(const glm::vec2& g, std::uint32_t corner) {
  const float first = 1.0f - g.x - g.y;
  return corner == 0 ? g : (corner == 1 ? glm::vec2(first, g.x) : glm::vec2(g.y, first));
}

struct GridShape {
  std::uint32_t corner = 0, columns = 1, rows = 1;
};

// Cells about `size` wide, started from the corner that needs the fewest. Coarser where the areas do not justify them.
GridShape shapeOf(const std::array<glm::vec3, 3>& corner, double size, double seenArea) {
  std::array<double, 3> length;  // of the edge from corner k to the next
  for (std::size_t k = 0; k < 3; ++k) length[k] = glm::length(glm::dvec3(corner[(k + 1) % 3]) - glm::dvec3(corner[k]));
  double columns = 0.0, rows = 0.0;
  GridShape shape;
  for (std::uint32_t k = 0; k < 3; ++k) {
    const double c = std::max(1.0, std::ceil(length[k] / size)),
                 r = std::max(1.0, std::ceil(length[(k + 2) % 3] / size));
    if (k > 0 && c * r >= columns * rows) continue;
    columns = c;
    rows = r;
    shape.corner = k;
  }
  const double area = 0.5 * glm::length(glm::cross(glm::dvec3(corner[1]) - glm::dvec3(corner[0]),
                                                   glm::dvec3(corner[2]) - glm::dvec3(corner[0])));
  const double most = seenArea > 0.0 ? kMaxCellsPerSeenArea * seenArea / (size * size) : kMaxUnseenCells;
  const double limit = kMinCells + std::min(kMaxCellsPerArea * area / (size * size), most);
  const double shrink = std::min(1.0, std::sqrt(limit / (columns * rows)));
  const auto cells = [&](double along) {
    return static_cast<std::uint32_t>(std::clamp(std::ceil(along * shrink), 1.0, double{kMaxAlong}));
  };
  shape.columns = cells(columns);
  shape.rows = cells(rows);
  return shape;
}

// Surfels sorted by the cells of a grid: one spacing wide for seen sides; as wide as the whole reach for the many sides
// that are not seen, most of which have no surfel near.
struct SortedSurfels {
  PointGrid grid;
  std::vector<glm::vec3> position;    // in the grid's order
  std::vector<SurfaceSample> sample;  // the same
  std::span<const std::uint32_t> id;
  float spacing = 0.0f;

  // Place in the grid's order of the surfel of least cost among those within reach [m], kNone: there is none; among
  // equals the one with the smallest index. guess: a place to look at first, kNone: none; a good one saves time.
  std::uint32_t best(const SurfaceSample& point, float reach, std::uint32_t guess) const {
    float bestCost = kNoMapping, farthest = reach * reach;
    std::uint32_t found = kNone;
    const auto visit = [&](std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i) {
        // The cost is no less than the squared distance.
        const glm::vec3 apart = position[i] - point.positionWorld;
        if (glm::dot(apart, apart) > farthest) continue;
        const float cost = mapCost(point, sample[i], spacing);
        if (cost > bestCost || cost == kNoMapping || (cost == bestCost && id[i] > id[found])) continue;
        bestCost = cost;
        found = i;
        farthest = std::min(farthest, cost);
      }
    };
    if (guess != kNone) visit(guess, guess + 1);
    if (farthest < grid.cellSize() * grid.cellSize()) {
      grid.forEachRunWithin(point.positionWorld, std::sqrt(farthest) * kRounding, visit);
      return found;
    }
    const int rings = static_cast<int>(std::ceil(reach / grid.cellSize()));
    grid.forEachRun(point.positionWorld, 1, visit);
    for (int ring = 2; ring <= rings; ++ring) {
      // Everything within ring - 1 whole cells has been looked at.
      const float covered = static_cast<float>(ring - 1) * grid.cellSize();
      if (bestCost < covered * covered) break;
      grid.forEachRunOfShell(point.positionWorld, ring, visit);
    }
    return found;
  }
};

SortedSurfels sortSurfels(std::span<const SurfaceSample> surfels, float spacing, float cellSize, Context& context) {
  SortedSurfels sorted;
  sorted.spacing = spacing;
  std::vector<glm::vec3> position;
  position.reserve(surfels.size());
  for (const SurfaceSample& s : surfels) position.push_back(s.positionWorld);
  sorted.grid = PointGrid(position, cellSize, context);
  sorted.id = sorted.grid.order();
  sorted.position.reserve(surfels.size());
  sorted.sample.reserve(surfels.size());
  for (const std::uint32_t i : sorted.id) {
    sorted.position.push_back(surfels[i].positionWorld);
    sorted.sample.push_back(surfels[i]);
  }
  return sorted;
}

// The cells of one side.
struct SideCells {
  GridShape shape;
  std::vector<std::uint32_t> cell;
};

// guess: place of a surfel that may be near; left at one that is.
SideCells mapSide(const Scene& scene, const PlaySpace& playSpace, const SortedSurfels& sorted, float reach,
                  std::uint32_t instance, std::uint32_t side, std::uint32_t& guess) {
  const bool seen = playSpace.seenArea[side] > 0.0f;
  SurfaceSample point = sampleAt(scene, instance, side, glm::vec2(1.0f / 3.0f));
  if (point.normal == glm::vec3(0.0f)) return {};
  const std::array<glm::vec3, 3> corner = scene.corners(scene.instances[instance], point.point.triangle);
  const GridShape shape =
      shapeOf(corner, sorted.spacing * (seen ? kCellSpacings : kUnseenCellSpacings), playSpace.seenArea[side]);

  SideCells cells;
  cells.shape = shape;
  cells.cell.assign(std::size_t{shape.columns} * shape.rows, kNone);
  std::uint32_t atRowBegin = guess;
  bool any = false;
  for (std::uint32_t row = 0; row < shape.rows; ++row) {
    for (std::uint32_t column = 0; column < shape.columns; ++column) {
      // Cells beyond the third edge are never asked.
      if (std::uint64_t{column} * shape.rows + std::uint64_t{row} * shape.columns >
          std::uint64_t{shape.columns} * shape.rows) {
        break;
      }
      glm::vec2 g((static_cast<float>(column) + 0.5f) / static_cast<float>(shape.columns),
                  (static_cast<float>(row) + 0.5f) / static_cast<float>(shape.rows));
      if (g.x + g.y > 1.0f) g /= g.x + g.y;
      if (shape.columns == 1 && shape.rows == 1) g = glm::vec2(1.0f / 3.0f);
      const glm::vec2 b = fromGrid(g, shape.corner);
      point.positionWorld = corner[0] + b.x * (corner[1] - corner[0]) + b.y * (corner[2] - corner[0]);
      const std::uint32_t found = sorted.best(point, reach, column == 0 ? atRowBegin : guess);
      if (found == kNone) continue;
      guess = found;
      if (column == 0) atRowBegin = found;
      cells.cell[std::size_t{row} * shape.columns + column] = sorted.id[found];
      any = true;
    }
  }
  return any ? cells : SideCells{};
}

}  // namespace

std::uint32_t SurfelMap::cellOf(std::uint32_t side, const glm::vec2& barycentric) const {
  const Side& s = sides[side];
  if (s.columns == 0) return kNone;
  const glm::vec2 g = toGrid(barycentric, s.corner);
  const auto along = [](float x, std::uint32_t cells) {
    const float at = std::max(x * static_cast<float>(cells), 0.0f);
    return std::min(static_cast<std::uint32_t>(at), cells - 1);
  };
  return s.firstCell + along(g.y, s.rows) * s.columns + along(g.x, s.columns);
}

std::size_t SurfelMap::sizeBytes() const { return sides.size() * sizeof(Side) + cell.size() * sizeof(std::uint32_t); }

SurfelMap buildSurfelMap(const Scene& scene, const PlaySpace& playSpace, std::span<const SurfaceSample> surfels,
                         float spacing, Context& context) {
  const float seenReach = kSeenReach * spacing, unseenReach = kUnseenReach * spacing;
  const SortedSurfels forSeen = sortSurfels(surfels, spacing, spacing, context);
  const SortedSurfels forUnseen = sortSurfels(surfels, spacing, unseenReach, context);
  const std::size_t sides = 2 * std::size_t{scene.triangleCount()};

  struct Part {
    std::vector<SurfelMap::Side> side;  // firstCell: within the part
    std::vector<std::uint32_t> cell;
  };
  std::vector<Part> parts((sides + kSidesPerChunk - 1) / kSidesPerChunk);
  parallelChunks(context, "surfel map", sides, kSidesPerChunk, [&](std::size_t begin, std::size_t end) {
    Part& part = parts[begin / kSidesPerChunk];
    std::array<std::uint32_t, 4> guess{kNone, kNone, kNone, kNone};  // front, back; of sides that are seen or not
    for (std::size_t s = begin; s < end; ++s) {
      const auto side = static_cast<std::uint32_t>(s);
      const std::uint32_t instance = scene.instanceOf(side / 2);
      SideCells cells;
      if (scene.instances[instance].mode == BakeMode::fixed) {
        const bool seen = playSpace.seenArea[side] > 0.0f;
        cells = mapSide(scene, playSpace, seen ? forSeen : forUnseen, seen ? seenReach : unseenReach, instance, side,
                        guess[2 * seen + side % 2]);
      }
      SurfelMap::Side& mapped = part.side.emplace_back();
      if (cells.cell.empty()) continue;
      mapped.firstCell = static_cast<std::uint32_t>(part.cell.size());
      mapped.columns = static_cast<std::uint16_t>(cells.shape.columns);
      mapped.rows = cells.shape.rows & kMaxAlong;
      mapped.corner = cells.shape.corner & 3u;
      part.cell.insert(part.cell.end(), cells.cell.begin(), cells.cell.end());
    }
  });

  SurfelMap map;
  if (context.cancelled()) return map;
  map.sides.reserve(sides);
  for (Part& part : parts) {
    for (SurfelMap::Side& mapped : part.side) mapped.firstCell += static_cast<std::uint32_t>(map.cell.size());
    map.sides.insert(map.sides.end(), part.side.begin(), part.side.end());
    map.cell.insert(map.cell.end(), part.cell.begin(), part.cell.end());
  }
  return map;
}

}  // namespace relume
