// SPDX-License-Identifier: MIT
// The grid: walls part what stands on either side of them, bricks are where surfaces are, and light is continuous where
// bricks end.
#include "bake/base/memory_budget.h"
#include "bake/base/random.h"
#include "bake/caches/caches.h"
#include "bake/caches/grid/refine_grid.h"
#include "formats/grid_depth.h"
#include "runtime/shared/stencil.h"
#include "tests/caches/meshes.h"
#include "tests/caches/placed.h"
#include "tests/caches/two_rooms.h"
#include "tests/packed.h"

#include <gtest/gtest.h>
#include <glm/ext/matrix_transform.hpp>

#include <algorithm>
#include <functional>
#include <random>

namespace relume {
namespace {

using test::addBox;
using test::addInstance;
using test::cameraAt;
using test::kHalfWall;
using test::twoRooms;

// The grid alone.
CacheOptions gridOptions() {
  CacheOptions options;
  options.lightmapCaches = 0;
  options.gridCaches = 0;
  return options;
}

void place(const Scene& scene, const CacheOptions& options, Caches& result) {
  Context context;
  test::Placed placed{scene, {}, {}, {}};
  ASSERT_NO_FATAL_FAILURE(test::place(placed, options, test::walks(1u << 15), context));
  result = std::move(placed.caches);
}

// What receivers read of caches whose value is valueAt(their position).
float readGrid(const PackedCaches& caches, const glm::vec3& p, const glm::vec3& n,
               const std::function<float(const glm::vec3&)>& valueAt) {
  const Stencil stencil = gridStencil(caches, p, n);
  float sum = 0.0f;
  for (std::size_t k = 0; k < static_cast<std::size_t>(stencil.count); ++k)
    sum += stencil.weight[k] * valueAt(caches.grid().positionWorld[stencil.cache[k]]);
  return sum / stencil.total();
}

// The largest share of the lit room's light that a receiver in the dark one reads.
float leak(const Caches& caches, float wall) {
  test::DarkReceivers receivers(wall);
  const PackedCaches packed = test::packed(caches);
  float max = 0.0f;
  for (int i = 0; i < 20000; ++i) {
    const test::DarkReceiver r = receivers.next();
    max = std::max(
        max, readGrid(packed, r.position, r.normal, [wall](const glm::vec3& x) { return x.x < wall ? 1.0f : 0.0f; }));
  }
  return max;
}

// Packed depths say of every place of the grid what whole ones do, to the last bit.
void expectSameSight(const Caches& caches) {
  const PackedCaches packed = test::packed(caches);
  const CacheGrid& grid = caches.grid;
  EXPECT_LT(20 * packed.grid().sight.bytes(), 17 * sizeof(std::uint32_t) * grid.depth.size());
  RandomStream random(1, 2, 3);
  const glm::vec3 size = grid.spacing * glm::vec3(grid.resolution);
  std::size_t hidden = 0;
  for (int i = 0; i < 50000; ++i) {
    // Up to half a spacing beyond the grid.
    const glm::vec3 place =
        grid.originWorld - 0.5f * grid.spacing + size * glm::vec3(random.uniform(), random.uniform(), random.uniform());
    visitGridPoints(packed, place, [&](std::uint32_t cache, float, float visible, const glm::vec3& toward) {
      const float whole = depthWeight(grid.depth.data() + std::size_t{kDepthWords} * cache, -toward, grid.depthUnit(),
                                      grid.finestSpacing());
      ASSERT_EQ(visible, whole) << "cache " << cache;
      hidden += whole < 0.5f ? 1 : 0;
    });
  }
  EXPECT_GT(hidden, 10000u);
}

class Wall : public testing::TestWithParam<float> {};

TEST_P(Wall, BetweenALitAndADarkRoomLeaksNothingOnALattice) {
  const float wall = GetParam();
  CacheOptions options = gridOptions();
  options.gridResolution = {8, 3, 6};  // a metre apart
  Caches caches;
  place(twoRooms(wall), options, caches);
  EXPECT_TRUE(caches.grid.brick.empty());
  EXPECT_LT(leak(caches, wall), 0.01f);
  expectSameSight(caches);
}

TEST_P(Wall, BetweenALitAndADarkRoomLeaksNothingInBricks) {
  const float wall = GetParam();
  CacheOptions options = gridOptions();
  options.gridSpacing = 1.0f;
  Caches caches;
  place(twoRooms(wall), options, caches);
  EXPECT_GT(caches.grid.brickCount(), 0u);
  EXPECT_LT(leak(caches, wall), 0.01f);
  expectSameSight(caches);
}

// A hall of 16 m with a column of 1 m in it.
Scene hall() {
  Scene scene;
  Mesh room, column;
  addBox(room, {-8, 0, -8}, {8, 8, 8}, true);
  addBox(column, {-3.1f, 0, 0.9f}, {-2.1f, 8, 1.9f}, false);
  addInstance(scene, std::move(room), "hall");
  addInstance(scene, std::move(column), "column");
  scene.cameras = {cameraAt({2.1f, 1.6f, 1.3f})};
  return scene;
}

CacheOptions spaced(float spacing) {
  CacheOptions options = gridOptions();
  options.gridSpacing = spacing;
  return options;
}

TEST(PlaceGrid, BricksAreWhereSurfacesAre) {
  Caches caches;
  place(hall(), spaced(0.7f), caches);
  const CacheGrid& grid = caches.grid;
  const glm::uvec3 cells = grid.cells();
  const std::uint32_t middle = grid.brick[((cells.z / 2) * cells.y + cells.y / 2) * cells.x + cells.x * 3 / 4];
  EXPECT_EQ(middle, kNoBrick) << "air costs an eighth";
  for (const glm::vec3& p : {glm::vec3(-7.9f, 4, 0), glm::vec3(0, 0.1f, 0), glm::vec3(-2.6f, 4, 1.4f)}) {
    const glm::uvec3 c(glm::clamp((p - grid.originWorld) / grid.spacing, glm::vec3(0.0f), glm::vec3(cells - 1u)));
    EXPECT_NE(grid.brick[(c.z * cells.y + c.y) * cells.x + c.x], kNoBrick) << p.x << ' ' << p.y << ' ' << p.z;
  }
  // A uniform grid of that spacing has 23 x 11 x 23 points.
  EXPECT_LT(caches.count(), 0.7 * 23 * 11 * 23);
}

// Points move by at most 0.4 of their level's spacing along each axis.
TEST(PlaceGrid, PointsHoldCachesOfTheirPlaces) {
  Caches caches;
  place(hall(), spaced(0.7f), caches);
  const CacheGrid& grid = caches.grid;
  const glm::uvec3 cells = grid.cells(), r = grid.resolution;
  const auto moved = [&](std::uint32_t cache, const glm::vec3& lattice, float max) {
    if (cache >= kHangingPoint) return;
    const glm::vec3 away =
        glm::abs(caches.positionWorld[cache] - grid.originWorld - lattice * grid.spacing) / grid.spacing;
    EXPECT_LT(std::max({away.x, away.y, away.z}), max + 1e-4f) << lattice.x << ' ' << lattice.y << ' ' << lattice.z;
  };
  for (std::uint32_t i = 0; i < grid.cache.size(); ++i)
    moved(grid.cache[i], glm::vec3(i % r.x, i / r.x % r.y, i / r.x / r.y), 0.4f);
  int shared = 0;
  for (std::uint32_t c = 0; c < grid.brick.size(); ++c) {
    if (grid.brick[c] == kNoBrick) continue;
    const glm::vec3 low(c % cells.x, c / cells.x % cells.y, c / cells.x / cells.y);
    for (std::uint32_t p = 0; p < kBrickWords; ++p) {
      const std::uint32_t cache = grid.fine[kBrickWords * grid.brick[c] + p];
      moved(cache, low + 0.5f * glm::vec3(p % 3, p / 3 % 3, p / 9), 0.2f);
      shared += cache < kHangingPoint;
    }
  }
  EXPECT_GT(shared, static_cast<int>(caches.count())) << "neighbours share points";
}

// Where all cells have surfaces, a grid has several times the points that one of a room has.
TEST(PlaceGrid, RefinedCellsAskTheMemoryBudget) {
  Scene scene;
  Mesh sheets;
  for (int i = 0; i <= 64; ++i) {
    const float y = 0.25f * static_cast<float>(i);
    test::addQuad(sheets, {0, y, 0}, {0, y, 16}, {16, y, 16}, {16, y, 0});
  }
  addInstance(scene, std::move(sheets), "sheets");
  Context context;
  const auto tracer = RayTracer::create(scene, "", context);
  ASSERT_TRUE(tracer) << tracer.error().message;
  PlaySpaceOptions all;
  all.mode = PlaySpaceOptions::Mode::all;
  const auto space = findPlaySpace(*tracer, all, 1, context);
  ASSERT_TRUE(space) << space.error().message;
  const auto laidOut = layoutGrid(*tracer, *space, spaced(0.25f), 0.0, context);
  ASSERT_TRUE(laidOut) << laidOut.error().message;
  EXPECT_EQ(laidOut->brickCount, laidOut->brick.size());
  context.maxMemory = heldMemory() + (std::uint64_t{80} << 20);
  const auto refused = layoutGrid(*tracer, *space, spaced(0.25f), 0.0, context);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("are of its coarse level"), std::string::npos) << refused.error().message;
}

TEST(PlaceGrid, HasAboutTheCachesAskedFor) {
  for (const std::uint32_t count : {300u, 2304u}) {
    CacheOptions options = gridOptions();
    options.gridCaches = count;
    Caches caches;
    place(hall(), options, caches);
    EXPECT_NEAR(caches.count(), count, (count < 1000 ? 0.4 : 0.15) * count) << "few points come in large steps";
  }
}

// Any value at the caches: what receivers read must not jump across the faces of cells, of bricks, and of their halves.
TEST(PlaceGrid, LightIsContinuousWhereBricksEnd) {
  Caches caches;
  place(hall(), spaced(1.0f), caches);
  const CacheGrid& grid = caches.grid;
  ASSERT_GT(grid.brickCount(), 0u);
  ASSERT_GT(std::count(grid.brick.begin(), grid.brick.end(), kNoBrick), 0);
  ASSERT_GT(std::count(grid.fine.begin(), grid.fine.end(), kHangingPoint), 0);
  const auto value = [](const glm::vec3& x) {
    return std::fmod(std::abs(13.7f * x.x + 5.3f * x.y + 29.1f * x.z), 1.0f);
  };
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  std::normal_distribution<float> gauss;
  const PackedCaches packed = test::packed(caches);
  float max = 0.0f;
  for (int i = 0; i < 8000; ++i) {
    glm::vec3 u = glm::vec3(uniform(random), uniform(random), uniform(random)) * glm::vec3(grid.resolution - 1u);
    const int axis = i % 3;
    u[axis] = 0.5f * std::round(2.0f * u[axis]);
    glm::vec3 step(0.0f);
    step[axis] = 2e-5f;
    const glm::vec3 p = grid.originWorld + u * grid.spacing,
                    n = glm::normalize(glm::vec3(gauss(random), gauss(random), gauss(random)));
    // Inside the column nobody stands.
    if (std::abs(p.x + 2.6f) < 0.51f && std::abs(p.z - 1.4f) < 0.51f) continue;
    max = std::max(max, std::abs(readGrid(packed, p - step, n, value) - readGrid(packed, p + step, n, value)));
  }
  EXPECT_LT(max, 0.02f);
}

// Maps hold few directions; a wall is met exactly for all that.
TEST(PlaceGrid, CachesSeeUpToWallsAtAnyAngle) {
  Caches caches;
  place(twoRooms(0.0f), spaced(0.8f), caches);
  const CacheGrid& grid = caches.grid;
  std::mt19937 random(4);
  std::uniform_real_distribution<float> uniform(0.0f, 1.0f);
  int near = 0, hidden = 0, behind = 0, total = 0;
  for (std::uint32_t c = 0; c < caches.count(); ++c) {
    const glm::vec3 x = caches.positionWorld[c];
    if (x.x > 0.0f || x.x < -1.2f) continue;
    for (int i = 0; i < 200; ++i) {
      const glm::vec2 u = glm::vec2(uniform(random), uniform(random)) * 2.0f - 1.0f;
      const glm::vec3 onWall(-kHalfWall, x.y + u.x, x.z + u.y);
      // Away from the other walls, where maps round the corner.
      if (onWall.y < 0.4f || onWall.y > 2.6f || std::abs(onWall.z) > 2.6f) continue;
      const auto weight = [&](float off) {
        return depthWeight(grid.depth.data() + kDepthWords * c, onWall + glm::vec3(off, 0, 0) - x, grid.depthUnit(),
                           grid.finestSpacing());
      };
      ++total;
      near += weight(-0.01f) > 0.9f;
      hidden += weight(2.0f * kHalfWall) < 1e-3f;
      behind += weight(0.01f) > 0.01f;
    }
  }
  ASSERT_GT(total, 1000);
  EXPECT_GT(near, 0.97 * total);
  EXPECT_GT(hidden, 0.999 * total);
  EXPECT_GT(behind, 0.5 * total) << "a receiver at the wall is not cut off by rounding";
}

INSTANTIATE_TEST_SUITE_P(, Wall, testing::Values(-0.35f, -0.2f, -0.07f, 0.0f, 0.11f, 0.24f, 0.38f, 0.5f));

}  // namespace
}  // namespace relume
