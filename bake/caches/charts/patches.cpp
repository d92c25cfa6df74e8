// SPDX-License-Identifier: MIT
// See patches.h.
#include "bake/caches/charts/patches.h"

#include "bake/base/parallel.h"
#include "bake/caches/charts/texcoord_charts.h"
#include "bake/caches/charts/triangle_area.h"
#include "bake/visibility/surface_parts.h"

#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace relume {
namespace {

float typicalScale(const glm::mat4& toWorld) {
  const double volume = std::abs(static_cast<double>(glm::determinant(glm::dmat3(glm::mat3(toWorld)))));
  const float scale = static_cast<float>(std::cbrt(volume));
  return scale > 0.0f && std::isfinite(scale) ? scale : 1.0f;
}

// Points that can stand for a whole chart: the one nearest to its centroid, then the middles of its largest triangles.
std::vector<ChartPoint> representativePoints(const Chart& chart) {
  constexpr std::size_t kMaxKept = 8;
  glm::dvec2 center(0.0);
  double total = 0.0;
  std::vector<float> area(chart.triangle.size());
  for (std::size_t i = 0; i < chart.triangle.size(); ++i) {
    const auto& t = chart.uv[i];
    area[i] = 0.5f * std::abs(cross2(t[1] - t[0], t[2] - t[0]));
    center += glm::dvec2(t[0] + t[1] + t[2]) / 3.0 * static_cast<double>(area[i]);
    total += area[i];
  }
  const glm::vec2 middle = total > 0.0 ? glm::vec2(center / total) : chart.uv[0][0];

  std::vector<ChartPoint> points;
  std::size_t nearest = 0;
  float minDistance2 = INFINITY;
  for (std::size_t i = 0; i < chart.triangle.size(); ++i) {
    const auto& t = chart.uv[i];
    const float twice = cross2(t[1] - t[0], t[2] - t[0]);
    if (twice != 0.0f) {
      const float b = cross2(middle - t[0], t[2] - t[0]) / twice, c = cross2(t[1] - t[0], middle - t[0]) / twice;
      if (std::min({b, c, 1.0f - b - c}) >= 0.0f) {
        points.push_back({chart.triangle[i], {b, c}});
        break;
      }
    }
    const glm::vec2 away = (t[0] + t[1] + t[2]) / 3.0f - middle;
    if (glm::dot(away, away) < minDistance2) {
      minDistance2 = glm::dot(away, away);
      nearest = i;
    }
  }
  constexpr glm::vec2 kMiddle(1.0f / 3.0f);
  if (points.empty()) points.push_back({chart.triangle[nearest], kMiddle});

  std::vector<std::uint32_t> order(chart.triangle.size());
  std::iota(order.begin(), order.end(), 0u);
  const std::size_t kept = std::min(kMaxKept - 1, order.size());
  std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(kept), order.end(),
                    [&](std::uint32_t a, std::uint32_t b) { return area[a] != area[b] ? area[a] > area[b] : a < b; });
  for (std::size_t i = 0; i < kept; ++i) points.push_back({chart.triangle[order[i]], kMiddle});
  return points;
}

// The charts of a mesh, and what placing caches on them needs.
MeshCharts makeMeshCharts(const Mesh& mesh, float scale, bool useTexcoord1, Context& context) {
  MeshCharts result;
  result.scale = scale;
  if (useTexcoord1) result.charts = chartsFromTexcoord1(mesh, scale);
  result.fromTexcoord1 = !result.charts.empty();
  if (result.charts.empty()) result.charts = unwrapMesh(mesh, scale, context);
  if (context.cancelled()) return {};
  result.quality = measureCharts(mesh, result.charts, scale);
  result.parts = findSmoothParts(mesh);
  for (const Chart& chart : result.charts) {
    glm::vec2 size(0.0f);
    for (const auto& t : chart.uv) size = glm::max(size, glm::max(t[0], glm::max(t[1], t[2])));
    result.size.push_back(size);
    result.points.push_back(representativePoints(chart));
  }
  return result;
}

