// SPDX-License-Identifier: MIT
// See flatten.h.
#include "bake/caches/charts/flatten.h"

#include "bake/caches/charts/triangle_area.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace relume {
namespace {

// Smallest barycentric coordinate of p, which is positive strictly inside the triangle.
float insideness(const std::array<glm::vec2, 3>& t, const glm::vec2& p) {
  const float twice = cross2(t[1] - t[0], t[2] - t[0]);
  if (twice == 0.0f) return -1.0f;
  const float b = cross2(p - t[0], t[2] - t[0]) / twice, c = cross2(t[1] - t[0], p - t[0]) / twice;
  return std::min({1.0f - b - c, b, c});
}

void bounds(const Chart& chart, glm::vec2& low, glm::vec2& high) {
  low = glm::vec2(std::numeric_limits<float>::infinity());
  high = -low;
  for (const auto& corners : chart.uv) {
    for (const glm::vec2& p : corners) {
      low = glm::min(low, p);
      high = glm::max(high, p);
    }
  }
}

// Smallest and largest x of the triangle between two heights; the smallest exceeds the largest if it has no part there.
glm::vec2 widthBetween(const std::array<glm::vec2, 3>& t, float low, float high) {
  glm::vec2 width(std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity());
  const auto include = [&](float x) { width = {std::min(width.x, x), std::max(width.y, x)}; };
  for (std::size_t k = 0; k < 3; ++k) {
    const glm::vec2 a = t[k], b = t[(k + 1) % 3];
    if (std::max(a.y, b.y) < low || std::min(a.y, b.y) > high) continue;
    const auto at = [&](float y) { return a.y == b.y ? a.x : a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y)); };
    for (const glm::vec2 end : {a, b}) include(end.y < low ? at(low) : end.y > high ? at(high) : end.x);
  }
  return width;
}

// Convex hull, counter-clockwise (Andrew's monotone chain).
std::vector<glm::vec2> convexHull(std::vector<glm::vec2> points) {
  std::sort(points.begin(), points.end(),
            [](const glm::vec2& a, const glm::vec2& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  std::vector<glm::vec2> hull(2 * points.size());
  std::size_t n = 0;
  const auto add = [&](const glm::vec2& p, std::size_t minSize) {
    while (n >= minSize && cross2(hull[n - 1] - hull[n - 2], p - hull[n - 1]) <= 0.0f) --n;
    hull[n++] = p;
  };
  for (const glm::vec2& p : points) add(p, 2);
  const std::size_t lower = n + 1;
  for (std::size_t i = points.size() - 1; i-- > 0;) add(points[i], lower);
  hull.resize(n - 1);
  return hull;
}

}  // namespace

void measureChart(Chart& chart, const FaceGraph& graph, float scale) {
  double uv = 0.0, surface = 0.0;
  for (std::size_t i = 0; i < chart.triangle.size(); ++i) {
    uv += std::abs(signedArea(chart.uv[i]));
    surface += static_cast<double>(graph.area[chart.triangle[i]]) * scale * scale;
  }
  chart.areaUv = static_cast<float>(uv);
  chart.areaSurface = static_cast<float>(surface);
}

Chart projectPlanar(const Mesh& mesh, const FaceGraph& graph, std::span<const std::uint32_t> faces, float scale) {
  Chart chart;
  glm::vec3 sum(0.0f);
  for (const std::uint32_t f : faces) sum += graph.normal[f] * graph.area[f];
  const float length = glm::length(sum);
  const glm::vec3 normal = length > 0.0f ? sum / length : graph.normal[faces.front()];
  const glm::vec3 helper = std::abs(normal.y) < 0.9f ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
  const glm::vec3 u = glm::normalize(glm::cross(helper, normal)), v = glm::cross(normal, u);

  // Subtract an origin first, so that precision depends on the chart's size and not on its position.
  const glm::vec3 origin = mesh.position[mesh.triangle[faces.front()].x];
  chart.triangle.assign(faces.begin(), faces.end());
  chart.uv.resize(faces.size());
  for (std::size_t i = 0; i < faces.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      const glm::vec3 p = (mesh.position[mesh.triangle[faces[i]][k]] - origin) * scale;
      chart.uv[i][static_cast<std::size_t>(k)] = {glm::dot(p, u), glm::dot(p, v)};
    }
  }
  measureChart(chart, graph, scale);
  return chart;
}

