// SPDX-License-Identifier: MIT
// Makes patches: the charts of the level's meshes as instances place them in the world, one for each side that is seen.
// Each patch gets a rectangle of light-map texels.
#pragma once

#include "bake/caches/caches.h"
#include "bake/caches/charts/chart_quality.h"
#include "bake/caches/charts/smooth_parts.h"

#include <cstdint>
#include <vector>

namespace relume {

// A point of a chart: a triangle of the mesh and weights of its corners 1 and 2 in the mesh's own order.
struct ChartPoint {
  std::uint32_t triangle = 0;
  glm::vec2 barycentric{0.0f};
};

struct MeshCharts {
  float scale = 1.0f;  // [m per object unit] the charts were made for
  std::vector<Chart> charts;
  std::vector<glm::vec2> size;                  // [m] [Size charts] extent of each chart in uv, from (0, 0)
  std::vector<std::vector<ChartPoint>> points;  // [Size charts] points that can stand for a whole chart, best first
  bool fromTexcoord1 = false;
  ChartQuality quality;
  MeshParts parts;
};

struct Patch {
  std::uint32_t instance = 0, chart = 0;
  std::uint32_t side = 0;      // 0 front, 1 back
  glm::vec2 uvScale{1.0f};     // world metres per chart metre along u and v
  float area = 0.0f;           // [m²] that is seen
  float density = 1.0f;        // factor on the texels per metre
  float levelDensity = 1.0f;   // of which the level and the play space ask for
  std::uint32_t part = kNone;  // of PatchSet::parts
};

struct PatchSet {
  std::vector<MeshCharts> meshes;   // [Size scene meshes] empty where no fixed instance uses the mesh
  std::vector<Patch> patches;       // by instance, then chart, then side
  double areaSeen = 0.0;            // [m²] of all patches
  std::vector<std::uint32_t> wide;  // instances, ascending: some of their charts are far larger than what is seen of
                                    // them, and read the grid
  std::vector<SmoothPart> parts;    // by instance
};

// Unwrap every mesh that a fixed instance uses, and find the sides of its charts that are seen. Surfaces that receivers
// do not see, but from which light reaches them, get kIndirectDensity of the texels. Surfaces that are seen from far
// away only get none. The emptiest charts get none either, as long as all rectangles together have more than kMaxEmpty
// times the seen area: otherwise the ground of a level of many kilometres would make texels too large everywhere.
inline constexpr double kMaxEmpty = 64.0;
inline constexpr float kIndirectDensity = 0.5f;
// Share of the seen area that lies on triangles more than kMaxEmpty times as large as all seen area.
double wideShare(const Scene& scene, const PlaySpace& playSpace);
PatchSet makePatches(const Scene& scene, const PlaySpace& playSpace, const CacheOptions& options, Context& context);

// World position and unit geometric normal (of that side) of a chart's point.
struct SurfaceSpot {
  glm::vec3 positionWorld{0.0f};
  glm::vec3 normal{0.0f};
};
SurfaceSpot spotOf(const Scene& scene, const Patch& patch, const ChartPoint& point);

// Whether the play space sees that side there.
bool seenBy(const Scene& scene, const PlaySpace& playSpace, const Patch& patch, const ChartPoint& point);

}  // namespace relume
