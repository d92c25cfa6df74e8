// SPDX-License-Identifier: MIT
#include "bake/visibility/play_space.h"

#include "bake/base/random.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <filesystem>

namespace relume {
namespace {

using namespace test;

PlaySpace spaceOf(const RayTracer& tracer, PlaySpaceOptions options = {}, int threads = 0) {
  Context context;
  context.threads = threads;
  auto space = findPlaySpace(tracer, options, 1, context);
  EXPECT_TRUE(space) << (space ? "" : space.error().message);
  return std::move(*space);
}

RayTracer tracerOf(const Scene& scene) {
  Context context;
  return std::move(*RayTracer::create(scene, "avx2", context));
}

PlaySpaceOptions walks(std::uint32_t count) {
  PlaySpaceOptions options;
  options.walks = count;
  return options;
}

double seenOf(const Scene& scene, const PlaySpace& space, std::uint32_t instance, bool back) {
  double sum = 0;
  const Instance& i = scene.instances[instance];
  for (std::size_t t = 0; t < scene.meshes[i.mesh].triangle.size(); ++t)
    sum += space.seenArea[2 * (i.firstTriangle + t) + (back ? 1 : 0)];
  return sum;
}

// Two closed rooms beside each other; a camera in the first.
Scene twoRooms() {
  Scene scene;
  addInstance(scene, box({0, 0, 0}, {4, 3, 4}, true));
  addInstance(scene, box({5, 0, 0}, {9, 3, 4}, true));
  scene.cameras.push_back(lookAt({1, 1.5f, 1}, {2, 1, 2}));
  finish(scene);
  return scene;
}

TEST(PlaySpace, seesTheCamerasRoomInsideOnlyAndNotTheNextRoom) {
  const Scene scene = twoRooms();
  const PlaySpace space = spaceOf(tracerOf(scene), walks(100000));
  const double room = 2 * (4 * 3 + 4 * 3 + 4 * 4);
  EXPECT_NEAR(seenOf(scene, space, 0, false), room, 0.03 * room);
  EXPECT_LT(seenOf(scene, space, 0, true), 1e-3 * room);
  EXPECT_EQ(seenOf(scene, space, 1, false), 0.0);
  EXPECT_EQ(seenOf(scene, space, 1, true), 0.0);
  EXPECT_NEAR(space.total, 4 * room, 1e-3);
  EXPECT_NEAR(space.seenTotal, seenOf(scene, space, 0, false) + seenOf(scene, space, 0, true), 1e-6);
  for (const glm::vec3& p : space.receivers) {
    EXPECT_TRUE(p.x > 0 && p.x < 4 && p.y > 0 && p.y < 3 && p.z > 0 && p.z < 4);
  }
  EXPECT_GT(space.receivers.size(), 1000u);
}

// Voxels as fine as a gap of a ten-billionth of a metre would be more than memory holds.
TEST(PlaySpace, aGapThinnerThanRaysCanTellIsNoFreeSpace) {
  Scene scene;
  Mesh bent = quad({0, 20.5f, 0}, {2, -0.5f, 0}, {0, 1.5f, 0});
  bent.position.back().z = 2e-10f;
  addInstance(scene, bent);
  finish(scene);
  const PlaySpace space = spaceOf(tracerOf(scene), walks(1000));
  EXPECT_GT(space.voxelSize, 1e-2f);
  EXPECT_NEAR(space.seenTotal, 0.5 * space.total, 0.1 * space.total);
}

TEST(PlaySpace, aVolumeIsAStartToo) {
  Scene scene = twoRooms();
  scene.cameras.clear();
  // The volume is larger than the room: points outside of it see back faces first and do not count.
  scene.volumes.push_back({"volume", glm::scale(glm::translate(glm::mat4(1), {7, 1.5f, 2}), {4.6f, 2, 4.6f})});
  const PlaySpace space = spaceOf(tracerOf(scene), walks(100000));
  const double room = 2 * (4 * 3 + 4 * 3 + 4 * 4);
  EXPECT_NEAR(seenOf(scene, space, 1, false), room, 0.03 * room);
  EXPECT_LT(seenOf(scene, space, 0, false) + seenOf(scene, space, 0, true) + seenOf(scene, space, 1, true),
            1e-3 * room);
}

// A box whose lid leaves a slit, of a material that shows both sides: what is within is seen through the slit alone,
// not from starts of the volume in it. A volume that has its place there sees it.
TEST(PlaySpace, theInsideOfAnOpenShellIsNoPlaceToStart) {
  Scene scene;
  addInstance(scene, box({0, 0, 0}, {4, 3, 4}, true));
  const std::uint32_t twoSided = addMaterial(scene, glm::vec3(0.5f));
  scene.materials[twoSided].doubleSided = true;
  Mesh shell = box({1, 1, 1}, {2, 2, 2}, false, twoSided);
  for (const std::uint32_t v : {2u, 3u}) shell.position.push_back(shell.position[v] + glm::vec3(0, 0, 0.01f));
  for (glm::uvec3& t : shell.triangle) {
    if (t == glm::uvec3(2, 6, 7)) t = {8, 6, 7};
    if (t == glm::uvec3(2, 7, 3)) t = {8, 7, 9};
  }
  addInstance(scene, shell);
  finish(scene);
  const auto volume = [](glm::vec3 middle, glm::vec3 size) {
    return PlayVolume{"volume", glm::scale(glm::translate(glm::mat4(1), middle), size)};
  };
  scene.volumes = {volume({2, 1.5f, 2}, {3.9f, 2.9f, 3.9f})};
  const double area = 6.0;
  PlaySpace space = spaceOf(tracerOf(scene), walks(100000));
  EXPECT_GT(seenOf(scene, space, 1, false), 0.9 * area);
  EXPECT_LT(seenOf(scene, space, 1, true), 0.1 * area);
  scene.volumes.push_back(volume({1.5f, 1.5f, 1.5f}, {0.9f, 0.9f, 0.9f}));
  space = spaceOf(tracerOf(scene), walks(100000));
  EXPECT_GT(seenOf(scene, space, 1, true), 0.9 * area);
}

TEST(PlaySpace, aCameraBesideAVolumeOnlyLooks) {
  Scene scene = twoRooms();  // the camera is in the first room
  scene.volumes.push_back({"volume", glm::scale(glm::translate(glm::mat4(1), {7, 1.5f, 2}), {2, 2, 2})});
  const PlaySpace space = spaceOf(tracerOf(scene), walks(100000));
  const double room = 2 * (4 * 3 + 4 * 3 + 4 * 4);
  EXPECT_NEAR(seenOf(scene, space, 1, false), room, 0.03 * room);
  EXPECT_EQ(seenOf(scene, space, 0, false), 0.0);
}

TEST(PlaySpace, aCameraThatOptsOutOnlyLooks) {
  Scene scene = twoRooms();
  scene.cameras.push_back(lookAt({6, 1.5f, 1}, {7, 1, 2}));
  scene.cameras[0].playSpace = false;
  const PlaySpace space = spaceOf(tracerOf(scene), walks(100000));
  EXPECT_EQ(seenOf(scene, space, 0, false), 0.0);
  EXPECT_GT(seenOf(scene, space, 1, false), 0.0);
}

TEST(PlaySpace, receiversWalkAroundCorners) {
  // Two rooms joined by a doorway off the camera's sight: a wall from z = 0 to 3.4 of 4.
  Scene scene;
  addInstance(scene, box({0, 0, 0}, {8, 3, 4}, true));
  addInstance(scene, box({3.9f, 0.001f, 0.001f}, {4.1f, 2.999f, 3.2f}, false));
  addInstance(scene, quad({7.5f, 1, 0.2f}, {0, 0, 0.6f}, {0, 0.6f, 0}));  // front toward -x, hidden behind the wall
  scene.cameras.push_back(lookAt({0.5f, 1.5f, 0.5f}, {1, 1, 1}));
  finish(scene);
  const PlaySpace space = spaceOf(tracerOf(scene), walks(200000));
  EXPECT_NEAR(seenOf(scene, space, 2, false), 0.36, 0.05);
  EXPECT_NEAR(seenOf(scene, space, 2, true), 0.36, 0.05);
  EXPECT_TRUE(std::any_of(space.receivers.begin(), space.receivers.end(), [](const glm::vec3& p) { return p.x > 6; }));
}

TEST(PlaySpace, aLargeTriangleIsSeenInPart) {
  // A floor of 40 x 40 m, of which a closed room covers 4 x 4 m.
  Scene scene;
  addInstance(scene, quad({-18, 0, 22}, {40, 0, 0}, {0, 0, -40}));
  Mesh room = box({0, 0, 0}, {4, 3, 4}, true);
  room.triangle.erase(room.triangle.begin() + 4, room.triangle.begin() + 6);  // open below, onto the floor
  addInstance(scene, room);
  scene.cameras.push_back(lookAt({1, 1.5f, 1}, {2, 1, 2}));
  finish(scene);
  const RayTracer tracer = tracerOf(scene);
  const PlaySpace space = spaceOf(tracer, walks(200000));
  EXPECT_NEAR(seenOf(scene, space, 0, false), 16.0, 2.0);
  EXPECT_EQ(seenOf(scene, space, 0, true), 0.0);
  // seenAt agrees with where the room is, and its mean with seenArea.
  double inside = 0;
  constexpr int kSamples = 40000;
  for (int s = 0; s < kSamples; ++s) {
    RandomStream random(3, 1, static_cast<std::uint64_t>(s));
    const glm::vec2 u = random.uniform2();
    const glm::vec2 b = u.x + u.y > 1 ? 1.0f - u : u;
    const std::uint32_t t = random.below(2);
    const auto c = scene.corners(scene.instances[0], t);
    const glm::vec3 p = c[0] + (c[1] - c[0]) * b.x + (c[2] - c[0]) * b.y;
    const bool seen = space.seenAt(2 * t, b);
    inside += seen;
    if (p.x > 0.1f && p.x < 3.9f && p.z > 0.1f && p.z < 3.9f) {
      EXPECT_TRUE(seen) << p.x << ' ' << p.z;
    }
    if (p.x < -0.5f || p.x > 4.5f || p.z < -0.5f || p.z > 4.5f) {
      EXPECT_FALSE(seen) << p.x << ' ' << p.z;
    }
    EXPECT_FALSE(space.seenAt(2 * t + 1, b));
  }
  EXPECT_NEAR(inside / kSamples * 1600, seenOf(scene, space, 0, false), 2.0);
}

TEST(PlaySpace, withoutCamerasFrontsAreFoundFromFreeSpace) {
  // A solid box seen from outside: its inside is no free space.
  Scene scene;
  addInstance(scene, box({-1, -1, -1}, {1, 1, 1}, false));
  finish(scene);
  const PlaySpace space = spaceOf(tracerOf(scene), walks(100000));
  EXPECT_NEAR(seenOf(scene, space, 0, false), 24.0, 0.7);
  EXPECT_EQ(seenOf(scene, space, 0, true), 0.0);
  // A room without a camera: its inside.
  Scene room;
  addInstance(room, box({-1, -1, -1}, {1, 1, 1}, true));
  finish(room);
  const PlaySpace inside = spaceOf(tracerOf(room), walks(100000));
  EXPECT_NEAR(seenOf(room, inside, 0, false), 24.0, 0.7);
}

TEST(PlaySpace, aCameraThatSeesNothingFallsBackToFreeSpace) {
  Scene scene;
  addInstance(scene, quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}));
  scene.cameras.push_back(lookAt({0, 0, 1e6f}, {0, 0, 2e6f}));
  finish(scene);
  EXPECT_NEAR(seenOf(scene, spaceOf(tracerOf(scene), walks(100000)), 0, false), 4.0, 0.2);
}

