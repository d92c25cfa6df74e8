// SPDX-License-Identifier: MIT
// Voxels lit by a bake.
#include "runtime/cones/surfel_voxels.h"
#include "runtime/cones/cone_light.h"
#include "tests/live/lit_volumes.h"
#include "tests/runtime/furnace_bake.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <numbers>

namespace relume {
namespace {

using namespace test;

// Walls of albedo 1/2 that send out 1 by themselves and 2 in all; a box inside that is not in the bake moves.
struct Furnace {
  Bake bake = makeFurnaceBake(0.5f, 1.0f, 3);
  VoxelLevel level;
  VoxelVolume volume;
  Relighter relighter;

  Furnace() : level(boxes()), volume(volumeOf(level, coarse(8))), relighter(std::move(*Relighter::create(bake, {}))) {
    LightSetup setup;
    EXPECT_TRUE(relightUntilConverged(relighter, setup));
  }

  static VoxelLevel boxes() {
    VoxelLevel level;
    level.surfaces = {{glm::vec3(0.5f), glm::vec3(1.0f)}, {glm::vec3(0.5f)}};
    level.addBox(glm::vec3(-1.0f), glm::vec3(1.0f), true);
    level.addBox(glm::vec3(-0.2f), glm::vec3(0.2f), false, 1);
    level.parts[1].moves = true;
    return level;
  }
};

TEST(SurfelVoxels, sendOutWhatSurfelsOrTheGridHave) {
  Furnace f;
  auto lit = SurfelVoxels::create(f.volume, f.bake);
  ASSERT_TRUE(lit);
  EXPECT_GT(lit->covered(), 0.0f);
  EXPECT_LT(lit->covered(), 0.1f) << "six surfels, in as many voxels";
  ASSERT_TRUE(lit->light(f.volume, f.relighter, glm::vec3(1.0f)));
  float sum = 0.0f;  // edges and corners keep their emission's flux, as all voxels do
  std::uint32_t walls = 0, bySurfel = 0, moving = 0;
  for (std::uint32_t s = 0; s < f.volume.sideCount(); ++s) {
    const VoxelSide& side = f.volume.side(s);
    if (!side.isFaced || glm::dot(side.normal, f.volume.positionOfSide(s)) > 0.0f) continue;
    if (s >= f.volume.standingSides()) continue;
    const float sent = f.volume.radianceOf(s).x;
    sum += sent;
    ++walls;
    if (std::abs(sent - 2.0f) < 1e-3f) ++bySurfel;
  }
  for (std::uint32_t s = f.volume.standingSides(); s < f.volume.sideCount(); ++s) {
    if (!f.volume.side(s).isFaced) continue;
    EXPECT_NEAR(f.volume.radianceOf(s).x, 1.0f, 0.1f) << "reflects half of what is around";
    ++moving;
  }
  EXPECT_GT(walls, 1000u);
  EXPECT_NEAR(sum / static_cast<float>(walls), 2.0f, 0.1f);
  EXPECT_GE(bySurfel, 6u);
  EXPECT_GT(moving, 10u);

  // What moved is found where it is; what was edited is refused, and the light stays.
  ASSERT_TRUE(f.volume.move(std::vector<glm::mat4x3>{glm::mat4x3(1.0f)}));
  EXPECT_TRUE(lit->light(f.volume, f.relighter, glm::vec3(1.0f)));
  const float before = f.volume.radianceOf(0).x + f.volume.radianceOf(1).x;
  ASSERT_TRUE(f.volume.edit(std::vector<PartEdit>{{0}}));
  const Status refused = lit->light(f.volume, f.relighter, glm::vec3(1.0f));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::usage);
  EXPECT_GT(before, 0.0f);
}

TEST(SurfelVoxels, ofAnotherLevelFindLittle) {
  VoxelLevel level;
  level.addBox(glm::vec3(10.0f), glm::vec3(12.0f), true);
  const VoxelVolume volume = volumeOf(level, coarse(8));
  const auto lit = SurfelVoxels::create(volume, makeFurnaceBake(0.5f, 1.0f, 3));
  ASSERT_TRUE(lit);
  EXPECT_EQ(lit->covered(), 0.0f);
}

}  // namespace
}  // namespace relume
