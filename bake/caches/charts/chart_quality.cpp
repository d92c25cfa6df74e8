// SPDX-License-Identifier: MIT
// See chart_quality.h.
#include "bake/caches/charts/chart_quality.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

constexpr double kBinsPerOctave = 16.0, kFirstOctave = -8.0;

void addTriangle(const std::array<glm::dvec3, 3>& p, const std::array<glm::vec2, 3>& uv, ChartQuality& quality) {
  const double area = 0.5 * glm::length(glm::cross(p[1] - p[0], p[2] - p[0]));
  if (!(area > 0.0)) return;
  const glm::dvec2 a = uv[0], b = uv[1], c = uv[2];
  const double twice = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
  if (!(twice > 1e-9 * area)) {
    quality.folded += area;
    return;
  }
  // The Jacobian's columns, and the singular values by its Gram matrix.
  const glm::dvec3 du = (p[0] * (b.y - c.y) + p[1] * (c.y - a.y) + p[2] * (a.y - b.y)) / twice;
  const glm::dvec3 dv = (p[0] * (c.x - b.x) + p[1] * (a.x - c.x) + p[2] * (b.x - a.x)) / twice;
  const double e = glm::dot(du, du), f = glm::dot(du, dv), g = glm::dot(dv, dv);
  const double mean = 0.5 * (e + g), off = std::sqrt(0.25 * (e - g) * (e - g) + f * f);
  const double s1 = std::sqrt(mean + off), s2 = std::sqrt(std::max(mean - off, 0.0));
  quality.surface += area;
  quality.squares += area * mean;
  quality.anisotropy += area * (s1 < kMaxAnisotropy * s2 ? s1 / s2 : kMaxAnisotropy);
  const double ratio = 2.0 * area / twice;
  quality.areaRatio += area * std::max(ratio, 1.0 / ratio);
  const double bin = (std::log2(s1) - kFirstOctave) * kBinsPerOctave;
  quality.stretch[static_cast<std::size_t>(std::clamp(bin, 0.0, 255.0))] += area;
}

}  // namespace

void ChartQuality::add(const ChartQuality& other) {
  surface += other.surface;
  squares += other.squares;
  anisotropy += other.anisotropy;
  areaRatio += other.areaRatio;
  folded += other.folded;
  for (std::size_t i = 0; i < stretch.size(); ++i) stretch[i] += other.stretch[i];
}

double ChartQuality::stretchRms() const { return surface > 0.0 ? std::sqrt(squares / surface) : 1.0; }
double ChartQuality::anisotropyMean() const { return surface > 0.0 ? anisotropy / surface : 1.0; }
double ChartQuality::areaRatioMean() const { return surface > 0.0 ? areaRatio / surface : 1.0; }

double ChartQuality::stretchP99() const {
  double below = 0.0;
  for (std::size_t i = 0; i < stretch.size(); ++i) {
    below += stretch[i];
    if (below >= 0.99 * surface) return std::exp2((static_cast<double>(i) + 0.5) / kBinsPerOctave + kFirstOctave);
  }
  return 1.0;
}

ChartQuality measureCharts(const Mesh& mesh, std::span<const Chart> charts, float scale) {
  ChartQuality quality;
  for (const Chart& chart : charts) {
    for (std::size_t i = 0; i < chart.triangle.size(); ++i) {
      const glm::uvec3& v = mesh.triangle[chart.triangle[i]];
      const double s = static_cast<double>(scale);
      addTriangle(
          {s * glm::dvec3(mesh.position[v.x]), s * glm::dvec3(mesh.position[v.y]), s * glm::dvec3(mesh.position[v.z])},
          chart.uv[i], quality);
    }
  }
  return quality;
}

}  // namespace relume
