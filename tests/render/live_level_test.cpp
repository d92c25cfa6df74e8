// SPDX-License-Identifier: MIT
// Light without a bake while the level changes: held against path tracing of the level as it is by then.
#include "tools/render/live_level.h"
#include "bake/reference/path_tracer.h"
#include "tests/render/walled_room.h"
#include "tools/render/move_nodes.h"
#include "tools/render/render_frame.h"
#include "tools/render/scene_bounds.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

namespace relume {
namespace {

using test::kWall;

constexpr std::uint32_t kBall = 2;

// A room of 8 x 4 x 4 m, a wall across it at x = 0, and a dynamic box in the lamp's half.
struct Rooms {
  Scene scene;
  Context context;

  Rooms() {
    const std::uint32_t grey = test::addWalledRoom(scene);
    test::addInstance(scene, test::box({-3.4f, 0.2f, -1.4f}, {-3.0f, 0.6f, -1.0f}, false, grey));
    scene.instances[kBall].mode = BakeMode::dynamic;
    test::finish(scene);
  }
  static std::vector<SceneLight> lamps() { return {test::lampOfWalledRoom()}; }
  LiveScene lit() const {
    LiveScene frame;
    for (const SceneLight& lamp : lamps()) frame.lights.push_back(toRuntimeLight(lamp));
    return frame;
  }
  std::vector<glm::mat4> places() const {
    std::vector<glm::mat4> to;
    for (const Instance& instance : scene.instances) to.push_back(instance.toWorld);
    return to;
  }
  LiveLevel level(const Scene& of) {
    auto made = LiveLevel::create(of, {16, 64, 2}, context);
    EXPECT_TRUE(made) << made.error().message;
    return std::move(*made);
  }
};

glm::mat4 by(const glm::vec3& offset) { return glm::translate(glm::mat4(1.0f), offset); }

void run(LiveLevel& level, const LiveScene& frame, int frames) {
  for (int f = 0; f < frames; ++f) {
    const Status ok = level.update(frame, 1.0 / 15.0);
    ASSERT_TRUE(ok) << ok.error().message;
  }
}

// Means of traced and of live irradiance over a view, and of the size of their difference.
struct Compared {
  double traced = 0.0, live = 0.0, difference = 0.0;
};

Compared compare(const LiveLevel& level, const Scene& scene, const Camera& camera, Context& context) {
  auto tracer = RayTracer::create(scene, "", context, RayStructure::quick, RayGeometry::drawn);
  EXPECT_TRUE(tracer);
  ReferenceOptions options;
  options.width = 48;
  options.height = 32;
  options.samplesPerPixel = 256;
  const auto image = renderReference(*tracer, camera, Rooms::lamps(), options, context);
  EXPECT_TRUE(image);
  Compared sums;
  for (std::size_t i = 0; i < image->indirect.size(); ++i) {
    if (image->depth[i] == 0.0f) continue;
    const double traced = std::numbers::pi * static_cast<double>(image->indirect[i].g);
    const double live = static_cast<double>(level.light().irradiance(image->position[i], image->normal[i]).g);
    sums.traced += traced;
    sums.live += live;
    sums.difference += std::abs(live - traced);
  }
  return sums;
}

// A wall that is moved shuts the light out where it stands, and lets it through where it stood: as a path tracer has
// it, and within a few frames.
TEST(LiveLevel, followsAMovedWallAsPathTracingHasIt) {
  Rooms rooms;
  LiveLevel level = rooms.level(rooms.scene);
  LiveScene frame = rooms.lit();
  const Camera right = test::lookAt({0.6f, 2.0f, 1.5f}, {2.6f, 1.0f, -1.0f});
  run(level, frame, 40);
  const Compared dark = compare(level, rooms.scene, right, rooms.context);
  EXPECT_EQ(dark.traced, 0.0);

  frame.toWorld = rooms.places();
  frame.toWorld[kWall] = by({3.3f, 0, 0});
  Scene moved = rooms.scene;
  moved.instances[kWall].toWorld = frame.toWorld[kWall];
  run(level, frame, 20);
  const double soon = compare(level, moved, right, rooms.context).live;
  run(level, frame, 60);
  const Compared lit = compare(level, moved, right, rooms.context);
  EXPECT_LT(dark.live, 0.01 * lit.live) << "light behind the wall before it was moved";
  EXPECT_NEAR(lit.live, lit.traced, 0.1 * lit.traced);
  EXPECT_LT(lit.difference, 0.2 * lit.traced);
  EXPECT_NEAR(soon, lit.live, 0.05 * lit.live) << "20 frames after the move";

  // And back: the room is dark again, all of it.
  run(level, rooms.lit(), 60);
  EXPECT_LT(compare(level, rooms.scene, right, rooms.context).live, 0.01 * lit.live);
}

// Edits leave nothing behind: the same caches as of a level that has its parts there from the start.
TEST(LiveLevel, aMovedLevelIsTheLevelThatHasItsPartsThere) {
  Rooms rooms;
  LiveScene frame = rooms.lit();
  frame.bounces = 2;
  LiveLevel edited = rooms.level(rooms.scene);
  run(edited, frame, 2);
  LiveScene moved = frame;
  moved.toWorld = rooms.places();
  moved.toWorld[kBall] = by({0.7f, 0.4f, 0.1f});
  run(edited, moved, 1);  // one thing after the other
  moved.toWorld[kWall] = by({1.1f, 0, 0});
  run(edited, moved, 1);
  moved.toWorld[kBall] = by({0.7f, 0.4f, 0.3f});
  run(edited, moved, 1);

  Scene there = rooms.scene;
  ASSERT_TRUE(moveNodes({"node1=1.1,0,0", "node2=0.7,0.4,0.3"}, MovedParts::all, there));
  LiveLevel made = rooms.level(there);
  run(made, frame, 1);
  const auto a = edited.light()[0].coefficients(), b = made.light()[0].coefficients();
  ASSERT_EQ(a.size(), b.size());
  EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin()));
  EXPECT_TRUE(std::any_of(a.begin(), a.end(), [](float c) { return c > 0.0f; }));
}

