// SPDX-License-Identifier: MIT
// What an edit does not touch stays where it is, so that two bakes can be compared and only what changed shows: of a
// level in which one part was moved, surfels and caches elsewhere have the same bits, light maps the same texels.
#include "relume/bake/bake.h"
#include "tests/load_level.h"
#include "tests/pipeline/tiny_bake.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <set>
#include <span>
#include <string_view>

namespace relume {
namespace {

constexpr glm::vec3 kBench(7.9f, 0.2f, 2.5f);  // [m] about where it stands in the hall

Scene twoRooms() { return test::loadLevel(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb"); }

// The level with a part a hand's breadth along.
Scene moved(std::string_view node) {
  Scene scene = twoRooms();
  for (Instance& instance : scene.instances)
    if (instance.node == node) instance.toWorld[3].x += 0.1f;
  return scene;
}

// Of places that are not near the bench, the share that is in both.
double shareThatStayed(std::span<const glm::vec3> positionA, std::span<const glm::vec3> normalA,
                       std::span<const glm::vec3> positionB, std::span<const glm::vec3> normalB) {
  using Place = std::array<float, 6>;
  const auto placeOf = [](const glm::vec3& p, const glm::vec3& n) { return Place{p.x, p.y, p.z, n.x, n.y, n.z}; };
  std::set<Place> known;
  for (std::size_t i = 0; i < positionA.size(); ++i) known.insert(placeOf(positionA[i], normalA[i]));
  std::size_t far = 0, stayed = 0;
  for (std::size_t i = 0; i < positionB.size(); ++i) {
    if (glm::distance(positionB[i], kBench) < 2.5f) continue;
    ++far;
    stayed += known.contains(placeOf(positionB[i], normalB[i])) ? 1 : 0;
  }
  EXPECT_GT(far, 100u);
  return static_cast<double>(stayed) / static_cast<double>(std::max<std::size_t>(far, 1));
}

TEST(LocalEdits, whatIsElsewhereStaysWhereItIs) {
  BakeOptions options = presetOptions(Preset::medium);
  options.links.raysPerCache = 64;
  Context context;
  const Result<Bake> before = bake(twoRooms(), options, context), after = bake(moved("bench"), options, context);
  ASSERT_TRUE(before) << before.error().message;
  ASSERT_TRUE(after) << after.error().message;
  EXPECT_EQ(before->caches.lightmap.width, after->caches.lightmap.width);
  EXPECT_EQ(before->caches.lightmap.height, after->caches.lightmap.height);
  EXPECT_GT(shareThatStayed(before->caches.positionWorld.span(), before->caches.normal.span(),
                            after->caches.positionWorld.span(), after->caches.normal.span()),
            0.97);
  EXPECT_GT(shareThatStayed(before->surfels.positionWorld.span(), before->surfels.normal.span(),
                            after->surfels.positionWorld.span(), after->surfels.normal.span()),
            0.7);
}

}  // namespace
}  // namespace relume
