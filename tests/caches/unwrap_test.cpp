// SPDX-License-Identifier: MIT
// Charts: whole, flat enough, free of overlaps, on any input.
#include "bake/caches/caches.h"
#include "bake/caches/charts/flatten.h"
#include "bake/caches/charts/patches.h"
#include "bake/caches/charts/texcoord_charts.h"
#include "tests/caches/big_level.h"
#include "tests/caches/meshes.h"
#include "tests/long_tests.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <string>

namespace relume {
namespace {

// A square seen at 60 degrees from its chart's plane: one axis keeps its length, the other is halved.
TEST(ChartQuality, KnowsStretchAngleAndArea) {
  Mesh mesh;
  test::addQuad(mesh, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  Chart chart;
  chart.triangle = {0, 1};
  chart.uv = {{glm::vec2(0, 0), glm::vec2(1, 0), glm::vec2(1, 0.5f)},
              {glm::vec2(0, 0), glm::vec2(1, 0.5f), glm::vec2(0, 0.5f)}};
  ChartQuality q = measureCharts(mesh, std::span(&chart, 1), 1.0f);
  EXPECT_NEAR(q.surface, 1.0, 1e-6);
  EXPECT_NEAR(q.stretchRms(), std::sqrt(2.5), 1e-6);
  EXPECT_NEAR(q.stretchP99(), 2.0, 0.1);
  EXPECT_NEAR(q.anisotropyMean(), 2.0, 1e-6);
  EXPECT_NEAR(q.areaRatioMean(), 2.0, 1e-6);
  EXPECT_EQ(q.folded, 0.0);
  // Turned over, it stretches nothing: it is of no use.
  std::swap(chart.uv[0][1], chart.uv[0][2]);
  q = measureCharts(mesh, std::span(&chart, 1), 1.0f);
  EXPECT_NEAR(q.folded, 0.5, 1e-6);
  EXPECT_NEAR(q.surface, 0.5, 1e-6);
}

// Terrain of a million triangles and 400 pillars of one mesh: whole charts, little stretch, and light-map places for
// all.
TEST(BigLevel, AMillionTrianglesAreUnwrapped) {
  const bool whole = test::longTests();
  const std::uint32_t side = whole ? 708 : 120;
  const Mesh mesh = test::displacedTerrain(side);
  Context context;
  const std::vector<Chart> charts = unwrapMesh(mesh, 1.0f, context);
  std::vector<std::uint8_t> found(mesh.triangle.size(), 0);
  for (const Chart& chart : charts) {
    for (const std::uint32_t t : chart.triangle) ++found[t];
  }
  EXPECT_EQ(std::count(found.begin(), found.end(), 1), static_cast<std::ptrdiff_t>(mesh.triangle.size()));
  const ChartQuality q = measureCharts(mesh, charts, 1.0f);
  EXPECT_LT(q.folded, 1e-3 * q.surface);
  EXPECT_LT(q.stretchRms(), 1.35);
  EXPECT_LT(q.anisotropyMean(), 1.35);

  const Scene scene = test::bigLevel(side, whole ? 20 : 4);
  PlaySpace all;
  all.seenArea = std::vector<float>(2 * scene.triangleCount(), 1.0f);
  all.flags = std::vector<std::uint8_t>(2 * scene.triangleCount(), PlaySpace::kVisible);
  const PatchSet set = makePatches(scene, all, CacheOptions{}, context);
  std::set<std::uint32_t> instances;
  for (const Patch& patch : set.patches) instances.insert(patch.instance);
  EXPECT_EQ(instances.size(), scene.instances.size()) << "each pillar has places of its own";
  const std::uint32_t pillar = scene.instances[1].mesh;
  EXPECT_EQ(set.meshes.size(), 2u) << "one unwrap for all of them";
  EXPECT_LE(set.meshes[pillar].charts.size(), 6u);
}

using test::addBox;
using test::addQuad;
using test::addTriangle;

float cross2(const glm::vec2& a, const glm::vec2& b) { return a.x * b.y - a.y * b.x; }

bool contains(const std::array<glm::vec2, 3>& t, const glm::vec2& p) {
  const float area = cross2(t[1] - t[0], t[2] - t[0]);
  if (area == 0.0f) return false;
  const float b = cross2(p - t[0], t[2] - t[0]) / area, c = cross2(t[1] - t[0], p - t[0]) / area;
  return std::min({b, c, 1.0f - b - c}) > 1e-3f;
}

// Share of random points of the chart's triangles that lie inside a second triangle, too.
double overlapOf(const Chart& chart) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  int twice = 0, total = 0;
  for (std::size_t i = 0; i < chart.uv.size(); ++i) {
    for (int k = 0; k < 4; ++k, ++total) {
      float b = uniform(random), c = uniform(random);
      if (b + c > 1.0f) b = 1.0f - b, c = 1.0f - c;
      const glm::vec2 p = chart.uv[i][0] * (1.0f - b - c) + chart.uv[i][1] * b + chart.uv[i][2] * c;
      for (std::size_t j = 0; j < chart.uv.size(); ++j) {
        if (j != i && contains(chart.uv[j], p)) {
          ++twice;
          break;
        }
      }
    }
  }
  return total ? static_cast<double>(twice) / total : 0.0;
}

void expectEachTriangleOnce(const std::vector<Chart>& charts, std::size_t triangles,
                            const std::set<std::uint32_t>& none = {}) {
  std::vector<int> seen(triangles, 0);
  for (const Chart& chart : charts) {
    ASSERT_EQ(chart.triangle.size(), chart.uv.size());
    for (const std::uint32_t t : chart.triangle) ++seen[t];
  }
  for (std::uint32_t t = 0; t < triangles; ++t) EXPECT_EQ(seen[t], none.count(t) ? 0 : 1) << "triangle " << t;
}

glm::vec2 sizeOf(const Chart& chart) {
  glm::vec2 size(0.0f);
  for (const auto& t : chart.uv) size = glm::max(size, glm::max(t[0], glm::max(t[1], t[2])));
  return size;
}

TEST(Unwrap, SquareIsOneChartOfItsOwnSize) {
  Mesh mesh;
  // Turned about, so that the rectangle has to be found.
  const glm::vec3 u = glm::normalize(glm::vec3(1, 2, 3)), v = glm::normalize(glm::cross(u, glm::vec3(0, 1, 0)));
  addQuad(mesh, glm::vec3(5), glm::vec3(5) + 3.0f * u, glm::vec3(5) + 3.0f * u + v, glm::vec3(5) + v);
  Context context;
  const auto charts = unwrapMesh(mesh, 2.0f, context);
  ASSERT_EQ(charts.size(), 1u);
  EXPECT_NEAR(charts[0].areaUv, 12.0f, 1e-4);
  EXPECT_NEAR(charts[0].areaSurface, 12.0f, 1e-4);
  EXPECT_NEAR(sizeOf(charts[0]).x, 6.0f, 1e-4);
  EXPECT_NEAR(sizeOf(charts[0]).y, 2.0f, 1e-4);
}

TEST(Unwrap, CubeHasSixSquareCharts) {
  Mesh mesh;
  addBox(mesh, glm::vec3(-1), glm::vec3(1), false);
  Context context;
  const auto charts = unwrapMesh(mesh, 1.0f, context);
  ASSERT_EQ(charts.size(), 6u);
  expectEachTriangleOnce(charts, 12);
  for (const Chart& chart : charts) {
    EXPECT_EQ(chart.triangle.size(), 2u);
    EXPECT_NEAR(chart.areaUv, 4.0f, 1e-5);
    EXPECT_NEAR(sizeOf(chart).x, 2.0f, 1e-5);
  }
}

TEST(Unwrap, SphereStretchesLittleAndNeverOverlaps) {
  const Mesh mesh = test::sphere(2.0f, 32, 64);
  Context context;
  const auto charts = unwrapMesh(mesh, 1.0f, context);
  expectEachTriangleOnce(charts, mesh.triangle.size());
  EXPECT_LE(charts.size(), 24u);
  double uv = 0.0, surface = 0.0;
  for (const Chart& chart : charts) {
    uv += chart.areaUv;
    surface += chart.areaSurface;
    EXPECT_LT(overlapOf(chart), 0.005);
    for (std::size_t i = 0; i < chart.uv.size(); ++i) {
      const glm::uvec3& t = mesh.triangle[chart.triangle[i]];
      const float area3 = 0.5f * glm::length(glm::cross(mesh.position[t.y] - mesh.position[t.x],
                                                        mesh.position[t.z] - mesh.position[t.x]));
      const float area2 = 0.5f * cross2(chart.uv[i][1] - chart.uv[i][0], chart.uv[i][2] - chart.uv[i][0]);
      EXPECT_GT(area2 / area3, 0.35f);
      EXPECT_LT(area2 / area3, 2.5f);
    }
  }
  EXPECT_GT(uv / surface, 0.85);
  EXPECT_LT(uv / surface, 1.02);
}

TEST(Unwrap, RoundColumnIsMappedWithoutLosingArea) {
  // A projection of 120 degrees of a cylinder keeps 83 % of its area; a conformal map all of it.
  Mesh mesh;
  constexpr int kSides = 48;
  const auto at = [](int i, float y) {
    const float a = 2.0f * std::numbers::pi_v<float> * static_cast<float>(i % kSides) / kSides;
    return glm::vec3(std::cos(a), y, -std::sin(a));
  };
  for (int i = 0; i < kSides; ++i) {
    for (int y = 0; y < 4; ++y)
      addQuad(mesh, at(i, static_cast<float>(y)), at(i + 1, static_cast<float>(y)),
              at(i + 1, static_cast<float>(y + 1)), at(i, static_cast<float>(y + 1)));
  }
  Context context;
  double uv = 0.0, surface = 0.0;
  for (const Chart& chart : unwrapMesh(mesh, 1.0f, context)) {
    uv += chart.areaUv;
    surface += chart.areaSurface;
    EXPECT_LT(overlapOf(chart), 0.005);
  }
  EXPECT_GT(uv / surface, 0.9);
}

TEST(Unwrap, EdgesOfManyFacesAndFlippedNeighboursAreNoObstacle) {
  Mesh mesh;
  const glm::vec3 a(0, 0, 0), b(0, 1, 0);
  for (int i = 0; i < 12; ++i) {
    const float angle = 0.5f * static_cast<float>(i);
    const glm::vec3 c(std::cos(angle), 0.5f, std::sin(angle));
    if (i % 3 == 0)
      addTriangle(mesh, b, a, c);
    else
      addTriangle(mesh, a, b, c);
  }
  Context context;
  const auto charts = unwrapMesh(mesh, 1.0f, context);
  expectEachTriangleOnce(charts, mesh.triangle.size());
  for (const Chart& chart : charts) EXPECT_LT(overlapOf(chart), 0.01);
}

TEST(Unwrap, TrianglesWithoutAreaAreInNoChart) {
  Mesh mesh;
  addQuad(mesh, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  addTriangle(mesh, {0, 0, 0}, {0, 0, 0}, {1, 0, 0});
  addTriangle(mesh, {0, 0, 0}, {1, 0, 0}, {2, 0, 0});
  Context context;
  expectEachTriangleOnce(unwrapMesh(mesh, 1.0f, context), 4, {2, 3});

  Mesh empty;
  EXPECT_TRUE(unwrapMesh(empty, 1.0f, context).empty());
  addTriangle(empty, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  EXPECT_TRUE(unwrapMesh(empty, 1.0f, context).empty());
}

TEST(Unwrap, RampThatWindsOverItselfIsCutApart) {
  // Three turns of a spiral ramp: every face looks up, so that a projection lays the turns over one another.
  Mesh mesh;
  const auto at = [](int i, float r) {
    const float a = 0.2f * static_cast<float>(i);
    return glm::vec3(r * std::cos(a), 0.1f * a, -r * std::sin(a));
  };
  for (int i = 0; i < 94; ++i) addQuad(mesh, at(i, 1.0f), at(i, 2.0f), at(i + 1, 2.0f), at(i + 1, 1.0f));
  Context context;
  const auto charts = unwrapMesh(mesh, 1.0f, context);
  expectEachTriangleOnce(charts, mesh.triangle.size());
  EXPECT_GE(charts.size(), 3u);
  EXPECT_LE(charts.size(), 12u);
  for (const Chart& chart : charts) EXPECT_LT(overlapOf(chart), 0.01);
}

TEST(Unwrap, PileOfCoincidentFacesEndsAndDoesNotOverlap) {
  Mesh mesh;
  for (int i = 0; i < 100; ++i) addTriangle(mesh, {0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  Context context;
  const auto charts = unwrapMesh(mesh, 1.0f, context);
  expectEachTriangleOnce(charts, 100);
  for (const Chart& chart : charts) EXPECT_LT(overlapOf(chart), 0.01);
}

// Needles from the middle in all directions, and as many that lie half over one of them: only the samples near a needle
// are looked at, and they tell.
TEST(Unwrap, NeedlesOverNeedlesAreSplitOff) {
  constexpr std::uint32_t kNeedles = 50;
  Chart chart;
  const auto addNeedle = [&](double angle) {
    const auto rim = [](double a) { return glm::vec2(std::cos(a), std::sin(a)); };
    chart.triangle.push_back(static_cast<std::uint32_t>(chart.triangle.size()));
    chart.uv.push_back({glm::vec2(0.0f), rim(angle), rim(angle + 0.04)});
    chart.areaUv += 0.02f;
  };
  for (const double turn : {0.01, 0.03}) {
    for (std::uint32_t i = 0; i < kNeedles; ++i) addNeedle(turn + 2.0 * 3.14159265358979 * i / kNeedles);
  }
  const std::vector<std::uint32_t> off = splitOverlaps(chart);
  ASSERT_EQ(off.size(), kNeedles);
  for (std::uint32_t i = 0; i < kNeedles; ++i) {
    EXPECT_EQ(chart.triangle[i], i);
    EXPECT_EQ(off[i], kNeedles + i);
  }
}

TEST(Unwrap, FanOfNeedlesIsOneChart) {
  constexpr int kNeedles = 3000;
  Mesh mesh;
  const auto rim = [](int i) {
    const double a = 2.0 * 3.14159265358979 * i / kNeedles;
    return glm::vec3(5.0 * std::cos(a), 0.0, -5.0 * std::sin(a));
  };
  for (int i = 0; i < kNeedles; ++i) addTriangle(mesh, {0, 0, 0}, rim(i), rim(i + 1));
  Context context;
  const auto charts = unwrapMesh(mesh, 1.0f, context);
  expectEachTriangleOnce(charts, kNeedles);
  EXPECT_EQ(charts.size(), 1u);
}

TEST(Unwrap, SameMeshGivesSameCharts) {
  const Mesh mesh = test::sphere(1.0f, 20, 30);
  Context context;
  const auto a = unwrapMesh(mesh, 1.0f, context), b = unwrapMesh(mesh, 1.0f, context);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].triangle, b[i].triangle);
    EXPECT_TRUE(a[i].uv == b[i].uv);
  }
}

Mesh quadsWithUv1(float shift) {
  Mesh mesh;
  addQuad(mesh, {0, 0, 0}, {2, 0, 0}, {2, 0, -1}, {0, 0, -1});
  addQuad(mesh, {5, 0, 0}, {7, 0, 0}, {7, 0, -1}, {5, 0, -1});
  const auto quad = [&](float x) {
    const glm::vec2 a(x, 0.1f), b(x + 0.4f, 0.1f), c(x + 0.4f, 0.3f), d(x, 0.3f);
    mesh.uv[1].insert(mesh.uv[1].end(), {a, b, c, a, c, d});
  };
  quad(0.05f);
  quad(0.05f + shift);
  return mesh;
}

TEST(Unwrap, OwnLightMapCoordinatesBecomeIslandsInMetres) {
  const auto charts = chartsFromTexcoord1(quadsWithUv1(0.5f), 1.0f);
  ASSERT_EQ(charts.size(), 2u);
  for (const Chart& chart : charts) {
    EXPECT_NEAR(chart.areaUv, 2.0f, 1e-4);
    EXPECT_NEAR(sizeOf(chart).x, 2.0f, 1e-3);
    EXPECT_NEAR(sizeOf(chart).y, 1.0f, 1e-3);
  }
}

TEST(Unwrap, OwnCoordinatesThatOverlapOrTileAreRefused) {
  EXPECT_TRUE(chartsFromTexcoord1(quadsWithUv1(0.2f), 1.0f).empty()) << "islands overlap";
  EXPECT_TRUE(chartsFromTexcoord1(quadsWithUv1(0.7f), 1.0f).empty()) << "beyond 1";
  Mesh flat = quadsWithUv1(0.5f);
  for (glm::vec2& uv : flat.uv[1]) uv.y = 0.5f;
  EXPECT_TRUE(chartsFromTexcoord1(flat, 1.0f).empty()) << "no area";
  flat.uv[1].clear();
  EXPECT_TRUE(chartsFromTexcoord1(flat, 1.0f).empty()) << "absent";
}

}  // namespace
}  // namespace relume