TEST(LiveLevel, isTheSameOnAnyNumberOfThreads) {
  Rooms rooms;
  LiveScene moved = rooms.lit();
  moved.toWorld = rooms.places();
  moved.toWorld[kWall] = by({1.1f, 0, 0});
  std::vector<float> first;
  for (const unsigned threads : {1u, 3u}) {
    auto level = LiveLevel::create(rooms.scene, {16, 32, threads}, rooms.context);
    ASSERT_TRUE(level);
    run(*level, rooms.lit(), 3);
    run(*level, moved, 3);
    const auto now = level->light()[0].coefficients();
    if (first.empty()) first.assign(now.begin(), now.end());
    EXPECT_TRUE(std::equal(first.begin(), first.end(), now.begin(), now.end()));
  }
}

// A light that moves is followed; at rest the light settles, and stays.
TEST(LiveLevel, followsALampAndSettles) {
  Rooms rooms;
  LiveLevel level = rooms.level(rooms.scene);
  LiveScene frame = rooms.lit();
  const glm::vec3 floor(-1.0f, 0.0f, 1.0f), up(0, 1, 0);
  run(level, frame, 90);
  const float before = level.light().irradiance(floor, up).g;
  EXPECT_TRUE(level.isSettled());
  run(level, frame, 1);
  EXPECT_NEAR(level.light().irradiance(floor, up).g, before, 0.01f * before);
  frame.lights[0].positionWorld = {2.0f, 3.0f, 0.0f};
  run(level, frame, 1);
  EXPECT_FALSE(level.isSettled());
  run(level, frame, 40);
  EXPECT_LT(level.light().irradiance(floor, up).g, 0.01f * before) << "the lamp is behind the wall";
}

