// SPDX-License-Identifier: MIT
// See smooth_parts.h.
#include "bake/caches/charts/smooth_parts.h"

#include "bake/caches/charts/patches.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace relume {
namespace {

// Two faces whose normals at a common corner differ by more than about a degree meet in a crease.
constexpr float kSameNormal = 0.9998f;
// A part with fewer texels is too small to be looked at; one with more has enough texels to show its form.
constexpr double kMinTexels = 0.5, kMaxTexels = 3000.0;
// Largest factors on a part's density: with up to kSmallTexels, and with more. A bust would spend the budget alone.
constexpr double kMaxFactor = 16.0, kMaxFactorOfLarge = 2.0, kSmallTexels = 300.0;
// Share of all texels that smooth parts may get in addition to their own.
constexpr double kBudget = 0.1;
// If normals would still turn more than this with the whole budget, texels would show all the same: the budget is not
// spent.
constexpr double kUsefulTurn = 0.6;

// Whether the mesh's normals agree along the edge of two faces.
bool isSmooth(const Mesh& mesh, const FaceGraph& graph, std::uint32_t f, std::uint32_t g) {
  int agreeing = 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      if (graph.vertex[f][i] != graph.vertex[g][j]) continue;
      if (glm::dot(mesh.normal[mesh.triangle[f][i]], mesh.normal[mesh.triangle[g][j]]) < kSameNormal) return false;
      ++agreeing;
    }
  }
  return agreeing == 2;
}

double texelsOf(const SmoothPart& part, double texelSize) {
  const double texel = texelSize / static_cast<double>(part.density);
  return static_cast<double>(part.area) / (texel * texel);
}

// Factor on a part's density so that it turns no more than `turn` from texel to texel, as far as it may.
double factorFor(const SmoothPart& part, double texelSize, double turn) {
  if (!isFollowed(part, static_cast<float>(texelSize))) return 1.0;
  const double texel = texelSize / static_cast<double>(part.density);
  return std::clamp(static_cast<double>(part.curvature) * texel / turn, 1.0,
                    texelsOf(part, texelSize) > kSmallTexels ? kMaxFactorOfLarge : kMaxFactor);
}

// Texels that the parts need in addition to their own for that.
double extraTexels(const std::vector<SmoothPart>& parts, double texelSize, double turn) {
  double extra = 0.0;
  for (const SmoothPart& part : parts) {
    const double factor = factorFor(part, texelSize, turn);
    extra += texelsOf(part, texelSize) * (factor * factor - 1.0);
  }
  return extra;
}

}  // namespace

bool isFollowed(const SmoothPart& part, float texelSize) {
  const double texels = texelsOf(part, static_cast<double>(texelSize));
  return texels >= kMinTexels && texels <= kMaxTexels;
}

MeshParts findSmoothParts(const Mesh& mesh) {
  MeshParts parts;
  if (mesh.normal.size() != mesh.position.size() || mesh.triangle.empty()) return parts;
  const FaceGraph graph = buildFaceGraph(mesh);
  std::vector<std::uint32_t> up(mesh.triangle.size());
  std::iota(up.begin(), up.end(), 0u);
  const auto root = [&](std::uint32_t f) {
    while (up[f] != f) f = up[f] = up[up[f]];
    return f;
  };
  std::vector<double> turning(up.size(), 0.0), area(up.size(), 0.0);
  for (std::uint32_t f = 0; f < up.size(); ++f) {
    for (std::uint32_t i = graph.begin[f]; i < graph.begin[f + 1]; ++i) {
      const std::uint32_t g = graph.neighbor[i];
      if (g < f || !isSmooth(mesh, graph, f, g)) continue;
      const float cosine = std::clamp(glm::dot(graph.normal[f], graph.normal[g]), -1.0f, 1.0f);
      turning[f] += static_cast<double>(std::acos(cosine) * graph.edgeLength[i]);
      const std::uint32_t a = root(f), b = root(g);
      up[std::max(a, b)] = std::min(a, b);
    }
  }
  std::vector<double> sum(up.size(), 0.0);
  for (std::uint32_t f = 0; f < up.size(); ++f) {
    area[root(f)] += static_cast<double>(graph.area[f]);
    sum[root(f)] += turning[f];
  }
  // Number the parts that are curved: a flat one turns by rounding errors only.
  std::vector<std::uint32_t> number(up.size(), kNone);
  for (std::uint32_t f = 0; f < up.size(); ++f) {
    if (root(f) != f || !(area[f] > 0.0) || !(sum[f] > 1e-2 * std::sqrt(area[f]))) continue;
    number[f] = static_cast<std::uint32_t>(parts.curvature.size());
    parts.curvature.push_back(static_cast<float>(sum[f] / area[f]));
  }
  if (parts.curvature.empty()) return parts;
  parts.partOf.resize(up.size());
  for (std::uint32_t f = 0; f < up.size(); ++f) parts.partOf[f] = number[root(f)];
  return parts;
}

void followCurvature(PatchSet& set, float texelSize) {
  if (set.parts.empty()) return;
  const double texel = static_cast<double>(texelSize);
  double texels = 0.0;
  for (const Patch& patch : set.patches) {
    const double density = static_cast<double>(patch.levelDensity);
    texels += static_cast<double>(patch.area) * density * density / (texel * texel);
  }
  // Find the smallest turn that the budget allows, if that is small enough to be of use.
  double low = static_cast<double>(kMaxTurn), high = kUsefulTurn;
  const bool useful = extraTexels(set.parts, texel, high) <= kBudget * texels;
  if (useful && extraTexels(set.parts, texel, low) <= kBudget * texels) high = low;
  for (int i = 0; useful && high > low && i < 20; ++i) {
    const double middle = 0.5 * (low + high);
    (extraTexels(set.parts, texel, middle) > kBudget * texels ? low : high) = middle;
  }
  for (SmoothPart& part : set.parts) {
    part.factor = useful ? static_cast<float>(factorFor(part, texel, high)) : 1.0f;
  }
  for (Patch& patch : set.patches) {
    if (patch.part != kNone) patch.density = patch.levelDensity * set.parts[patch.part].factor;
  }
}

}  // namespace relume