// Where the level's author said that receivers are, and nothing can be seen, a warning says what is taken instead.
TEST(PlaySpace, volumesAndCamerasWithoutASurfaceAreNamed) {
  Scene scene = twoRooms();
  scene.cameras.clear();
  const auto warningsOf = [&](PlaySpaceOptions options) {
    std::string warnings;
    Context context;
    context.onMessage = [&](Severity severity, std::string_view text) {
      if (severity == Severity::warning) warnings += std::string(text) + "\n";
    };
    EXPECT_TRUE(findPlaySpace(tracerOf(scene), options, 1, context));
    return warnings;
  };
  EXPECT_EQ(warningsOf(walks(1000)), "") << "a level without either";
  scene.cameras.push_back(lookAt({0, 0, 1e6f}, {0, 0, 2e6f}));
  scene.cameras[0].name = "eye";
  EXPECT_NE(warningsOf(walks(1000)).find("nothing can be seen from camera \"eye\""), std::string::npos);
  for (const char* name : {"stage", "hall", "c", "d", "e"}) {
    glm::mat4 far(1.0f);
    far[3] = glm::vec4(1e6f, 0.0f, 0.0f, 1.0f);
    scene.volumes.push_back({name, far});
  }
  EXPECT_NE(warningsOf(walks(1000)).find(R"(play volumes "stage", "hall", "c", "d" and 1 more, so all free space)"),
            std::string::npos);
  PlaySpaceOptions all;
  all.mode = PlaySpaceOptions::Mode::all;
  EXPECT_EQ(warningsOf(all), "") << "keeps every surface";
  scene.volumes.front().toWorld = glm::mat4(1.0f);
  scene.volumes.front().toWorld[3] = glm::vec4(2.0f, 1.5f, 2.0f, 1.0f);
  EXPECT_EQ(warningsOf(walks(1000)), "") << "one of them is in a room";
}

