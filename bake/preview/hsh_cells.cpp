// SPDX-License-Identifier: MIT
// See hsh_cells.h. Cells are cut until a part is so small that its functions hardly change over it; borders are walked
// as chains of short arcs, with Simpson's rule on each.
#include "bake/preview/hsh_cells.h"

#include "bake/preview/hsh.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace relume {
namespace {

constexpr int kBorderArcs = 8;      // that a border is walked in
constexpr double kMaxWidth = 0.06;  // of a part
constexpr double kMaxRise = 0.02;   // of a part's z: near the horizon the functions turn fast
constexpr int kMostCuts = 7;

using Values = std::array<double, kMaxHshCoefficients>;

constexpr double kHorizon = 2e-3;  // z below which a corner lies on it: a fan's map ends a little above

// Solid angle of a small triangle on the sphere (van Oosterom and Strackee 1983).
double solidAngle(const glm::dvec3& a, const glm::dvec3& b, const glm::dvec3& c) {
  return 2.0 *
         std::atan2(std::abs(glm::dot(a, glm::cross(b, c))), 1.0 + glm::dot(a, b) + glm::dot(b, c) + glm::dot(c, a));
}

class Integrator {
 public:
  Integrator(const HemisphereCells& cells, int order)
      : cells_(cells), order_(order), size_(static_cast<std::size_t>(order * order)) {}

  // The direction of a point of the grid's square.
  glm::dvec3 at(double column, double row) const {
    const glm::dvec3 d = cells_.map(column, row);
    return d.z < kHorizon ? glm::normalize(glm::dvec3(d.x, d.y, 0.0)) : d;
  }

  // Add a part of the grid's square, between two corners.
  void addPart(const glm::dvec2& low, const glm::dvec2& high, int cuts, std::span<double> sum) const {
    const std::array<glm::dvec3, 4> corner{at(low.x, low.y), at(high.x, low.y), at(high.x, high.y), at(low.x, high.y)};
    const auto [least, most] = std::minmax({corner[0].z, corner[1].z, corner[2].z, corner[3].z});
    const double width = std::max(glm::distance(corner[0], corner[2]), glm::distance(corner[1], corner[3]));
    if (cuts < kMostCuts && (width > kMaxWidth || most - least > kMaxRise)) {
      const glm::dvec2 middle = 0.5 * (low + high);
      addPart(low, middle, cuts + 1, sum);
      addPart({middle.x, low.y}, {high.x, middle.y}, cuts + 1, sum);
      addPart(middle, high, cuts + 1, sum);
      addPart({low.x, middle.y}, {middle.x, high.y}, cuts + 1, sum);
      return;
    }
    const double area = solidAngle(corner[0], corner[1], corner[2]) + solidAngle(corner[0], corner[2], corner[3]);
    Values h;
    evaluateHsh(order_, glm::normalize(corner[0] + corner[1] + corner[2] + corner[3]), h);
    for (std::size_t i = 0; i < size_; ++i) sum[i] += area * h[i];
  }

  // Add Int H omega x d omega along a way, x and y of it.
  void addBorder(const glm::dvec2& begin, const glm::dvec2& end, double sign, std::span<double> sum) const {
    glm::dvec3 from = at(begin.x, begin.y);
    Values atFrom, atMiddle, atTo;
    evaluateHsh(order_, from, atFrom);
    for (int k = 1; k <= kBorderArcs; ++k) {
      const glm::dvec2 place = begin + (end - begin) * (static_cast<double>(k) / kBorderArcs);
      const glm::dvec3 to = at(place.x, place.y), across = glm::cross(from, to);
      const double sine = glm::length(across);
      evaluateHsh(order_, to, atTo);
      if (sine > 0.0) {
        evaluateHsh(order_, glm::normalize(from + to), atMiddle);
        const glm::dvec2 step = glm::dvec2(across) * (sign * std::atan2(sine, glm::dot(from, to)) / (6.0 * sine));
        for (std::size_t i = 0; i < size_; ++i) {
          const double h = atFrom[i] + 4.0 * atMiddle[i] + atTo[i];
          sum[i] += step.x * h;
          sum[size_ + i] += step.y * h;
        }
      }
      from = to;
      atFrom = atTo;
    }
  }

