// SPDX-License-Identifier: MIT
// Levels of kilometres and of centimetres in the viewer: what is right before the eye is shown, and lights are put
// where there is room.
#include "tests/rays/make_scene.h"
#include "tests/view/session_fixture.h"

#include <string>
#include <utility>

namespace relume {
namespace {

using namespace test;

class SessionSizes : public LiveSession {
 protected:
  // Without a bake and in its albedo alone, from where the scene's camera is not.
  void showScene(Scene scene, const glm::vec3& eye) {
    finish(scene);
    options_.scene = at("level.glb");
    options_.camera.clear();
    options_.lights = {"none"};
    options_.view = "albedo";
    options_.live = {8, 16, 1};
    Context context;
    const auto level = loadBake(std::move(scene), {options_.scene, "", {}}, context);
    ASSERT_TRUE(level) << level.error().message;
    auto state = initialState((*level)->scene, options_);
    ASSERT_TRUE(state) << state.error().message;
    state->coarse = false;
    state->camera = FlyCamera();  // along -z
    state->camera.position = eye;
    session_.emplace(std::move(*state), options_, EglContext::getProcAddress);
    ASSERT_TRUE(session_->show(*level));
  }
  // Two kilometres of ground, and a wall across the view of an eye above its middle.
  void showWall(float distance) {
    Scene scene;
    addInstance(scene, quad({-1000, 0, 1000}, {2000, 0, 0}, {0, 0, -2000}, addMaterial(scene, glm::vec3(0.05f))));
    addInstance(scene, quad({-20, -20, -distance}, {40, 0, 0}, {0, 40, 0}, addMaterial(scene, glm::vec3(0.9f))));
    scene.instances.back().nodeIndex = 1;
    showScene(std::move(scene), {0.0f, 1.7f, 0.0f});
  }
  // [m] Of the light that is added now.
  float distanceOfNewLight() {
    session_->addLight(LightKind::point);
    return glm::distance(session_->state.lights.back().light.positionWorld, session_->state.camera.position);
  }
};

TEST_F(SessionSizes, aWideLevelShowsWhatIsRightBeforeTheEye) {
  showWall(0.5f);
  EXPECT_GT(frame(), 0.6) << "the wall is cut away";
  const auto surface = session_->viewer->surfaceAt(session_->state, 0.5f * glm::vec2(kWidth, kHeight), kWidth, kHeight);
  ASSERT_TRUE(surface);
  EXPECT_NEAR(surface->z, -0.5f, 1e-3f);
  session_->press({0.3f * kWidth, 0.4f * kHeight});
  session_->release();
  frame();
  EXPECT_EQ(session_->objects.selected(), 1u) << "a click takes hold of it";
}

TEST_F(SessionSizes, newLightsStandBeforeWalls) {
  showWall(0.5f);
  frame();
  EXPECT_NEAR(distanceOfNewLight(), 0.4f, 1e-3f);
  session_->state.camera.yawRad = 1.5f;  // along the wall, which is at 7 m there
  EXPECT_NEAR(distanceOfNewLight(), 2.0f, 1e-3f);
  session_->state.camera.pitchRad = 1.5f;  // the sky
  EXPECT_NEAR(distanceOfNewLight(), 2.0f, 1e-3f);
}

TEST_F(SessionSizes, newLightsFitASmallLevel) {
  Scene scene;
  addInstance(scene, box({0, 0, 0}, {0.03f, 0.02f, 0.03f}, true, addMaterial(scene, glm::vec3(0.5f))));
  showScene(std::move(scene), {0.015f, 0.01f, 0.025f});
  frame();
  const float distance = distanceOfNewLight();
  EXPECT_NEAR(distance, 0.2f * session_->viewer->levelSize(), 1e-4f);
  EXPECT_LT(distance, 0.025f) << "within it";
}

}  // namespace
}  // namespace relume