std::vector<std::uint32_t> splitOverlaps(Chart& chart) {
  constexpr int kWide = 8;  // [columns]
  if (chart.triangle.size() < 2) return {};
  glm::vec2 low, high;
  bounds(chart, low, high);
  const glm::vec2 size = glm::max(high - low, glm::vec2(1e-20f));

  // Take about sixteen samples per triangle, on a lattice of at most 256 x 256 that avoids the edges of regular meshes.
  const double samples = std::clamp(16.0 * static_cast<double>(chart.triangle.size()) * size.x * size.y /
                                        std::max(1e-30, static_cast<double>(chart.areaUv)),
                                    256.0, 65536.0);
  const double aspect = std::clamp(std::sqrt(static_cast<double>(size.x) / size.y), 1.0 / 16.0, 16.0);
  const int columns = std::clamp(static_cast<int>(std::sqrt(samples) * aspect), 8, 1024);
  const int rows = std::clamp(static_cast<int>(std::sqrt(samples) / aspect), 8, 1024);
  const glm::vec2 step = size / glm::vec2(columns, rows);
  std::vector<std::uint8_t> taken(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);

  std::vector<std::uint32_t> off, fresh;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < chart.triangle.size(); ++i) {
    const auto& t = chart.uv[i];
    const glm::vec2 from = (glm::min(t[0], glm::min(t[1], t[2])) - low) / step,
                    to = (glm::max(t[0], glm::max(t[1], t[2])) - low) / step;
    std::size_t covered = 0;
    fresh.clear();
    const int left = std::max(0, static_cast<int>(from.x) - 1), right = std::min(columns - 1, static_cast<int>(to.x));
    for (int y = std::max(0, static_cast<int>(from.y) - 1); y <= std::min(rows - 1, static_cast<int>(to.y)); ++y) {
      // Visit only the samples near the triangle in this row: the bounds of a needle across the chart are the whole
      // chart.
      int first = left, last = right;
      if (right - left > kWide) {
        const float height = low.y + static_cast<float>(y) * step.y;
        const glm::vec2 width = (widthBetween(t, height - step.y, height + 2.0f * step.y) - low.x) / step.x;
        if (width.x > width.y) continue;
        first = std::max(left, static_cast<int>(width.x) - 2);
        last = std::min(right, static_cast<int>(width.y) + 2);
      }
      for (int x = first; x <= last; ++x) {
        const glm::vec2 p = low + (glm::vec2(x, y) + glm::vec2(0.4817f, 0.5253f)) * step;
        if (insideness(t, p) <= 1e-3f) continue;
        const std::uint32_t sample = static_cast<std::uint32_t>(y * columns + x);
        if (taken[sample])
          ++covered;
        else
          fresh.push_back(sample);
      }
    }
    // Tolerate a sample or two: edges may cross by a rounding error.
    if (covered > 0 && 8 * covered > covered + fresh.size()) {
      off.push_back(chart.triangle[i]);
      continue;
    }
    for (const std::uint32_t sample : fresh) taken[sample] = 1;
    chart.triangle[kept] = chart.triangle[i];
    chart.uv[kept++] = chart.uv[i];
  }
  chart.triangle.resize(kept);
  chart.uv.resize(kept);
  return off;
}

void fitRectangle(Chart& chart) {
  std::vector<glm::vec2> points;
  points.reserve(3 * chart.uv.size());
  for (const auto& corners : chart.uv) points.insert(points.end(), corners.begin(), corners.end());
  const std::vector<glm::vec2> hull = convexHull(std::move(points));

  // The smallest rectangle has a side along an edge of the hull.
  glm::vec2 axis(1.0f, 0.0f);
  float minArea = std::numeric_limits<float>::infinity();
  // Try only every n-th edge of a hull of very many: neighbouring edges differ by less than one can see.
  constexpr std::size_t kMaxTests = 1u << 24;
  const std::size_t stride = 1 + hull.size() * hull.size() / (kMaxTests + 1);
  for (std::size_t i = 0; i < hull.size() && hull.size() >= 3; i += stride) {
    const glm::vec2 edge = hull[(i + 1) % hull.size()] - hull[i];
    const float length = glm::length(edge);
    if (!(length > 0.0f)) continue;
    const glm::vec2 d = edge / length;
    glm::vec2 low(std::numeric_limits<float>::infinity()), high = -low;
    for (const glm::vec2& p : hull) {
      const glm::vec2 q(glm::dot(p, d), cross2(d, p));
      low = glm::min(low, q);
      high = glm::max(high, q);
    }
    const glm::vec2 size = high - low;
    // Require a clear gain: at near ties the first axis stays, whatever the rounding.
    if (size.x * size.y < 0.999f * minArea) {
      minArea = size.x * size.y;
      axis = size.x >= size.y ? d : glm::vec2(-d.y, d.x);
    }
  }
  for (auto& corners : chart.uv) {
    for (glm::vec2& p : corners) p = {glm::dot(p, axis), cross2(axis, p)};
  }
  glm::vec2 low, high;
  bounds(chart, low, high);
  for (auto& corners : chart.uv) {
    for (glm::vec2& p : corners) p -= low;
  }
}

double stretchOf(const Mesh& mesh, const Chart& chart, const FaceGraph& graph, float scale) {
  double sum = 0.0, uv = 0.0, surface = 0.0;
  for (std::size_t i = 0; i < chart.triangle.size(); ++i) {
    const glm::uvec3& t = mesh.triangle[chart.triangle[i]];
    const double area = static_cast<double>(graph.area[chart.triangle[i]]) * scale * scale;
    const glm::dvec3 p = mesh.position[t.x], q = mesh.position[t.y], r = mesh.position[t.z];
    const glm::dvec2 a = chart.uv[i][0], b = chart.uv[i][1], c = chart.uv[i][2];
    const double twice = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
    if (!(twice > 1e-9 * area)) return std::numeric_limits<double>::infinity();
    // L2 stretch: mean of the squared singular values of the map's Jacobian.
    const glm::dvec3 du = (p * (b.y - c.y) + q * (c.y - a.y) + r * (a.y - b.y)) * static_cast<double>(scale) / twice;
    const glm::dvec3 dv = (p * (c.x - b.x) + q * (a.x - c.x) + r * (b.x - a.x)) * static_cast<double>(scale) / twice;
    sum += area * 0.5 * (glm::dot(du, du) + glm::dot(dv, dv));
    uv += 0.5 * twice;
    surface += area;
  }
  return surface > 0.0 ? std::sqrt(sum / surface * uv / surface) : 1.0;
}

}  // namespace relume
