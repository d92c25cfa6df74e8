// SPDX-License-Identifier: MIT
// A baked level that was edited: its old bake's light, corrected by live light near what changed, against path tracing
// of the level as it is.
#include "bake/reference/path_tracer.h"
#include "relume/bake/bake.h"
#include "tests/render/pictures.h"
#include "tests/render/walled_room.h"
#include "tools/compare/find_edits.h"
#include "tools/compare/staleness.h"
#ifdef RELUME_RENDER_GL
#include "tools/render/render_gl.h"
#endif

#include <gtest/gtest.h>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>

#include <cmath>
#include <cstddef>
#include <vector>

namespace relume {
namespace {

using test::addInstance;
using test::box;
using test::finish;
using test::kWall;

// Two rooms with a wall between them, a lamp in the left one, a box in the right one.
Scene twoRooms() {
  Scene scene;
  const std::uint32_t grey = test::addWalledRoom(scene);
  addInstance(scene, box({2.2f, 0, -0.4f}, {2.9f, 0.8f, 0.4f}, false, grey));
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) scene.meshes[i].name = "box" + std::to_string(i);
  for (const float x : {-3.6f, 3.6f}) {
    scene.cameras.push_back(test::lookAt({x, 2.0f, 1.7f}, {0.3f * x, 1.2f, -1.5f}));
    scene.cameras.back().name = x < 0 ? "left" : "right";
  }
  scene.lights = {test::lampOfWalledRoom()};
  finish(scene);
  return scene;
}

// The level that was baked, the one that it has become, and the old bake read by that.
struct Edited {
  Scene before, now;
  Bake bake;
  FoundEdits edits;
  RenderRequest request;

  explicit Edited(Scene edited, Scene baked = twoRooms())
      : before(std::move(baked)), now(std::move(edited)), bake(test::bakeDraft(before)) {
    edits = findEdits(before, now);
    fitToScene(now, bake);
    request.bake = &bake;
    request.edited = &edits.level;
    edits.level.live.cells = 16;
    request.lights = now.lights;
    request.emissive = true;
    request.width = 64;
    request.height = 40;
    request.samples = 1;
    request.centres = true;
  }
  RenderedFrame draw(const std::string& camera, bool blends = true) {
    RenderRequest asked = request;
    asked.camera = test::camera(now, camera);
    if (!blends) asked.edited = nullptr;
    auto frame = test::drawCpu(now, asked, 2);
    EXPECT_TRUE(frame) << frame.error().message;
    return std::move(*frame);
  }
  // Squared difference from path tracing of the level as it is.
  double error(const RenderedFrame& frame, const std::string& camera) {
    if (traced_.empty()) {
      Context context;
      auto tracer = RayTracer::create(now, "", context, RayStructure::quick, RayGeometry::drawn);
      EXPECT_TRUE(tracer);
      ReferenceOptions options;
      options.width = request.width;
      options.height = request.height;
      options.samplesPerPixel = 256;
      auto image = renderReference(*tracer, test::camera(now, camera), now.lights, options, context);
      EXPECT_TRUE(image);
      traced_ = image->indirect;
    }
    const std::vector<glm::vec3> drawn = composeAov(frame, Aov::indirect);
    const auto a = test::blocks(drawn, request.width), b = test::blocks(traced_, request.width);
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += static_cast<double>(glm::dot(a[i] - b[i], a[i] - b[i]));
    return sum;
  }

