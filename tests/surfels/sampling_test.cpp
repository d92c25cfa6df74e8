// SPDX-License-Identifier: MIT
// What placement is made of: points by area, the grid of points, elimination.
#include "bake/base/point_grid.h"
#include "bake/base/random.h"
#include "bake/surfels/eliminate.h"
#include "bake/surfels/surface_sampler.h"
#include "tests/surfels/make_level.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

namespace relume {
namespace {

TEST(SurfaceSampler, everyTriangleGetsItsShareToWithinOnePoint) {
  Level level;
  level.begin("strip");
  for (int i = 0; i < 50; ++i) {
    const auto x = static_cast<float>(i);
    level.addTriangle({x, 0, 0}, {x, 0, 0.02f * (x + 1)}, {x + 1, 0, 0});
  }
  Context context;
  const RayTracer tracer = level.tracer(context);
  const PlaySpace space = level.fronts();
  const SurfaceSampler sampler(tracer, space, 777, 0, context);
  const std::vector<SurfaceSample> points = sampler.draw(777, 5, 0, context);
  // Steps are of a ladder of 8 an octave.
  const auto all = static_cast<double>(points.size());
  EXPECT_GE(all, 777.0 - 1.0);
  EXPECT_LE(all, 777.0 * std::exp2(1.0 / 8.0) + 1.0);
  std::vector<int> count(50, 0);
  for (const SurfaceSample& p : points) ++count[p.point.triangle];
  for (int i = 0; i < 50; ++i) EXPECT_NEAR(count[i], all * space.seenArea[2 * i] / space.seenTotal, 1.0001) << i;
}

// A box before it in the file gives all triangles and instances other numbers, and the level a little more area.
TEST(SurfaceSampler, pointsStayWhereAPartComesBeforeTheirs) {
  const auto pointsOfRoom = [](bool withBox) {
    Level level;
    if (withBox) {
      level.begin("box");
      level.addRectangle({2, 0, 2}, {0.05f, 0, 0}, {0, 0.05f, 0});
    }
    level.begin("room");
    level.addRoom({5, 3, 4});
    Context context;
    const RayTracer tracer = level.tracer(context);
    const PlaySpace space = level.bothSides();
    const SurfaceSampler sampler(tracer, space, 3000, 0, context);
    std::vector<glm::vec3> positions;
    for (const SurfaceSample& p : sampler.draw(3000, 5, 0, context))
      if (level.scene().instances[p.point.instance].node == "room") positions.push_back(p.positionWorld);
    return positions;
  };
  EXPECT_EQ(pointsOfRoom(false), pointsOfRoom(true));
}

TEST(SurfaceSampler, pointsFillATriangleEvenly) {
  Level level;
  level.begin("floor");
  level.addTriangle({0, 0, 0}, {0, 0, 4}, {4, 0, 0});
  Context context;
  const RayTracer tracer = level.tracer(context);
  const PlaySpace space = level.fronts();
  const SurfaceSampler sampler(tracer, space, 6400, 0, context);
  std::vector<int> cell(64, 0);
  const std::vector<SurfaceSample> points = sampler.draw(6400, 5, 0, context);
  for (const SurfaceSample& p : points) {
    const auto column = static_cast<int>(8 * p.point.barycentric.x), row = static_cast<int>(8 * p.point.barycentric.y);
    ++cell[8 * row + column];
  }
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column < 8; ++column) {
      const double whole = static_cast<double>(points.size()) / 32.0;
      const double expected = row + column < 7 ? whole : (row + column == 7 ? 0.5 * whole : 0);
      EXPECT_NEAR(cell[8 * row + column], expected, expected > 0 ? 12 : 0);
    }
  }
}

