// SPDX-License-Identifier: MIT
// Surfels move to where they are seen, and only there.
#include "bake/surfels/move_to_visible.h"
#include "bake/surfels/surfel_map.h"
#include "tests/surfels/make_level.h"

#include <cmath>

namespace relume {
namespace {

// A floor of one square metre, and a shelf a centimetre above the half x < 0.5.
struct HalfCoveredFloor {
  HalfCoveredFloor() {
    level.begin("floor");
    level.addRectangle({0, 0, 0}, {0, 0, 1}, {1, 0, 0});
    level.begin("shelf");
    level.addRectangle({-1, 0.01f, -1}, {0, 0, 3}, {1.5f, 0, 0});
    space = level.fronts();
    // Receivers over the whole floor.
    for (int x = 0; x < 8; ++x) {
      for (int z = 0; z < 8; ++z) space.receivers.emplace_back(0.0625f + 0.125f * x, 1.0f, 0.0625f + 0.125f * z);
    }
  }
  Level level;
  PlaySpace space;
};

std::vector<SurfelSeed> movedSeeds(const HalfCoveredFloor& scene, std::span<const SurfaceSample> surfels, int threads) {
  Context context;
  context.threads = threads;
  const RayTracer tracer = scene.level.tracer(context);
  const SurfelMap map = buildSurfelMap(tracer.scene(), scene.space, surfels, 0.25f, context);
  return moveToVisible(tracer, scene.space, map, surfels, 1, context);
}

// One surfel for the floor under the shelf, and enough on the shelf that rays are cast.
std::vector<SurfaceSample> surfelsOf(HalfCoveredFloor& scene) {
  std::vector<SurfaceSample> surfels{sampleOf(scene.level.scene(), 0, {0.2f, 0.1f})};
  for (int i = 0; i < 63; ++i)
    surfels.push_back(sampleOf(scene.level.scene(), i % 2 == 0 ? 4 : 6, {0.01f * static_cast<float>(i), 0.2f}));
  return surfels;
}

TEST(MoveToVisible, aHiddenSurfelMovesToTheSeenPartOfItsFootprint) {
  HalfCoveredFloor scene;
  const std::vector<SurfaceSample> surfels = surfelsOf(scene);
  ASSERT_LT(surfels[0].positionWorld.x, 0.5f);
  const std::vector<SurfelSeed> seeds = movedSeeds(scene, surfels, 1);
  ASSERT_EQ(seeds.size(), surfels.size());
  EXPECT_GT(seeds[0].positionWorld.x, 0.5f);
  EXPECT_NEAR(seeds[0].positionWorld.y, 0.0f, 1e-6);
  EXPECT_LT(seeds[0].side, 4u) << "it stays on the floor";
  EXPECT_NEAR(seeds[0].normal.y, 1.0f, 1e-6);
}

TEST(MoveToVisible, withoutReceiversNothingMoves) {
  HalfCoveredFloor scene;
  scene.space.receivers.clear();
  const std::vector<SurfaceSample> surfels = surfelsOf(scene);
  EXPECT_EQ(movedSeeds(scene, surfels, 1)[0].positionWorld, surfels[0].positionWorld);
}

TEST(MoveToVisible, threadCountDoesNotChangeThePlaces) {
  HalfCoveredFloor scene;
  const std::vector<SurfaceSample> surfels = surfelsOf(scene);
  const std::vector<SurfelSeed> one = movedSeeds(scene, surfels, 1), two = movedSeeds(scene, surfels, 2);
  for (std::size_t i = 0; i < one.size(); ++i) EXPECT_EQ(one[i].positionWorld, two[i].positionWorld);
}

}  // namespace
}  // namespace relume