 private:
  std::vector<glm::vec3> traced_;
};

Scene withoutWall() {
  Scene scene = twoRooms();
  scene.instances.erase(scene.instances.begin() + kWall);
  finish(scene);
  return scene;
}

Scene withMovedWall() {
  Scene scene = twoRooms();
  scene.instances[kWall].toWorld[3].x = 1.2f;
  finish(scene);
  return scene;
}

// A bulb is all the light that the room has.
Scene withBulb() {
  Scene scene = twoRooms();
  scene.lights.clear();
  const std::uint32_t glowing = test::addMaterial(scene, glm::vec3(0.5f), glm::vec3(300.0f));
  addInstance(scene, box({-3.6f, 2.0f, -1.6f}, {-3.4f, 2.2f, -1.4f}, false, glowing));
  finish(scene);
  return scene;
}

// A ground that is a hundred times as wide, below the rooms, which are what is played in.
Scene onGround(Scene scene) {
  addInstance(scene, box({-500, -3, -500}, {500, -2, 500}, false, 0));
  finish(scene);
  scene.volumes.push_back({"rooms", glm::scale(glm::translate(glm::mat4(1), {0, 2, 0}), {7.8f, 3.8f, 3.8f})});
  return scene;
}

double indirectOf(const RenderedFrame& frame) {
  double sum = 0.0;
  for (const glm::vec3& light : composeAov(frame, Aov::indirect))
    sum += static_cast<double>(light.x + light.y + light.z);
  return sum;
}

// The dark room behind a wall that is no longer there.
TEST(EditedLight, errsLessWhereAWallWasTakenAway) {
  Edited level(withoutWall());
  ASSERT_EQ(level.edits.level.bounds.size(), 1u);
  const double stale = level.error(level.draw("right", false), "right"),
               blended = level.error(level.draw("right"), "right");
  EXPECT_LT(blended, 0.2 * stale) << stale;
}

TEST(EditedLight, errsLessWhereAWallWasMoved) {
  Edited level(withMovedWall());
  ASSERT_EQ(level.edits.level.bounds.size(), 2u) << "where it was and where it is";
  EXPECT_EQ(level.edits.level.isChanged, (std::vector<std::uint8_t>{0, 1, 0}));
  const double stale = level.error(level.draw("left", false), "left"),
               blended = level.error(level.draw("left"), "left");
  EXPECT_LT(blended, 0.35 * stale) << stale;
}

// The light of a part that emits goes farther than what it hides.
TEST(EditedLight, goesWithAnEmitterThatWasTakenAway) {
  Scene dark = twoRooms();
  dark.lights.clear();
  Edited level(std::move(dark), withBulb());
  const double stale = indirectOf(level.draw("left", false));
  ASSERT_GT(stale, 0.0);
  EXPECT_LT(indirectOf(level.draw("left")), 0.1 * stale);
  level.edits.level.blend.reach = 0.5f;
  EXPECT_GT(indirectOf(level.draw("left")), 0.5 * stale) << "a reach that is asked for holds";
}

TEST(EditedLight, liesAboutThePlayVolumesOfAVastLevel) {
  Edited rooms(withMovedWall()), vast(onGround(withMovedWall()), onGround(twoRooms()));
  EXPECT_NEAR(indirectOf(vast.draw("left")) / indirectOf(rooms.draw("left")), 1.0, 0.1);
}

TEST(EditedLight, isTheBakesToTheBitFarFromTheEdit) {
  Edited level(withMovedWall());
  level.edits.level.blend.reach = 0.5f;
  level.edits.level.blend.fade = 0.5f;
  const auto blend = EditBlend::create(level.edits.level.bounds, level.edits.level.blend);
  ASSERT_TRUE(blend);
  const RenderedFrame stale = level.draw("left", false), blended = level.draw("left");
  std::size_t far = 0, changed = 0;
  for (std::size_t i = 0; i < stale.indirect.size(); ++i) {
    // No sub-pixel of it is nearer than a pixel's width.
    bool isFar = true;
    for (const glm::vec3& off : {glm::vec3(0.3f, 0, 0), glm::vec3(-0.3f, 0, 0)})
      isFar = isFar && blend->share(stale.position[i] + off).change == 0.0f;
    if (isFar) {
      ASSERT_EQ(stale.indirect[i], blended.indirect[i]) << i;
      ++far;
    }
    changed += stale.indirect[i] != blended.indirect[i] ? 1 : 0;
  }
  EXPECT_GT(far, stale.indirect.size() / 10);
  EXPECT_GT(changed, stale.indirect.size() / 10);
}

TEST(EditedLight, isTheSameOnAnyNumberOfThreads) {
  Edited level(withMovedWall());
  RenderRequest asked = level.request;
  asked.camera = test::camera(level.now, "left");
  const auto one = test::drawCpu(level.now, asked, 1), three = test::drawCpu(level.now, asked, 3);
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->indirect, three->indirect);
}

#ifdef RELUME_RENDER_GL
TEST(EditedLight, openGlDrawsWhatTheCpuDraws) {
  Edited level(withMovedWall());
  RenderRequest asked = level.request;
  asked.camera = test::camera(level.now, "left");
  Context context;
  const auto gl = renderGl(level.now, asked, context);
  if (!gl && gl.error().code == ErrorCode::unsupported) GTEST_SKIP() << gl.error().message;
  ASSERT_TRUE(gl) << gl.error().message;
  const RenderedFrame cpu = level.draw("left"), stale = level.draw("left", false);
  EXPECT_LT(test::relativeRms(cpu.indirect, gl->indirect), 0.015);
  EXPECT_GT(test::relativeRms(cpu.indirect, stale.indirect), 0.2) << "the test's edit changes next to nothing";
}
#endif

// What moves is no edit, what is coloured anew is one, and a level that is as it was has none.
TEST(FindEdits, tellsEditsFromWhatMoves) {
  Scene before = twoRooms();
  before.instances[2].mode = BakeMode::dynamic;
  Scene now = before;
  now.instances[2].toWorld[3].x = -1.0f;
  EXPECT_TRUE(findEdits(before, now).none());

  now.materials[1].albedo = glm::vec3(0.1f);
  const FoundEdits painted = findEdits(before, now);
  EXPECT_EQ(painted.level.isChanged, (std::vector<std::uint8_t>{0, 1, 0}));
  EXPECT_EQ(painted.level.before.instances[2].toWorld[3].x, -1.0f) << "voxels of both have it where it is";

  addInstance(now, box({3, 0, 1}, {3.5f, 1, 1.5f}, false, 0));
  finish(now);
  const FoundEdits added = findEdits(before, now);
  EXPECT_EQ(added.level.isChanged, (std::vector<std::uint8_t>{0, 1, 0, 1}));
  EXPECT_EQ(added.level.bounds.back().max, glm::vec3(3.5f, 1, 1.5f));
  EXPECT_EQ(added.level.bounds.back().reach, 0.0f);

  // Whose light goes through all of the level.
  const FoundEdits bulb = findEdits(twoRooms(), withBulb());
  EXPECT_FLOAT_EQ(bulb.level.bounds.back().reach, std::sqrt(8.0f * 8.0f + 4.0f * 4.0f + 4.0f * 4.0f));
}

}  // namespace
}  // namespace relume