 private:
  const HemisphereCells& cells_;
  int order_;
  std::size_t size_;
};

// Where the square of `count` cells is cut: at whole numbers, and once more where a margin begins.
std::vector<double> legsOf(std::uint32_t k, std::uint32_t count, double margin) {
  std::vector<double> legs{static_cast<double>(k), static_cast<double>(k + 1)};
  if (margin > 0.0 && k == 0) legs.insert(legs.begin(), -margin);
  if (margin > 0.0 && k + 1 == count) legs.push_back(legs.back() + margin);
  return legs;
}

void addScaled(std::span<const float> row, const glm::vec3& factor, std::span<float> sums) {
  const std::size_t n = row.size();
  float *r = sums.data(), *g = r + n, *b = g + n;
  for (std::size_t i = 0; i < n; ++i) {
    r[i] += factor.x * row[i];
    g[i] += factor.y * row[i];
    b[i] += factor.z * row[i];
  }
}

}  // namespace

HshCells hshCells(const HemisphereCells& cells, int order) {
  const Integrator integrator(cells, order);
  const auto size = static_cast<std::size_t>(order * order);
  HshCells tables;
  tables.order = order;
  tables.integral.assign(cells.count() * size, 0.0f);
  tables.toNextColumn.assign(cells.count() * 2 * size, 0.0f);
  tables.toNextRow.assign(cells.count() * 2 * size, 0.0f);
  std::vector<double> area(size), border(2 * size);
  const auto keep = [&](const std::vector<double>& sum, std::vector<float>& table, std::uint32_t cell) {
    std::transform(sum.begin(), sum.end(), table.begin() + static_cast<std::ptrdiff_t>(cell * sum.size()),
                   [&](double value) { return static_cast<float>(cells.scale * value); });
  };
  for (std::uint32_t j = 0, cell = 0; j < cells.rows; ++j) {
    const std::vector<double> up = legsOf(j, cells.rows, cells.margin);
    for (std::uint32_t i = 0; i < cells.columns; ++i, ++cell) {
      const std::vector<double> along = legsOf(i, cells.columns, cells.margin);
      std::fill(area.begin(), area.end(), 0.0);
      for (std::size_t v = 1; v < up.size(); ++v) {
        for (std::size_t u = 1; u < along.size(); ++u)
          integrator.addPart({along[u - 1], up[v - 1]}, {along[u], up[v]}, 0, area);
      }
      keep(area, tables.integral, cell);
      // m points to the right of the way: up the columns m ds = -omega x d omega, along the rows it is the opposite.
      if (i + 1 < cells.columns) {
        std::fill(border.begin(), border.end(), 0.0);
        for (std::size_t v = 1; v < up.size(); ++v)
          integrator.addBorder({along.back(), up[v - 1]}, {along.back(), up[v]}, -1.0, border);
        keep(border, tables.toNextColumn, cell);
      }
      if (j + 1 < cells.rows) {
        std::fill(border.begin(), border.end(), 0.0);
        for (std::size_t u = 1; u < along.size(); ++u)
          integrator.addBorder({along[u - 1], up.back()}, {along[u], up.back()}, 1.0, border);
        keep(border, tables.toNextRow, cell);
      }
    }
  }
  return tables;
}

void sumHshCells(const HemisphereCells& cells, const HshCells& tables, std::span<const glm::vec3> radiance,
                 std::span<const float> distance, std::span<float> sums) {
  const auto size = static_cast<std::size_t>(tables.order * tables.order);
  std::fill(sums.begin(), sums.end(), 0.0f);
  const std::span<float> light = sums.first(3 * size), alongT = sums.subspan(3 * size, 3 * size),
                         alongB = sums.subspan(6 * size, 3 * size);
  const auto border = [&](std::uint32_t a, std::uint32_t b, const std::vector<float>& table) {
    if (radiance[a] == radiance[b] || distance[a] < 0.0f || distance[b] < 0.0f) return;
    const float r = std::min(distance[a], distance[b]);
    if (r == std::numeric_limits<float>::infinity()) return;
    const glm::vec3 change = (radiance[b] - radiance[a]) / std::max(r, 1e-12f);
    const std::span row = std::span(table).subspan(a * 2 * size, 2 * size);
    addScaled(row.first(size), change, alongT);
    addScaled(row.subspan(size), change, alongB);
  };
  for (std::uint32_t j = 0, cell = 0; j < cells.rows; ++j) {
    for (std::uint32_t i = 0; i < cells.columns; ++i, ++cell) {
      if (radiance[cell] != glm::vec3(0.0f))
        addScaled(std::span(tables.integral).subspan(cell * size, size), radiance[cell], light);
      if (i + 1 < cells.columns) border(cell, cell + 1, tables.toNextColumn);
      if (j + 1 < cells.rows) border(cell, cell + cells.columns, tables.toNextRow);
    }
  }
}

}  // namespace relume