TEST(PlaySpace, allKeepsEverySide) {
  const Scene scene = twoRooms();
  PlaySpaceOptions options;
  options.mode = PlaySpaceOptions::Mode::all;
  const PlaySpace space = spaceOf(tracerOf(scene), options);
  EXPECT_EQ(space.seenTotal, space.total);
  for (std::uint32_t side = 0; side < 2 * scene.triangleCount(); ++side) {
    EXPECT_TRUE(space.seenAt(side, {0.3f, 0.3f}));
    EXPECT_TRUE(space.isVisible(side));
  }
}

TEST(PlaySpace, sameResultAtAnyThreadCount) {
  const Scene scene = twoRooms();
  const RayTracer tracer = tracerOf(scene);
  const PlaySpace one = spaceOf(tracer, walks(50000), 1), many = spaceOf(tracer, walks(50000), 4);
  EXPECT_TRUE(one.seenArea == many.seenArea);
  EXPECT_TRUE(one.flags == many.flags);
  EXPECT_EQ(one.receivers, many.receivers);
  EXPECT_EQ(one.voxels, many.voxels);
}

TEST(PlaySpace, nothingToSeeIsAnError) {
  Scene scene;
  Mesh degenerate;
  degenerate.position = {{0, 0, 0}, {1, 0, 0}};
  degenerate.triangle = {{0, 1, 1}};
  addInstance(scene, degenerate);
  finish(scene);
  const RayTracer tracer = tracerOf(scene);
  Context context;
  const auto space = findPlaySpace(tracer, {}, 1, context);
  ASSERT_FALSE(space);
  EXPECT_EQ(space.error().code, ErrorCode::failed);
  Context cancelled;
  cancelled.cancel();
  const Scene rooms = twoRooms();
  const RayTracer roomTracer = tracerOf(rooms);
  EXPECT_FALSE(findPlaySpace(roomTracer, {}, 1, cancelled));
}

