// SPDX-License-Identifier: MIT
// See texcoord_charts.h.
#include "bake/caches/charts/texcoord_charts.h"

#include "bake/caches/charts/flatten.h"
#include "bake/caches/charts/segment.h"
#include "bake/caches/charts/triangle_area.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

std::array<glm::vec2, 3> cornersOf(const Mesh& mesh, std::uint32_t face) {
  const glm::uvec3& t = mesh.triangle[face];
  return {mesh.uv[1][t.x], mesh.uv[1][t.y], mesh.uv[1][t.z]};
}

// The mesh laid flat by its uv: faces are neighbours when they share an edge there. Mirrored islands are turned over
// when they become charts; an island never has both orientations.
FaceGraph graphInUv(const Mesh& mesh, const FaceGraph& graph) {
  Mesh flat;
  flat.triangle = mesh.triangle;
  flat.position.reserve(mesh.position.size());
  for (const glm::vec2& uv : mesh.uv[1]) flat.position.emplace_back(uv, 0.0f);
  FaceGraph result = buildFaceGraph(flat);
  for (std::size_t f = 0; f < graph.area.size(); ++f) {
    if (!graph.degenerate(static_cast<std::uint32_t>(f)) && result.area[f] > 0.0f) continue;
    result.area[f] = 0.0f;
  }
  return result;
}

}  // namespace

std::vector<Chart> chartsFromTexcoord1(const Mesh& mesh, float scale) {
  const std::vector<glm::vec2>& uv = mesh.uv[1];
  if (uv.size() != mesh.position.size() || uv.empty() || mesh.triangle.empty()) return {};
  constexpr float kSlack = 1e-3f;
  for (const glm::vec2& p : uv) {
    if (!(p.x >= -kSlack && p.y >= -kSlack && p.x <= 1.0f + kSlack && p.y <= 1.0f + kSlack)) return {};
  }

  // Refuse maps that leave out a visible part of the surface.
  const FaceGraph graph = buildFaceGraph(mesh);
  const FaceGraph flat = graphInUv(mesh, graph);
  double surface = 0.0, unmapped = 0.0;
  std::vector<std::uint32_t> faces;
  for (std::uint32_t f = 0; f < mesh.triangle.size(); ++f) {
    if (graph.degenerate(f)) continue;
    surface += graph.area[f];
    if (flat.degenerate(f))
      unmapped += graph.area[f];
    else
      faces.push_back(f);
  }
  if (faces.empty() || unmapped > 1e-4 * surface) return {};

  // Refuse overlaps, between islands or within one.
  Chart whole;
  whole.triangle = faces;
  double total = 0.0;
  for (const std::uint32_t f : faces) {
    whole.uv.push_back(cornersOf(mesh, f));
    total += std::abs(signedArea(whole.uv.back()));
  }
  whole.areaUv = static_cast<float>(total);
  const std::vector<std::uint32_t> off = splitOverlaps(whole);
  double overlapping = 0.0;
  for (const std::uint32_t f : off) overlapping += std::abs(signedArea(cornersOf(mesh, f)));
  if (overlapping > 0.002 * total) return {};

  std::vector<Chart> charts;
  for (const auto& island : connectedPieces(flat, faces)) {
    Chart chart;
    chart.triangle = island;
    for (const std::uint32_t f : island) chart.uv.push_back(cornersOf(mesh, f));
    measureChart(chart, graph, scale);
    const float grow = std::sqrt(chart.areaSurface / chart.areaUv);
    for (auto& t : chart.uv) {
      for (glm::vec2& p : t) p *= grow;
    }
    chart.areaUv = chart.areaSurface;
    fitRectangle(chart);
    charts.push_back(std::move(chart));
  }
  return charts;
}

}  // namespace relume
