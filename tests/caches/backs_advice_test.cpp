// SPDX-License-Identifier: MIT
// Of backs of one-sided faces the log tells where receivers see them, at any preset, and nowhere else: the play
// space's voxels cannot tell the inside of furniture from its outside.
#include "relume/bake/options.h"
#include "tests/caches/meshes.h"
#include "tests/caches/placed.h"
#include "tests/load_level.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

// The warnings about where a preset's caches lie in a level.
std::vector<std::string> warningsOf(Scene scene, Preset preset) {
  const BakeOptions options = presetOptions(preset);
  test::Placed placed{std::move(scene), {}, {}, {}};
  std::vector<std::string> warnings;
  Context context;
  context.onMessage = [&](Severity severity, std::string_view text) {
    if (severity == Severity::warning) warnings.emplace_back(text);
  };
  test::place(placed, options.caches, options.playSpace, context);
  return warnings;
}

class BacksAdvice : public testing::TestWithParam<Preset> {
 protected:
  const Scene sample_ = test::loadLevel(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb");
};

// Its boards are thinner than a voxel, and its sofa, pillar and pedestal stand open on the floor of a play volume.
TEST_P(BacksAdvice, theSampleLevelHasNone) {
  for (const std::string& warning : warningsOf(sample_, GetParam())) ADD_FAILURE() << warning;
}

TEST_P(BacksAdvice, aOneSidedWallSeenFromBehindIsNamed) {
  Scene scene = sample_;
  Mesh wall;
  test::addQuad(wall, {2, 0, 0}, {2, 0, 4}, {2, 2.2f, 4}, {2, 2.2f, 0});
  test::addInstance(scene, std::move(wall), "partition");
  const std::vector<std::string> warnings = warningsOf(std::move(scene), GetParam());
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("node \"partition\": 8.8 m² of what is seen of it are backs"), std::string::npos)
      << warnings[0];
}

TEST_P(BacksAdvice, aFloorThatIsTurnedOverIsNamed) {
  Scene scene = sample_;
  for (const Instance& instance : scene.instances) {
    if (instance.node != "hall_floor") continue;
    for (glm::uvec3& t : scene.meshes[instance.mesh].triangle) std::swap(t.y, t.z);
    scene.meshes[instance.mesh].normal.clear();
  }
  const std::vector<std::string> warnings = warningsOf(std::move(scene), GetParam());
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].rfind("node \"hall_floor\": ", 0), 0u) << warnings[0];
  EXPECT_NE(warnings[0].find("backs of its one-sided faces"), std::string::npos) << warnings[0];
}

INSTANTIATE_TEST_SUITE_P(Presets, BacksAdvice, testing::Values(Preset::draft, Preset::high),
                         [](const auto& each) { return std::string(kPresets[static_cast<int>(each.param)].name); });

}  // namespace
}  // namespace relume