TEST(SurfaceSampler, pointsFallOnSeenCellsOnly) {
  // A plane of which a rounded 100 m² of 4 km² are seen: found quickly, and nothing outside.
  Level level;
  level.begin("plane");
  level.addTriangle({-1000, 0, -1000}, {-1000, 0, 3000}, {1000, 0, -1000});
  Context context;
  const RayTracer tracer = level.tracer(context);
  PlaySpaceOptions options;
  options.walks = 20000;
  Camera camera;
  camera.toWorld[3] = glm::vec4(0, 2, 0, 1);
  level.scene().cameras.push_back(camera);
  level.begin("walls");
  level.addRectangle({-5, 0, -5}, {10, 0, 0}, {0, 4, 0});
  level.addRectangle({-5, 0, 5}, {0, 4, 0}, {10, 0, 0});
  level.addRectangle({-5, 0, -5}, {0, 4, 0}, {0, 0, 10});
  level.addRectangle({5, 0, -5}, {0, 0, 10}, {0, 4, 0});
  level.addRectangle({-5, 4, -5}, {10, 0, 0}, {0, 0, 10});
  const RayTracer closed = level.tracer(context);
  const auto space = findPlaySpace(closed, options, 1, context);
  ASSERT_TRUE(space);
  ASSERT_GT(space->seenArea[0], 50.0f);
  ASSERT_LT(space->seenArea[0], 40000.0f);
  const SurfaceSampler sampler(closed, *space, 2000, 0, context);
  int outside = 0;
  for (const SurfaceSample& p : sampler.draw(2000, 5, 0, context)) {
    if (!space->seenAt(p.side, p.point.barycentric)) ++outside;
  }
  EXPECT_LE(outside, 20);
}

TEST(SurfaceSampler, sameBytesAtAnyThreadCount) {
  Level level;
  level.begin("room");
  level.addRoom({5, 3, 4});
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  const RayTracer tracer = level.tracer(one);
  const PlaySpace space = level.bothSides();
  const SurfaceSampler sampler(tracer, space, 30000, 0, one);
  const std::vector<SurfaceSample> a = sampler.draw(30000, 5, 0, one), b = sampler.draw(30000, 5, 0, two);
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) EXPECT_EQ(a[i].positionWorld, b[i].positionWorld);
}

TEST(PointGrid, neighbourhoodsHoldAllPointsWithinABucket) {
  std::vector<glm::vec3> points;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    RandomStream r(4, 4, i);
    points.emplace_back(10.0f * r.uniform(), 2.0f * r.uniform() * r.uniform(), 7.0f * r.uniform());
  }
  Context context;
  const PointGrid grid(points, 0.5f, context);
  std::vector<std::uint32_t> sorted(grid.order().begin(), grid.order().end());
  std::sort(sorted.begin(), sorted.end());
  for (std::uint32_t i = 0; i < 3000; ++i) ASSERT_EQ(sorted[i], i);
  for (std::uint64_t q = 0; q < 300; ++q) {
    RandomStream r(4, 5, q);
    const glm::vec3 p(12.0f * r.uniform() - 1.0f, 3.0f * r.uniform() - 0.5f, 9.0f * r.uniform() - 1.0f);
    std::multiset<std::uint32_t> cube, shells;
    grid.forEachRun(p, 2, [&](std::uint32_t b, std::uint32_t e) {
      for (std::uint32_t i = b; i < e; ++i) cube.insert(grid.order()[i]);
    });
    for (int ring = 0; ring <= 2; ++ring) {
      grid.forEachRunOfShell(p, ring, [&](std::uint32_t b, std::uint32_t e) {
        for (std::uint32_t i = b; i < e; ++i) shells.insert(grid.order()[i]);
      });
    }
    EXPECT_EQ(cube, shells);
    const float reach = 0.1f + 0.9f * r.uniform();
    std::multiset<std::uint32_t> box;
    grid.forEachRunIn(grid.boxAround(p, reach), [&](std::uint32_t b, std::uint32_t e) {
      for (std::uint32_t i = b; i < e; ++i) box.insert(grid.order()[i]);
    });
    for (std::uint32_t i = 0; i < 3000; ++i) {
      if (glm::length(points[i] - p) < 2 * grid.bucketSize()) {
        EXPECT_EQ(cube.count(i), 1u);
      }
      if (glm::length(points[i] - p) < reach) {
        EXPECT_EQ(box.count(i), 1u);
      }
    }
  }
}

TEST(PointGrid, takesNoPointsOnePointAndHugeExtents) {
  Context context;
  const PointGrid none(std::vector<glm::vec3>{}, 1.0f, context);
  none.forEachRun(glm::vec3(0.0f), 1, [](std::uint32_t, std::uint32_t) { FAIL(); });
  const PointGrid far(std::vector<glm::vec3>{{0, 0, 0}, {1e7f, 1e7f, 1e7f}}, 1e-3f, context);
  int found = 0;
  far.forEachRun(glm::vec3(1e7f), 1, [&](std::uint32_t b, std::uint32_t e) { found += static_cast<int>(e - b); });
  EXPECT_EQ(found, 1);
  far.forEachRun(glm::vec3(-1e30f), 1, [](std::uint32_t, std::uint32_t) { FAIL(); });
}