TEST(LiveLevel, whatIsRefusedLeavesLightAndParts) {
  Rooms rooms;
  LiveLevel level = rooms.level(rooms.scene);
  LiveScene frame = rooms.lit();
  run(level, frame, 4);
  const std::vector<float> before(level.light()[0].coefficients().begin(), level.light()[0].coefficients().end());
  const std::vector<std::uint64_t> bits(level.volume().bits().begin(), level.volume().bits().end());
  const auto refuse = [&](const LiveScene& wrong, const std::string& named) {
    const Status refused = level.update(wrong, 0.1);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find(named), std::string::npos) << refused.error().message;
    EXPECT_TRUE(std::equal(before.begin(), before.end(), level.light()[0].coefficients().begin()));
    EXPECT_TRUE(std::equal(bits.begin(), bits.end(), level.volume().bits().begin()));
  };
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  for (const std::uint32_t part : {kWall, kBall}) {
    LiveScene wrong = frame;
    wrong.toWorld = rooms.places();
    wrong.toWorld[part] = by({kNan, 0, 0});
    refuse(wrong, "part " + std::to_string(part));
  }
  LiveScene wrong = frame;
  wrong.toWorld.resize(2);
  refuse(wrong, "2 transforms for 3 instances");
  wrong = frame;
  wrong.lights[0].intensity.x = -1.0f;
  refuse(wrong, "light");
  wrong = frame;
  wrong.eyeWorld = {0, kNan, 0};
  refuse(wrong, "the eye");
  run(level, frame, 1);
}

// Volumes follow the eye: light settles again where they have come to, and stays what it was.
TEST(LiveLevel, followsTheEye) {
  Rooms rooms;
  LiveLevelOptions options{8, 32, 2};
  options.cascades = 2;
  const glm::vec3 floor(-1.0f, 0.0f, 1.0f), up(0, 1, 0);
  LiveScene frame = rooms.lit();
  frame.eyeWorld = {-2, 2, 0};
  auto level = LiveLevel::create(rooms.scene, options, rooms.context, frame.eyeWorld);
  ASSERT_TRUE(level);
  run(*level, frame, 90);
  ASSERT_TRUE(level->isSettled());
  const float before = level->light().irradiance(floor, up).g;
  const glm::ivec3 shift = level->volumes()[1].grid().shift;
  frame.eyeWorld = {-1.9f, 2, 0.1f};
  run(*level, frame, 1);
  EXPECT_TRUE(level->isSettled()) << "nothing has moved";
  frame.eyeWorld = {2, 2, 0};
  run(*level, frame, 1);
  EXPECT_NE(level->volumes()[1].grid().shift, shift);
  EXPECT_FALSE(level->isSettled());
  frame.eyeWorld = {-2, 2, 0};
  run(*level, frame, 90);
  EXPECT_EQ(level->volumes()[1].grid().shift, shift);
  EXPECT_TRUE(level->isSettled());
  EXPECT_NEAR(level->light().irradiance(floor, up).g, before, 0.02f * before);
}

TEST(LiveLevel, aLevelWithoutTrianglesIsDark) {
  Scene nothing;
  Context context;
  auto level = LiveLevel::create(nothing, {8, 8, 1}, context);
  ASSERT_TRUE(level) << level.error().message;
  LiveScene frame = Rooms().lit();
  run(*level, frame, 2);
  EXPECT_EQ(level->light().irradiance({0, 0, 0}, {0, 1, 0}), glm::vec3(0.0f));
}

TEST(SceneBounds, areaWithinABoxIsThatOfWhatIsCut) {
  const SceneBounds box{{0, 0, 0}, {2, 2, 2}, false};
  EXPECT_DOUBLE_EQ(areaWithin(box, {glm::vec3(0, 1, 0), {1, 1, 0}, {0, 1, 1}}), 0.5);
  EXPECT_NEAR(areaWithin(box, {glm::vec3(-1000, 1, -1000), {3000, 1, -1000}, {-1000, 1, 3000}}), 4.0, 1e-9);
  EXPECT_NEAR(areaWithin(box, {glm::vec3(-1, 0.5f, 0), {1, 0.5f, 0}, {-1, 0.5f, 2}}), 0.5, 1e-9);
  EXPECT_EQ(areaWithin(box, {glm::vec3(3, 0, 0), {4, 0, 0}, {3, 0, 1}}), 0.0);
}