// World metres per chart metre along u and v: one factor for an instance with uniform scale, otherwise the root mean
// square over the chart of how the map uv -> world stretches each axis.
glm::vec2 uvScaleOf(const Scene& scene, const Instance& instance, const MeshCharts& charts, const Chart& chart) {
  const glm::mat3 linear(instance.toWorld);
  const glm::mat3 gram = glm::transpose(linear) * linear;
  const float mean = (gram[0][0] + gram[1][1] + gram[2][2]) / 3.0f;
  const float off = std::max({std::abs(gram[0][1]), std::abs(gram[0][2]), std::abs(gram[1][2]),
                              std::abs(gram[0][0] - mean), std::abs(gram[1][1] - mean), std::abs(gram[2][2] - mean)});
  if (off <= 1e-3f * mean) return glm::vec2(std::sqrt(mean) / charts.scale);

  const Mesh& mesh = scene.meshes[instance.mesh];
  glm::dvec2 squares(0.0);
  double total = 0.0;
  for (std::size_t i = 0; i < chart.triangle.size(); ++i) {
    const auto& uv = chart.uv[i];
    const glm::uvec3& v = mesh.triangle[chart.triangle[i]];
    const glm::vec2 e = uv[1] - uv[0], f = uv[2] - uv[0];
    const float twice = cross2(e, f);
    if (!(std::abs(twice) > 0.0f)) continue;
    const glm::vec3 p = linear * (mesh.position[v.y] - mesh.position[v.x]),
                    q = linear * (mesh.position[v.z] - mesh.position[v.x]);
    const glm::vec3 du = (p * f.y - q * e.y) / twice, dv = (q * e.x - p * f.x) / twice;
    squares += glm::dvec2(glm::dot(du, du), glm::dot(dv, dv)) * static_cast<double>(std::abs(twice));
    total += std::abs(twice);
  }
  return total > 0.0 ? glm::vec2(glm::sqrt(squares / total)) : glm::vec2(1.0f);
}

// The smooth part that the largest face of a chart belongs to.
std::uint32_t partOf(const MeshCharts& charts, const Chart& chart, std::size_t largest) {
  return charts.parts.partOf.empty() ? kNone : charts.parts.partOf[chart.triangle[largest]];
}

std::size_t largestFace(const Chart& chart) {
  const auto area = [&](std::size_t i) {
    const auto& t = chart.uv[i];
    return std::abs(cross2(t[1] - t[0], t[2] - t[0]));
  };
  std::size_t largest = 0;
  for (std::size_t i = 1; i < chart.uv.size(); ++i) {
    if (area(i) > area(largest)) largest = i;
  }
  return largest;
}

void addPatches(const Scene& scene, const PlaySpace& playSpace, std::uint32_t index, PatchSet& set) {
  const Instance& instance = scene.instances[index];
  const MeshCharts& charts = set.meshes[instance.mesh];
  std::vector<std::uint32_t> indexOfPart(charts.parts.curvature.size(), kNone);  // of PatchSet::parts
  const float objectScale = typicalScale(instance.toWorld);
  for (std::uint32_t c = 0; c < charts.charts.size(); ++c) {
    const Chart& chart = charts.charts[c];
    glm::vec2 uvScale(0.0f);
    for (std::uint32_t side = 0; side < 2; ++side) {
      double area = 0.0;
      bool visible = false;
      for (const std::uint32_t t : chart.triangle) {
        const std::uint32_t s = 2 * (instance.firstTriangle + t) + side;
        if (playSpace.isFar(s)) continue;
        area += playSpace.seenArea[s];
        visible = visible || playSpace.isVisible(s);
      }
      if (!(area > 0.0)) continue;
      if (uvScale == glm::vec2(0.0f)) uvScale = uvScaleOf(scene, instance, charts, chart);
      if (!std::isfinite(uvScale.x) || !std::isfinite(uvScale.y)) continue;
      const float density = instance.texelDensity * (visible ? 1.0f : kIndirectDensity);
      std::uint32_t part = visible ? partOf(charts, chart, largestFace(chart)) : kNone;
      if (part != kNone) {
        if (indexOfPart[part] == kNone) {
          indexOfPart[part] = static_cast<std::uint32_t>(set.parts.size());
          set.parts.push_back({index, 0.0f, charts.parts.curvature[part] / objectScale, density});
        }
        part = indexOfPart[part];
        set.parts[part].area += static_cast<float>(area);
      }
      set.patches.push_back({index, c, side, uvScale, static_cast<float>(area), density, density, part});
      set.areaSeen += area;
    }
  }
}

glm::vec2 worldOrder(const Instance& instance, const glm::vec2& barycentric) {
  return instance.flipped ? glm::vec2(barycentric.y, barycentric.x) : barycentric;
}

