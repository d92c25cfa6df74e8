// SPDX-License-Identifier: MIT
// What a flying camera sees is what the level's camera sees that it was taken from; where it cannot, a warning says so.
#include "tools/view/fly_camera.h"

#include "tools/render/view_options.h"
#include "tools/view/view_state.h"

#include <gtest/gtest.h>
#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <cmath>

namespace relume {
namespace {

constexpr float kAspect = 1.5f, kNear = 0.1f, kFar = 100.0f;
constexpr glm::vec3 kEye(23.7f, 11.3f, -41.9f);

// Turned to the left, then raised [rad].
Camera cameraAt(const glm::vec3& eye, float yaw, float pitch) {
  Camera camera;
  camera.toWorld = glm::rotate(glm::rotate(glm::translate(glm::mat4(1.0f), eye), yaw, {0, 1, 0}), pitch, {1, 0, 0});
  return camera;
}

glm::mat4 clipOf(const Camera& camera) {
  return glm::perspective(camera.yfovRad, kAspect, kNear, kFar) * glm::inverse(camera.toWorld);
}

glm::vec2 pixel(const glm::mat4& clip, const glm::vec3& world) {
  const glm::vec4 p = clip * glm::vec4(world, 1.0f);
  return glm::vec2(p) / p.w;
}

// The largest distance of a point of the view in one from where it is in the other, half the picture's height being 1.
float distanceOfViews(const Camera& camera, const glm::mat4& clip) {
  float most = 0.0f;
  for (const glm::vec3& local :
       {glm::vec3(0, 0, -5), glm::vec3(2, 1, -5), glm::vec3(-1, 2, -6), glm::vec3(1, -1, -3)}) {
    const glm::vec3 world(camera.toWorld * glm::vec4(local, 1.0f));
    const float distance = glm::distance(pixel(clip, world), pixel(clipOf(camera), world));
    if (!(distance <= most)) most = distance;  // what is no number stays
  }
  return most;
}

TEST(FlyCamera, seesWhatALevelsCameraSees) {
  for (const float yaw : {0.0f, 0.7f, -2.9f}) {
    for (const float pitch : {0.0f, 0.4f, -1.5f}) {
      const Camera camera = cameraAt(kEye, yaw, pitch);
      EXPECT_LT(distanceOfViews(camera, FlyCamera::from(camera).clipFromWorld(kAspect, kNear, kFar)), 1e-4f)
          << yaw << " " << pitch;
    }
  }
}

// It looks up and down but for a hundredth of the picture, the same way round.
TEST(FlyCamera, looksStraightUpAndDown) {
  for (const float yaw : {0.0f, 0.7f, -2.9f}) {
    for (const float side : {-1.0f, 1.0f}) {
      // As a file may have it: no number is rounded.
      const glm::vec3 right(std::cos(yaw), 0.0f, -std::sin(yaw)), back(0.0f, -side, 0.0f);
      Camera camera;
      camera.toWorld =
          glm::mat4(glm::vec4(right, 0), glm::vec4(glm::cross(back, right), 0), glm::vec4(back, 0), glm::vec4(kEye, 1));
      FlyCamera fly = FlyCamera::from(camera);
      EXPECT_LT(distanceOfViews(camera, fly.clipFromWorld(kAspect, kNear, kFar)), 0.05f) << yaw << " " << side;
      // Pictures of the same view that are traced
      const Camera traced = lookAt(fly.position, fly.position + fly.forward(), fly.yfovRad);
      EXPECT_LT(distanceOfViews(traced, fly.clipFromWorld(kAspect, kNear, kFar)), 1e-2f) << yaw << " " << side;
      fly.turn(0.0f, side);
      EXPECT_LT(distanceOfViews(camera, fly.clipFromWorld(kAspect, kNear, kFar)), 0.05f) << "and no further";
    }
  }
}

TEST(FlyCamera, anOrthographicCameraIsWarnedOfWhereItIsChosen) {
  Scene scene;
  scene.cameras.resize(2);
  scene.cameras[0].name = "plan";
  scene.cameras[0].orthographic = true;
  scene.cameras[1].name = "eye";
  scene.cameras[1].node = "head";
  ViewerOptions options;
  for (const char* const name : {"", "plan"}) {
    options.camera = name;
    const auto warning = cameraWarning(scene, options);
    ASSERT_TRUE(warning);
    EXPECT_EQ(warning->find("camera \"plan\" is orthographic"), 0u) << *warning;
  }
  for (const char* const name : {"eye", "head", "nobody"}) {
    options.camera = name;
    EXPECT_FALSE(cameraWarning(scene, options)) << name;
  }
  EXPECT_FALSE(cameraWarning(Scene(), ViewerOptions()));
}

TEST(FlyCamera, startsAtTheCameraOfTheNodeThatIsNamed) {
  Scene scene;
  scene.cameras = {cameraAt(kEye, 0.0f, 0.0f), cameraAt(-kEye, 0.0f, 0.0f)};
  scene.cameras[0].name = scene.cameras[1].node = "B";  // Blender's object A has the data B, and B has A
  scene.cameras[1].name = scene.cameras[0].node = "A";
  scene.lights.resize(2);
  scene.lights[0].name = scene.lights[1].node = "D";
  scene.lights[1].name = scene.lights[0].node = "C";
  ViewerOptions options;
  for (const int i : {0, 1}) {
    options.camera = scene.cameras[static_cast<std::size_t>(i)].node;
    options.lights = {scene.lights[static_cast<std::size_t>(i)].node};
    const auto state = initialState(scene, options);
    ASSERT_TRUE(state) << state.error().message;
    EXPECT_EQ(state->camera.position, i == 0 ? kEye : -kEye);
    EXPECT_EQ(state->lights[0].on, i == 0);
    EXPECT_EQ(state->lights[1].on, i == 1);
    EXPECT_FALSE(cameraWarning(scene, options));
  }
  scene.cameras[0].node = "B";
  const auto warning = cameraWarning(scene, options);
  ASSERT_TRUE(warning);
  EXPECT_EQ(warning->find("--camera: \"B\" is the name of several cameras"), 0u) << *warning;
}

}  // namespace
}  // namespace relume