// Cells are of the rooms, pieces of the ground that is far off are not cut, and its light is the sky's.
TEST(LiveLevel, aWideGroundLeavesThePlayVolumeItsCells) {
  Rooms rooms;
  test::addInstance(rooms.scene, test::quad({-1500, -0.5f, -1500}, {0, 0, 3000}, {3000, 0, 0}, 0));
  test::finish(rooms.scene);
  EXPECT_FALSE(livePartOf(rooms.scene)) << "no play volume";
  PlayVolume& volume = rooms.scene.volumes.emplace_back();
  volume.toWorld = glm::scale(by({0, 2, 0}), glm::vec3(7.8f, 3.8f, 3.8f));
  const std::optional<SceneBounds> part = livePartOf(rooms.scene);
  ASSERT_TRUE(part);
  EXPECT_FLOAT_EQ(part->min.x, -3.9f - 7.8f);
  EXPECT_FLOAT_EQ(part->max.y, 3.9f + 7.8f);
  rooms.context.maxMemory = std::size_t{4} << 30;  // 80 GiB, were all of the ground cut
  auto level = LiveLevel::create(rooms.scene, {16, 64, 2}, rooms.context);
  ASSERT_TRUE(level) << level.error().message;
  LiveScene frame = rooms.lit();
  frame.sky.radiance = glm::vec3(1.0f);
  run(*level, frame, 8);
  const glm::vec3 up(0, 1, 0);
  EXPECT_GT(level->light().irradiance({-2, 0.01f, 0.5f}, up).g, 0.05f) << "the lamp's half";
  EXPECT_NEAR(level->light().irradiance({700, -0.5f, 300}, up).g, std::numbers::pi_v<float>, 0.05f);
}

// One part a kilometre from all else makes a cell as large as the rooms: say which, unless a play volume has the cells.
TEST(LiveLevel, saysWhichPartMakesItsCellsTooLarge) {
  Rooms rooms;
  std::vector<std::string> told;
  rooms.context.onMessage = [&](Severity severity, std::string_view text) {
    if (severity == Severity::warning) told.emplace_back(text);
  };
  rooms.level(rooms.scene);
  EXPECT_EQ(told, std::vector<std::string>());
  const std::uint32_t stray =
      test::addInstance(rooms.scene, test::box({0, 0, 0}, {1, 1, 1}, false, 0), by({0, 0, 1000}));
  test::finish(rooms.scene);
  rooms.level(rooms.scene);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NE(told[0].find("\"" + rooms.scene.instances[stray].node + "\" is far"), std::string::npos) << told[0];
  EXPECT_NE(told[0].find("1003 m long"), std::string::npos) << told[0];
  rooms.scene.volumes.emplace_back().toWorld = glm::scale(by({0, 2, 0}), glm::vec3(7.8f, 3.8f, 3.8f));
  rooms.level(rooms.scene);
  EXPECT_EQ(told.size(), 1u);
}

TEST(LiveLevel, moreThanTheMemoryAllowsIsRefusedByName) {
  Rooms rooms;
  Context context;
  context.maxMemory = 1;
  const auto level = LiveLevel::create(rooms.scene, {32, 8, 1}, context);
  ASSERT_FALSE(level);
  EXPECT_EQ(level.error().code, ErrorCode::failed);
  EXPECT_NE(level.error().message.find("fewer cells"), std::string::npos) << level.error().message;
}

TEST(MoveNodes, refusesWhatItCannotMove) {
  Rooms rooms;
  const auto refuse = [&](const std::string& move, MovedParts parts, const std::string& named) {
    const Status refused = moveNodes({move}, parts, rooms.scene);
    ASSERT_FALSE(refused) << move;
    EXPECT_EQ(refused.error().code, ErrorCode::usage);
    EXPECT_NE(refused.error().message.find(named), std::string::npos) << refused.error().message;
  };
  refuse("wall=1,2,3", MovedParts::all, "no node \"wall\"");
  refuse("wall=1,2,3", MovedParts::all, "\"node0\", \"node1\", \"node2\"");
  for (const char* wrong : {"node1", "node1=", "node1=1,2", "node1=nan,0,0", "node1=1e9,0,0", "=1,2,3"})
    refuse(wrong, MovedParts::all, "expected");
  refuse("node1=1,2,3", MovedParts::dynamic, "part of the bake");
  EXPECT_TRUE(moveNodes({"node2=1,2,3"}, MovedParts::dynamic, rooms.scene));
  EXPECT_EQ(glm::vec3(rooms.scene.instances[kBall].toWorld[3]), glm::vec3(1, 2, 3));
}

}  // namespace
}  // namespace relume
