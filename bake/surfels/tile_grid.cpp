// SPDX-License-Identifier: MIT
// See tile_grid.h.
#include "bake/surfels/tile_grid.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

// The number of a side's tiles is limited by its area and by its seen area, in tiles of the wanted width: slivers have
// long edges and little area, and of a huge ground plane, only a corner may be seen.
constexpr double kMinTiles = 16.0;
constexpr double kMaxTilesPerArea = 8.0;
constexpr double kMaxTilesPerSeenArea = 32.0;
constexpr double kMaxUnseenTiles = 1024.0;
constexpr double kManyTiles = 16384.0;  // grids of fewer tiles are not replaced by nested ones
constexpr double kMaxCoarser =
    2.0;  // than wanted: beyond, a nested grid is used, which is fine where something is seen

}  // namespace

TileGrid tileGridOf(const std::array<glm::vec3, 3>& corner, double size, double seenArea) {
  std::array<double, 3> length;  // of the edge from corner k to the next
  for (std::size_t k = 0; k < 3; ++k) length[k] = glm::length(glm::dvec3(corner[(k + 1) % 3]) - glm::dvec3(corner[k]));
  double columns = 0.0, rows = 0.0;
  TileGrid grid;
  for (std::uint32_t k = 0; k < 3; ++k) {
    const double c = std::max(1.0, std::ceil(length[k] / size)),
                 r = std::max(1.0, std::ceil(length[(k + 2) % 3] / size));
    if (k > 0 && c * r >= columns * rows) continue;
    columns = c;
    rows = r;
    grid.corner = k;
  }
  const double area = 0.5 * glm::length(glm::cross(glm::dvec3(corner[1]) - glm::dvec3(corner[0]),
                                                   glm::dvec3(corner[2]) - glm::dvec3(corner[0])));
  const double max = seenArea > 0.0 ? kMaxTilesPerSeenArea * seenArea / (size * size) : kMaxUnseenTiles;
  const double limit = kMinTiles + std::min(kMaxTilesPerArea * area / (size * size), max);
  const double shrink = std::min(1.0, std::sqrt(limit / (columns * rows)));
  const auto tiles = [&](double along) {
    return static_cast<std::uint32_t>(std::clamp(std::ceil(along * shrink), 1.0, double{kMaxTilesAlong}));
  };
  grid.nested = seenArea > 0.0 && shrink < 1.0 / kMaxCoarser && columns * rows > kManyTiles &&
                max < kMaxTilesPerArea * area / (size * size);
  grid.columns = tiles(columns);
  grid.rows = tiles(rows);
  return grid;
}

glm::vec2 TileGrid::middleOf(std::uint32_t column, std::uint32_t row) const {
  glm::vec2 g((static_cast<float>(column) + 0.5f) / static_cast<float>(columns),
              (static_cast<float>(row) + 0.5f) / static_cast<float>(rows));
  if (g.x + g.y > 1.0f) g /= g.x + g.y;
  if (tileCount() == 1) g = glm::vec2(1.0f / 3.0f);
  return fromTileGrid(g, corner);
}

}  // namespace relume
