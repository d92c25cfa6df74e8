// SPDX-License-Identifier: MIT
// A level without a bake in the viewer: lit at once, as the CPU has it, and after what is dragged; until a bake of it
// is there.
#include "bake/reference/path_tracer.h"
#include "tests/view/session_fixture.h"
#include "tools/render/view_options.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

namespace relume {
namespace {

using namespace test;

// Fragments read the caches as NestedCaches::irradiance() does: of one volume, and of three in one another.
class LiveSessionOfVolumes : public LiveSession, public testing::WithParamInterface<std::uint32_t> {};
INSTANTIATE_TEST_SUITE_P(OneAndThree, LiveSessionOfVolumes, testing::Values(1u, 3u));

TEST_P(LiveSessionOfVolumes, openGlReadsTheLightAsTheCpuDoes) {
  options_.live.cascades = GetParam();
  show(0);
  constexpr int kFrames = 6;
  for (int i = 0; i < kFrames; ++i) frame();
  ViewState state = session_->state;
  state.direct = false;
  const std::vector<glm::vec3> shown = *session_->viewer->irradiance(state, kWidth, kHeight);

  // The same frames by the library alone
  const Scene level = scene();
  Context context;
  auto live = LiveLevel::create(level, options_.live, context, state.camera.position);
  ASSERT_TRUE(live);
  ASSERT_EQ(live->volumes().size(), GetParam());
  LiveScene lit;
  for (const ViewedLight& light : state.lights) {
    if (light.on) lit.lights.push_back(light.light);
  }
  lit.emission = state.emission;
  const auto drawn = static_cast<std::uint64_t>(session_->viewer->live()->last().number);
  for (std::uint64_t i = 0; i < drawn; ++i) ASSERT_TRUE(live->update(lit, state.liveStep));

  auto tracer = RayTracer::create(level, "", context, RayStructure::quick, RayGeometry::drawn);
  ASSERT_TRUE(tracer);
  ReferenceOptions options;
  options.width = kWidth;
  options.height = kHeight;
  options.samplesPerPixel = 1;
  options.maxBounces = 0;
  const Camera camera =
      lookAt(state.camera.position, state.camera.position + state.camera.forward(), state.camera.yfovRad);
  const auto image = renderReference(*tracer, camera, {}, options, context);
  ASSERT_TRUE(image);
  std::size_t pixels = 0, off = 0;
  double sum = 0.0;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    if (image->depth[i] == 0.0f) continue;
    const glm::vec3 expected =
        std::numbers::inv_pi_v<float> * live->light().irradiance(image->position[i], image->normal[i]);
    ++pixels;
    sum += static_cast<double>(expected.g);
    if (glm::distance(shown[i], expected) > 0.01f * glm::length(expected) + 1e-4f) ++off;
  }
  EXPECT_GT(sum / static_cast<double>(pixels), 0.01);
  // Along edges, and where a ray runs along the face of a voxel, the two may go different ways.
  EXPECT_LT(static_cast<double>(off), 0.03 * static_cast<double>(pixels));
}

TEST_F(LiveSession, aWindowThatDoesNotWaitIsLitAsWell) {
  start("");
  bool isSaid = false;  // news goes after a while
  ASSERT_TRUE(frames([&] {
    isSaid = isSaid || says("without a bake");
    return session_->viewer && session_->viewer->live()->last().isSettled;
  }));
  EXPECT_TRUE(isSaid);
  EXPECT_FALSE(session_->job.has_value()) << "nothing is baked unless it is asked for";
  const double free = brightness_;
  EXPECT_GT(free, 0.01);
  // Waiting for each frame comes to the same light.
  session_->state.liveStep = 1.0 / 15.0;
  for (int i = 0; i < 40; ++i) frame();
  EXPECT_NEAR(brightness_, free, 0.1 * free);
}

TEST_F(LiveSession, lightFollowsALamp) {
  show(40);
  const double before = meanLight();
  const LitFrame& last = session_->viewer->live()->last();
  EXPECT_GT(last.voxels, 100u);
  EXPECT_GT(last.caches, 100u);
  for (ViewedLight& light : session_->state.lights) {
    if (light.on) light.light.intensity *= 3.0f;
  }
  for (int i = 0; i < 40; ++i) frame();
  EXPECT_NEAR(meanLight(), 3.0 * before, 0.05 * before);
}

// Frames in OpenGL, shadows by the window's maps: the CPU's light, by rays, to what the maps miss.
TEST_F(LiveSession, openGlFollowsLampsObjectsAndCells) {
  show(40);
  const double byCpu = meanLight();
  ASSERT_GT(byCpu, 0.01);

  // The panel's switch: light stays until the other's is there.
  session_->state.live.backend = BackendKind::gl;
  session_->endControls(false);
  for (int i = 0; i < 41; ++i) frame();
  const LitFrame& last = session_->viewer->live()->last();
  EXPECT_NEAR(meanLight(), byCpu, 0.05 * byCpu);
  EXPECT_GT(last.voxels, 100u);
  EXPECT_GT(last.caches, 100u);
  const auto gathers = [](const std::vector<PassTime>& times) {
    return std::any_of(times.begin(), times.end(),
                       [](const PassTime& t) { return t.ms > 0.0 && !std::strcmp(t.pass, "gather"); });
  };
  EXPECT_TRUE(gathers(session_->viewer->live()->passTimes()));

  for (ViewedLight& light : session_->state.lights) {
    if (light.on) light.light.intensity *= 3.0f;
  }
  for (int i = 0; i < 40; ++i) frame();
  EXPECT_NEAR(meanLight(), 3.0 * byCpu, 0.15 * byCpu);

  // A table is lifted, and its voxels with it; both backends have it so.
  const std::size_t table = objectNamed("table");
  ASSERT_LT(table, session_->state.objects.size());
  session_->state.objects[table].position.y += 0.5f;
  for (int i = 0; i < 40; ++i) frame();
  const double lifted = meanLight();
  session_->state.live.backend = BackendKind::cpu;
  session_->endControls(false);
  for (int i = 0; i < 41; ++i) frame();
  EXPECT_NEAR(meanLight(), lifted, 0.05 * lifted);

  // Other cells, without a dark frame.
  session_->state.live.backend = BackendKind::gl;
  session_->state.live.cells = 12;
  session_->endControls(false);
  for (int i = 0; i < 5; ++i) {
    frame();
    EXPECT_GT(meanLight(), 0.3 * lifted) << i;
  }
}

// Volumes in one another, which go with the eye: the light is the CPU's, here and there.
TEST_F(LiveSession, openGlLightsVolumesAboutTheEye) {
  options_.live.cascades = 2;
  options_.live.cells = 12;
  options_.live.rays = 16;
  const auto goAndLook = [&](float x) {
    session_->state.camera.position.x += x;
    for (int i = 0; i < 25; ++i) frame();
    return meanLight();
  };
  show(0);
  const double here = goAndLook(0.0f), there = goAndLook(1.5f);
  session_->state.live.backend = BackendKind::gl;
  session_->endControls(false);
  frame();
  const double onGl = goAndLook(0.0f);
  EXPECT_NEAR(onGl, there, 0.05 * there);
  const std::uint32_t voxels = session_->viewer->live()->last().voxels;
  EXPECT_NEAR(goAndLook(-1.5f), here, 0.05 * here);
  EXPECT_NE(session_->viewer->live()->last().voxels, voxels) << "no volume has moved";
}

// At the window's own pace it settles, and then no frame is made.
TEST_F(LiveSession, openGlSettles) {
  options_.live.backend = BackendKind::gl;
  start("");
  ASSERT_TRUE(frames([&] { return session_->viewer && session_->viewer->live()->last().isSettled; }));
  const std::uint64_t number = session_->viewer->live()->last().number;
  EXPECT_GT(number, 60u);
  for (int i = 0; i < 3; ++i) frame();
  EXPECT_EQ(session_->viewer->live()->last().number, number);
  EXPECT_GT(brightness_, 0.01);
}

// Frames of a film have light of their own, though the window waits for none and what is shown is at rest.
TEST_F(LiveSession, aFilmHasLightOfItsOwnInEachFrame) {
  options_.output = at("pictures");
  start("");
  ASSERT_TRUE(frames([&] { return session_->viewer && session_->viewer->live()->last().isSettled; }));
  session_->run(Command::film);
  std::uint64_t before = session_->viewer->live()->last().number;
  for (int i = 0; i < 4; ++i) {
    frame();
    const std::uint64_t now = session_->viewer->live()->last().number;
    EXPECT_GT(now, before) << i;
    before = now;
  }
  session_->run(Command::film);
  EXPECT_EQ(session_->state.liveStep, 0.0);
  ASSERT_TRUE(frames([&] { return session_->viewer->live()->last().isSettled; })) << "at the window's pace again";
}

TEST_F(LiveSession, anObjectIsPickedAndDragged) {
  options_.view = "full";
  show(10);
  ASSERT_GT(session_->state.objects.size(), 20u);
  // A click on the table picks it.
  const std::size_t table = objectNamed("table");
  ASSERT_LT(table, session_->state.objects.size());
  const glm::vec3 home = session_->state.objects[table].home;
  const auto at = session_->pixels().project(home + glm::vec3(0, 0.02f, 0));
  ASSERT_TRUE(at);
  session_->press(*at);
  session_->release();
  frame();
  ASSERT_TRUE(session_->objects.selected().has_value());
  const std::size_t picked = *session_->objects.selected();
  const glm::vec3 start = session_->state.objects[picked].position;

  // Its vertical axis lifts it, and lifts it alone.
  const auto gizmo = session_->objects.gizmo(session_->state.objects, session_->pixels());
  ASSERT_TRUE(gizmo);
  const auto axis = gizmo->outline(Handle::axisY);
  const glm::vec2 handle = *session_->pixels().project(0.3f * axis[0] + 0.7f * axis[1]);
  const double before = frame();
  session_->press(handle);
  session_->move(handle + glm::vec2(0, -12));
  session_->release();
  const ViewedObject& lifted = session_->state.objects[picked];
  EXPECT_EQ(lifted.position.x, start.x);
  EXPECT_EQ(lifted.position.z, start.z);
  EXPECT_GT(lifted.position.y, start.y + 0.05f);
  for (int i = 0; i < 5; ++i) frame();
  EXPECT_NE(brightness_, before);
  const glm::vec3 there = lifted.position;
  session_->run(Command::undo);
  EXPECT_EQ(session_->state.objects[picked].position, start);
  session_->run(Command::redo);
  EXPECT_EQ(session_->state.objects[picked].position, there);
  // What is dragged goes back by Escape.
  session_->press(*session_->pixels().project(lifted.position + 0.7f * (axis[1] - axis[0])));
  session_->move(handle + glm::vec2(0, -30));
  EXPECT_NE(session_->state.objects[picked].position, there);
  session_->run(Command::cancel);
  EXPECT_EQ(session_->state.objects[picked].position, there);
  session_->run(Command::cancel);
  EXPECT_FALSE(session_->objects.selected());
}

TEST_F(LiveSession, whatCannotBeLitIsToldAndTheLightStays) {
  show(10);
  const double before = brightness_;
  session_->state.objects[0].position.x = std::numeric_limits<float>::quiet_NaN();
  frame();
  EXPECT_TRUE(says("toWorld"));
  session_->state.objects[0].position = session_->state.objects[0].home;
  EXPECT_NEAR(frame(), before, 0.1 * before);
}

TEST_F(LiveSession, otherCellsTakeOverWithoutADarkFrame) {
  show(20);
  const double before = brightness_;
  const std::uint32_t caches = session_->viewer->live()->last().caches;
  session_->state.liveStep = 0.0;
  session_->state.live.cells = 24;
  session_->endControls(true);
  EXPECT_EQ(session_->viewer->live()->options().cells, 16u) << "a slider that is held changes nothing";
  session_->endControls(false);
  EXPECT_NEAR(frame(), before, 0.1 * before);
  ASSERT_TRUE(frames([&] { return session_->viewer->live()->last().caches > caches; }));
}

TEST_F(LiveSession, theViewIsHeldAgainstPathTracing) {
  show(90);
  // With a shelf elsewhere: both know where it is.
  const std::size_t shelf = objectNamed("shelf");
  ASSERT_LT(shelf, session_->state.objects.size());
  session_->state.objects[shelf].position.x += 0.5f;
  for (int i = 0; i < 60; ++i) frame();
  session_->compareWithReference();
  ASSERT_TRUE(frames([&] { return session_->heat.has_value(); }));
  EXPECT_GT(session_->heat->error, 0.0);
  EXPECT_LT(session_->heat->error, 0.25);
}

// Where the window's level has no bake, one that is dropped is lit at once, and baked behind that.
TEST_F(LiveSession, aDroppedLevelIsLitAndThenBaked) {
  show(10);
  const std::string other = RELUME_SOURCE_DIR "/samples/blender/cabin.glb";
  session_->drop({other});
  ASSERT_TRUE(frames([&] { return session_->level->sceneFile == other; }));
  EXPECT_FALSE(session_->level->isBaked);
  ASSERT_TRUE(session_->job.has_value());
  double furthest = 0.0;
  ASSERT_TRUE(frames([&] {
    if (session_->job) furthest = std::max(furthest, session_->job->progress().fraction);
    return session_->level->isBaked;
  }));
  EXPECT_GT(furthest, 0.0);
  EXPECT_TRUE(says("preset draft"));
  EXPECT_GT(frame(), 0.0);
  // Cancelled, the level stays as it is lit.
  session_->drop({kLevel});
  ASSERT_TRUE(frames([&] { return session_->level->sceneFile == kLevel; }));
  ASSERT_TRUE(session_->job.has_value());
  session_->job->cancel();
  ASSERT_TRUE(frames([&] { return !session_->job; }));
  EXPECT_FALSE(session_->level->isBaked);
}

// The speed of flight is a level's own; the wheel scales it until another level comes, except over the panel.
TEST_F(LiveSession, theSpeedFitsTheLevelAndTheWheelScalesIt) {
  show(1);
  const float fitting = session_->viewer->levelSize() / 6.0f;
  EXPECT_GT(fitting, 0.1f);
  EXPECT_FLOAT_EQ(session_->flySpeed.metresPerSecond(), fitting);
  session_->covered = {{{0.0f, 0.0f}, {20.0f, 20.0f}}};
  session_->scroll({10.0f, 10.0f}, 1.0f);
  EXPECT_FLOAT_EQ(session_->flySpeed.metresPerSecond(), fitting);
  const std::size_t news = session_->messages.shown().size();
  session_->scroll({30.0f, 10.0f}, 1.0f);
  session_->scroll({30.0f, 10.0f}, 1.0f);
  EXPECT_FLOAT_EQ(session_->flySpeed.metresPerSecond(), 1.5625f * fitting);
  EXPECT_TRUE(says("flies at " + session_->flySpeed.text()));
  EXPECT_EQ(session_->messages.shown().size(), news + 1) << "the last word alone is shown";
  ASSERT_TRUE(session_->show(session_->level));
  EXPECT_FLOAT_EQ(session_->flySpeed.metresPerSecond(), 1.5625f * fitting) << "it is the same level";

  const std::string other = RELUME_SOURCE_DIR "/samples/blender/cabin.glb";
  session_->drop({other});
  ASSERT_TRUE(frames([&] { return session_->level->sceneFile == other; }));
  EXPECT_FLOAT_EQ(session_->flySpeed.metresPerSecond(), session_->viewer->levelSize() / 6.0f);
}

TEST_F(LiveSession, aBakeReplacesIt) {
  show(10);
  EXPECT_EQ(session_->level->isBaked, false);
  session_->bakeDraft();
  ASSERT_TRUE(session_->job.has_value());
  const double before = brightness_;
  EXPECT_NEAR(frame(), before, 0.1 * before) << "live light goes on meanwhile";
  ASSERT_TRUE(frames([&] { return session_->level->isBaked; }));
  EXPECT_EQ(session_->viewer->live(), nullptr);
  for (int i = 0; i < 30; ++i) frame();
  EXPECT_NEAR(brightness_, before, 0.35 * before);
  EXPECT_TRUE(says("preset draft"));
}

}  // namespace
}  // namespace relume