// Drop the emptiest patches (kMaxEmpty).
void dropWidePatches(PatchSet& set, const Scene& scene) {
  struct Emptiness {
    double emptiness, rectangle;  // rectangle per seen area; [m²] at the density of the texels
    std::uint32_t patch;
  };
  std::vector<Emptiness> order;
  double all = 0.0, seen = 0.0;
  for (std::uint32_t p = 0; p < set.patches.size(); ++p) {
    const Patch& patch = set.patches[p];
    const glm::dvec2 size(set.meshes[scene.instances[patch.instance].mesh].size[patch.chart] * patch.uvScale);
    const double perArea = static_cast<double>(patch.density) * static_cast<double>(patch.density);
    const double rectangle = size.x * size.y * perArea;
    order.push_back({rectangle / (static_cast<double>(patch.area) * perArea), rectangle, p});
    all += rectangle;
    seen += static_cast<double>(patch.area) * perArea;
  }
  if (!(all > kMaxEmpty * seen)) return;
  std::sort(order.begin(), order.end(), [](const Emptiness& a, const Emptiness& b) {
    return a.emptiness != b.emptiness ? a.emptiness > b.emptiness : a.patch < b.patch;
  });
  std::vector<std::uint8_t> gone(set.patches.size(), 0);
  for (const Emptiness& each : order) {
    if (!(all > kMaxEmpty * seen)) break;
    all -= each.rectangle;
    gone[each.patch] = 1;
    set.wide.push_back(set.patches[each.patch].instance);
  }
  std::sort(set.wide.begin(), set.wide.end());
  set.wide.erase(std::unique(set.wide.begin(), set.wide.end()), set.wide.end());
  std::size_t kept = 0;
  for (std::size_t p = 0; p < gone.size(); ++p) {
    if (!gone[p]) set.patches[kept++] = set.patches[p];
  }
  set.patches.resize(kept);
  set.areaSeen = 0.0;
  for (const Patch& patch : set.patches) set.areaSeen += patch.area;
}

}  // namespace

double wideShare(const Scene& scene, const PlaySpace& playSpace) {
  double wide = 0.0;
  InstanceFinder instances(scene);
  for (std::uint32_t side = 0; side < playSpace.flags.size(); ++side) {
    if (!playSpace.isPartly(side) || playSpace.isFar(side)) continue;
    const Instance& instance = scene.instances[instances.of(side / 2)];
    const auto c = scene.corners(instance, side / 2 - instance.firstTriangle);
    const double parallelogram = glm::length(glm::cross(glm::dvec3(c[1] - c[0]), glm::dvec3(c[2] - c[0])));
    if (parallelogram > kMaxEmpty * playSpace.seenTotal) wide += playSpace.seenArea[side];
  }
  return playSpace.seenTotal > 0.0 ? wide / playSpace.seenTotal : 0.0;
}

PatchSet makePatches(const Scene& scene, const PlaySpace& playSpace, const CacheOptions& options, Context& context) {
  PatchSet set;
  set.meshes.resize(scene.meshes.size());
  std::vector<float> scale(scene.meshes.size(), 0.0f);
  for (const Instance& instance : scene.instances) {
    if (instance.charted() && scale[instance.mesh] == 0.0f) scale[instance.mesh] = typicalScale(instance.toWorld);
  }
  parallelChunks(context, "unwrap", scene.meshes.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t m = begin; m < end; ++m) {
      if (scale[m] > 0.0f) set.meshes[m] = makeMeshCharts(scene.meshes[m], scale[m], options.useTexcoord1, context);
    }
  });
  for (std::uint32_t i = 0; i < scene.instances.size() && !context.cancelled(); ++i) {
    if (scene.instances[i].charted()) addPatches(scene, playSpace, i, set);
  }
  dropWidePatches(set, scene);
  return set;
}

SurfaceSpot spotOf(const Scene& scene, const Patch& patch, const ChartPoint& point) {
  const Instance& instance = scene.instances[patch.instance];
  const Mesh& mesh = scene.meshes[instance.mesh];
  const glm::uvec3& v = mesh.triangle[point.triangle];
  const float a = 1.0f - point.barycentric.x - point.barycentric.y;
  const glm::vec3 local =
      a * mesh.position[v.x] + point.barycentric.x * mesh.position[v.y] + point.barycentric.y * mesh.position[v.z];
  const glm::vec3 front =
      geometricNormal(scene, {patch.instance, point.triangle, worldOrder(instance, point.barycentric)});
  return {glm::vec3(instance.toWorld * glm::vec4(local, 1.0f)), patch.side == 0 ? front : -front};
}

bool seenBy(const Scene& scene, const PlaySpace& playSpace, const Patch& patch, const ChartPoint& point) {
  const Instance& instance = scene.instances[patch.instance];
  return playSpace.seenAt(2 * (instance.firstTriangle + point.triangle) + patch.side,
                          worldOrder(instance, point.barycentric));
}

}  // namespace relume