TEST(PlaySpace, aQuarterOfSponzaHoldsNearlyAllHits) {
  const std::filesystem::path path = std::filesystem::path(RELUME_SHARED_DIR) / "scenes/sponza/sponza.glb";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "needs " << path << " (RELUME_SHARED_DIR)";
  Context context;
  const auto scene = importGltf(path, context);
  ASSERT_TRUE(scene) << scene.error().message;
  const RayTracer tracer = tracerOf(*scene);
  const PlaySpace space = spaceOf(tracer);
  EXPECT_LT(space.seenTotal, 0.3 * 0.5 * space.total);
  // Rays in other directions, from receivers and cameras.
  std::size_t hits = 0, seen = 0;
  for (std::uint64_t i = 0; i < 100000; ++i) {
    RandomStream random(42, 7, i);
    const glm::vec3 p = i % 2 == 0 ? space.receivers[random.below(static_cast<std::uint32_t>(space.receivers.size()))]
                                   : glm::vec3(scene->cameras[i / 2 % scene->cameras.size()].toWorld[3]);
    const glm::vec2 u = random.uniform2();
    const float z = 1 - 2 * u.x, r = std::sqrt(1 - z * z), a = 6.2831853f * u.y;
    const Hit hit = tracer.trace({p, 0.0f, {r * std::cos(a), r * std::sin(a), z}});
    if (!hit) continue;
    ++hits;
    const std::uint32_t triangle = scene->instances[hit.instance].firstTriangle + hit.triangle;
    seen += space.seenAt(2 * triangle + (hit.back ? 1 : 0), hit.barycentric);
  }
  EXPECT_GT(static_cast<double>(seen) / static_cast<double>(hits), 0.985);
}

}  // namespace
}  // namespace relume