TEST(EliminateSamples, keepsEachCandidateAtMostOnce) {
  Level level;
  level.begin("room");
  level.addRoom({5, 3, 4});
  Context context;
  const RayTracer tracer = level.tracer(context);
  const PlaySpace space = level.fronts();
  const SurfaceSampler sampler(tracer, space, 1000, 0, context);
  const std::vector<SurfaceSample> candidates = sampler.draw(5000, 5, 0, context);
  for (const std::uint32_t count : {1u, 2u, 3u, 999u, 5000u}) {
    const auto order = eliminateSamples(candidates, count, 0.3f, context);
    ASSERT_TRUE(order);
    EXPECT_EQ(order->size(), count);
    EXPECT_EQ(std::set<std::uint32_t>(order->begin(), order->end()).size(), count);
  }
}

TEST(EliminateSamples, prefixesStayWellSpreadWhereStepsAreTaken) {
  Level level;
  level.begin("floor");
  level.addRectangle({0, 0, 0}, {0, 0, 10}, {10, 0, 0});
  Context context;
  const RayTracer tracer = level.tracer(context);
  const PlaySpace space = level.fronts();
  constexpr std::uint32_t kCount = 16384;
  const SurfaceSampler sampler(tracer, space, kCount, 0, context);
  const std::vector<SurfaceSample> candidates = sampler.draw(5 * kCount, 5, 0, context);
  const auto densest = [](std::size_t n) { return std::sqrt(2.0 / std::sqrt(3.0) * 100.0 / static_cast<double>(n)); };
  const auto order = eliminateSamples(candidates, kCount, static_cast<float>(densest(kCount)), context);
  ASSERT_TRUE(order);
  for (const std::size_t prefix : {std::size_t{6000}, std::size_t{8192}, std::size_t{11000}, std::size_t{kCount}}) {
    // Bins of the wanted distance's size hold few points; nearest neighbours are in the bins around.
    const double wanted = (prefix == kCount ? 0.65 : 0.45) * densest(prefix);
    const int along = static_cast<int>(10.0 / wanted);
    const auto binOf = [&](double x) { return std::clamp(static_cast<int>(x / 10.0 * along), 0, along - 1); };
    std::map<std::pair<int, int>, std::vector<glm::vec3>> bins;
    double nearest = 1e9;
    for (std::size_t i = 0; i < prefix; ++i) {
      const glm::vec3 p = candidates[(*order)[i]].positionWorld;
      const int x = binOf(p.x), z = binOf(p.z);
      for (int dx = -1; dx <= 1; ++dx) {
        for (int dz = -1; dz <= 1; ++dz) {
          for (const glm::vec3& q : bins[{x + dx, z + dz}]) nearest = std::min<double>(nearest, glm::distance(p, q));
        }
      }
      bins[{x, z}].push_back(p);
    }
    EXPECT_GT(nearest, wanted) << prefix;
    // Every sixteenth of the floor has its share.
    std::array<int, 16> share{};
    for (std::size_t i = 0; i < prefix; ++i) {
      const glm::vec3 p = candidates[(*order)[i]].positionWorld;
      const auto x = std::min(3u, static_cast<unsigned>(p.x / 2.5f)),
                 z = std::min(3u, static_cast<unsigned>(p.z / 2.5f));
      ++share[x + 4 * z];
    }
    const double fair = static_cast<double>(prefix) / 16.0;
    for (const int n : share) EXPECT_NEAR(n, fair, 0.08 * fair) << prefix;
  }
}

TEST(EliminateSamples, coincidentCandidatesAreNoHang) {
  std::vector<SurfaceSample> candidates(3000);
  for (SurfaceSample& c : candidates) c.normal = glm::vec3(0, 1, 0);
  Context context;
  const auto order = eliminateSamples(candidates, 100, 0.1f, context);
  ASSERT_TRUE(order);
  EXPECT_EQ(order->size(), 100u);
}

// A search far wider than the grid costs what the grid does: this would go on for centuries.
TEST(PointGrid, rowsBeyondTheGridCostNothing) {
  Context context;
  const std::vector<glm::vec3> points{{0, 0, 0}, {1, 2, 3}};
  for (const std::size_t count : {std::size_t{0}, points.size()}) {
    const PointGrid grid(std::span<const glm::vec3>(points).first(count), 1.0f, context);
    std::size_t found = 0;
    grid.forEachRunIn(grid.boxAround({0.5f, 0.5f, 0.5f}, 1e9f),
                      [&](std::uint32_t begin, std::uint32_t end) { found += end - begin; });
    EXPECT_EQ(found, count);
  }
}

}  // namespace
}  // namespace relume
