// SPDX-License-Identifier: MIT
// See hemisphere_cells.h. Both tables are integrals along the borders of cells, each walked once as a chain of short
// arcs. Lambert's (triangle_light.h): Int over a cell of omega d omega = 1/2 Int along its border of omega x d omega,
// the cell on the left. With the cell on the left, m points to the right of the way: m ds = -omega x d omega.
#include "bake/preview/hemisphere_cells.h"

#include "bake/links/directions.h"
#include "bake/reference/triangle_light.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace relume {
namespace {

using std::numbers::pi;
constexpr int kArcs = 8;  // that a border is walked in

// Sums along a way on the sphere: Int omega x d omega, and its part in the plane weighed by cos theta.
struct Walk {
  glm::dvec3 lambert{0.0};
  glm::dvec2 weighed{0.0};

  void arc(const glm::dvec3& from, const glm::dvec3& to) {
    const glm::dvec3 step = lambertArc(from, to);
    if (step == glm::dvec3(0.0)) return;
    const glm::dvec3 middle = glm::normalize(from + to);
    lambert += step;
    // Simpson's rule for the cosine.
    weighed += glm::dvec2(step) * ((from.z + 4.0 * middle.z + to.z) / 6.0);
  }
};

using GridMap = decltype(HemisphereCells::map);

Walk walk(const GridMap& map, double column, double row, double toColumn, double toRow) {
  Walk sums;
  glm::dvec3 from = map(column, row);
  for (int i = 1; i <= kArcs; ++i) {
    const double t = static_cast<double>(i) / kArcs;
    const glm::dvec3 to = map(column + (toColumn - column) * t, row + (toRow - row) * t);
    sums.arc(from, to);
    from = to;
  }
  return sums;
}

// Walks each line of the grid once, up columns and along rows. `margin` [cells] is how far the map reaches beyond the
// cells on the border, which own what lies there.
void integrate(const GridMap& map, double margin, HemisphereCells& cells) {
  const std::uint32_t columns = cells.columns, rows = cells.rows;
  std::vector<glm::dvec3> integral(cells.count(), glm::dvec3(0.0));
  cells.toNextColumn.assign(cells.count(), glm::vec2(0.0f));
  cells.toNextRow.assign(cells.count(), glm::vec2(0.0f));
  // Where line k of n lies, with the margin.
  const auto line = [margin](std::uint32_t k, std::uint32_t n) {
    return static_cast<double>(k) + (k == 0 ? -margin : (k == n ? margin : 0.0));
  };
  // From one line to the next in two legs or three, so that a leg never bends where the margin begins.
  const auto legs = [&](std::uint32_t k, std::uint32_t n, const auto& leg) {
    const double inner = static_cast<double>(k), outer = static_cast<double>(k + 1);
    if (k == 0 && margin > 0.0) leg(line(0, n), inner);
    leg(inner, outer);
    if (k + 1 == n && margin > 0.0) leg(outer, line(n, n));
  };
  const auto add = [](Walk& sum, const Walk& more) {
    sum.lambert += more.lambert;
    sum.weighed += more.weighed;
  };
  for (std::uint32_t j = 0; j < rows; ++j) {
    for (std::uint32_t i = 0; i <= columns; ++i) {
      Walk up;
      legs(j, rows, [&](double from, double to) { add(up, walk(map, line(i, columns), from, line(i, columns), to)); });
      if (i > 0) integral[j * columns + i - 1] += 0.5 * up.lambert;
      if (i < columns) integral[j * columns + i] -= 0.5 * up.lambert;
      if (i > 0 && i < columns) cells.toNextColumn[j * columns + i - 1] = -glm::vec2(up.weighed);
    }
  }
  for (std::uint32_t j = 0; j <= rows; ++j) {
    for (std::uint32_t i = 0; i < columns; ++i) {
      Walk along;
      legs(i, columns, [&](double from, double to) { add(along, walk(map, from, line(j, rows), to, line(j, rows))); });
      if (j < rows) integral[j * columns + i] += 0.5 * along.lambert;
      if (j > 0) integral[(j - 1) * columns + i] -= 0.5 * along.lambert;
      if (j > 0 && j < rows) cells.toNextRow[(j - 1) * columns + i] = glm::vec2(along.weighed);
    }
  }
  cells.integral.assign(integral.begin(), integral.end());
}

}  // namespace

HemisphereCells fanCells(std::uint32_t rays) {
  const DirectionStrata strata(rays, 0.0f);
  HemisphereCells cells;
  cells.columns = strata.columns();
  cells.rows = strata.rows();
  cells.strata = true;
  const double columns = cells.columns, rows = cells.rows;
  cells.map = [columns, rows](double column, double row) {
    return glm::normalize(
        glm::dvec3(hemisphereDirection(static_cast<float>(column / columns), static_cast<float>(row / rows), 0.0f)));
  };
  integrate(cells.map, 0.0, cells);
  // Strata have one projected solid angle by construction.
  for (glm::vec3& integral : cells.integral) integral.z = static_cast<float>(pi / (columns * rows));
  return cells;
}

HemisphereCells planeCells(std::uint32_t side, float fovRad, Hemisphere mode) {
  HemisphereCells cells;
  cells.columns = cells.rows = side;
  const double half = std::tan(0.5 * static_cast<double>(fovRad)), count = side;
  cells.margin = mode == Hemisphere::border ? 1.0 : 0.0;
  // Within the plane, the point at distance 1; from its edge on to the horizon, away from the middle.
  cells.map = [half, count](double column, double row) {
    const double x = 2.0 * column / count - 1.0, y = 2.0 * row / count - 1.0;
    const glm::dvec2 inside(std::clamp(x, -1.0, 1.0), std::clamp(y, -1.0, 1.0));
    const double beyond = 0.5 * count * std::max(std::max(std::abs(x), std::abs(y)) - 1.0, 0.0);
    return glm::normalize(glm::dvec3(half * inside, std::max(1.0 - beyond, 0.0)));
  };
  integrate(cells.map, cells.margin, cells);

  double total = 0.0;
  for (const glm::vec3& integral : cells.integral) total += integral.z;
  if (mode == Hemisphere::scaled) {
    cells.scale = pi / total;
    const auto scale = static_cast<float>(cells.scale);
    for (glm::vec3& integral : cells.integral) integral *= scale;
    for (glm::vec2& arc : cells.toNextColumn) arc *= scale;
    for (glm::vec2& arc : cells.toNextRow) arc *= scale;
  }
  for (std::uint32_t j = 0; j < side; ++j) {
    for (std::uint32_t i = 0; i < side; ++i) cells.direction.emplace_back(cells.map(i + 0.5, j + 0.5));
  }
  return cells;
}

}  // namespace relume
