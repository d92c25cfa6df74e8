// SPDX-License-Identifier: MIT
// Cuts a mesh into charts and flattens them. Charts are regions of similar normals, projected along their mean normal,
// or mapped conformally if they are curved. If the level has its own light-map coordinates, charts are the islands of
// TEXCOORD_1. Light-map texels are large compared with most triangles, so few and large charts matter more than low
// stretch.
#include "bake/caches/charts/flatten.h"
#include "bake/caches/charts/lscm.h"
#include "bake/caches/charts/segment.h"

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

// A projection that loses a smaller share of area than this is good enough.
constexpr float kFlatEnough = 0.92f;
// Curved charts with less than this share of the mesh's area stay projected: their stretch is not visible.
constexpr double kCurvedAreaShare = 1e-4;
constexpr std::size_t kMinCurvedFaces = 6;
// With more faces, the sparse solve would take seconds.
constexpr std::size_t kMaxCurvedFaces = 50000;

// Replace the projection by a conformal map if that stretches less and neither folds nor overlaps.
void improveCurved(const Mesh& mesh, const FaceGraph& graph, float scale, Chart& chart) {
  std::optional<Chart> conformal = mapConformal(mesh, graph, chart.triangle, scale);
  if (!conformal) return;
  const double stretch = stretchOf(mesh, *conformal, graph, scale);
  if (!(stretch < stretchOf(mesh, chart, graph, scale))) return;
  if (!splitOverlaps(*conformal).empty()) return;
  chart = std::move(*conformal);
}

// Split off the faces of a region that overlap others, again and again, until nothing overlaps. Returns the pieces.
void flattenRegion(const Mesh& mesh, const FaceGraph& graph, std::span<const std::uint32_t> faces, float scale,
                   std::vector<Chart>& charts, const Context& context) {
  constexpr int kMaxRounds = 32;
  std::vector<std::vector<std::uint32_t>> pending{std::vector<std::uint32_t>(faces.begin(), faces.end())};
  for (int round = 0; !pending.empty(); ++round) {
    std::vector<std::vector<std::uint32_t>> next;
    for (const auto& piece : pending) {
      if (context.cancelled()) return;
      // A pile of coincident faces would take one round per face. After the limit, every face becomes a piece of its
      // own.
      if (round >= kMaxRounds) {
        for (const std::uint32_t face : piece) charts.push_back(projectPlanar(mesh, graph, std::span(&face, 1), scale));
        continue;
      }
      Chart chart = projectPlanar(mesh, graph, piece, scale);
      const std::vector<std::uint32_t> off = splitOverlaps(chart);
      if (!off.empty()) {
        for (auto& rest : connectedPieces(graph, off)) next.push_back(std::move(rest));
        // What is left may no longer be connected.
        for (const auto& rest : connectedPieces(graph, chart.triangle)) {
          charts.push_back(projectPlanar(mesh, graph, rest, scale));
        }
      } else {
        charts.push_back(std::move(chart));
      }
    }
    pending = std::move(next);
  }
}

}  // namespace

std::vector<Chart> unwrapMesh(const Mesh& mesh, float scale, Context& context) {
  std::vector<Chart> charts;
  if (context.cancelled()) return charts;
  const FaceGraph graph = buildFaceGraph(mesh);
  for (const auto& region : growRegions(graph, RegionLimits{}, context)) {
    if (context.cancelled()) return charts;
    flattenRegion(mesh, graph, region, scale, charts, context);
  }

  double total = 0.0;
  for (const Chart& chart : charts) total += chart.areaSurface;
  for (Chart& chart : charts) {
    if (context.cancelled()) return charts;
    const bool curved = chart.areaUv < kFlatEnough * chart.areaSurface && chart.areaSurface > kCurvedAreaShare * total;
    if (curved && chart.triangle.size() >= kMinCurvedFaces && chart.triangle.size() <= kMaxCurvedFaces) {
      improveCurved(mesh, graph, scale, chart);
    }
    fitRectangle(chart);
  }
  return charts;
}

}  // namespace relume
