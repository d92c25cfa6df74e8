// SPDX-License-Identifier: MIT
// Cones through the voxels of a level without a bake, which OpenGL or the CPU lights: what surfaces mirror, and how
// open their surroundings are, of the light, the cells and the places of the last frame.
#include "tests/long_tests.h"
#include "tests/view/session_fixture.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace relume {
namespace {

using namespace test;

class ConeSession : public LiveSession {
 protected:
  bool hasCones() const {
    const auto& times = session_->viewer->times();
    return std::any_of(times.begin(), times.end(), [](const auto& time) { return time.first == "cones"; });
  }
  double settled(int count) {
    for (int i = 1; i < count; ++i) frame();
    return frame();
  }
  // Of the last frame, before it was made for the screen: mean over pixels and channels.
  double energy() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      if (i % 4 == 3) continue;
      sum -= std::log(1.0 - std::min(static_cast<double>(srgbToLinear(pixels_[i])), 0.9999));
    }
    return sum / (3.0 * kWidth * kHeight);
  }
  // Mean difference of the last frame's pixels from those of another, of their mean.
  double differenceFrom(const std::vector<float>& other) const {
    double sum = 0.0, all = 0.0;
    for (std::size_t i = 0; i < pixels_.size(); ++i) {
      if (i % 4 == 3) continue;
      sum += static_cast<double>(std::abs(pixels_[i] - other[i]));
      all += static_cast<double>(other[i]);
    }
    return sum / all;
  }
  void light(BackendKind backend) {
    session_->state.live.backend = backend;
    session_->endControls(false);
  }
};

class ConesByBackend : public ConeSession, public testing::WithParamInterface<BackendKind> {};

INSTANTIATE_TEST_SUITE_P(Backends, ConesByBackend, testing::Values(BackendKind::gl, BackendKind::cpu),
                         [](const auto& test) { return test.param == BackendKind::gl ? "OpenGl" : "Cpu"; });

TEST_P(ConesByBackend, findWhatIsMirroredAndHowOpenPlacesAre) {
  options_.live.backend = GetParam();
  options_.view = "glossy";
  options_.roughness = 0.3f;
  show(6);
  const double caches = frame();
  session_->state.cones = true;
  const double cones = frame();
  EXPECT_GT(cones, 0.01);
  EXPECT_NE(cones, caches);
  EXPECT_TRUE(hasCones());
  // A wider lobe mirrors other light; the level without gloss shows none.
  session_->state.roughness = 0.6f;
  EXPECT_NE(frame(), cones);
  session_->state.mode = ViewMode::full;
  frame();
  EXPECT_FALSE(hasCones()) << "nothing mirrors";
  const double plain = frame();
  session_->state.reflectance = 0.5f;
  EXPECT_NE(frame(), plain);
  EXPECT_TRUE(hasCones());

  session_->state.mode = ViewMode::occlusion;
  const double open = settled(5);
  EXPECT_TRUE(hasCones());
  EXPECT_GT(open, 0.05);
  EXPECT_FALSE(session_->viewer->memory().empty());
  // It does not depend on lights.
  for (ViewedLight& light : session_->state.lights) light.on = false;
  frame();
  EXPECT_NEAR(frame(), open, 0.05 * open);
  // Nor on the exposure, as it is no light.
  session_->state.exposure = 2.0f;
  EXPECT_NEAR(frame(), open, 0.05 * open);
  EXPECT_FALSE(says("cones"));
}

TEST_P(ConesByBackend, goWithTheirSwitch) {
  options_.live.backend = GetParam();
  options_.view = "glossy";
  options_.roughness = 0.3f;
  show(40);
  const std::vector<float> caches = pixels_;
  for (int i = 0; i < 2; ++i) {
    session_->state.cones = true;
    settled(2);
    EXPECT_TRUE(hasCones());
    EXPECT_GT(differenceFrom(caches), 0.1);
    session_->state.cones = false;
    settled(2);
    EXPECT_FALSE(hasCones());
    EXPECT_LT(differenceFrom(caches), 0.02);
    EXPECT_EQ(GetParam() == BackendKind::gl, !session_->viewer->live()->volumes().empty()) << "voxels nobody wants";
  }
}

// Other voxels: a table elsewhere, more cells. Each is what a viewer that has never seen others shows.
TEST_P(ConesByBackend, followObjectsAndCells) {
  if (GetParam() == BackendKind::cpu && !longTests()) GTEST_SKIP() << "RELUME_LONG_TESTS=1 runs it";
  options_.live.backend = GetParam();
  options_.view = "occlusion";
  const auto lift = [&] {
    const std::size_t table = objectNamed("table");
    ASSERT_LT(table, session_->state.objects.size());
    session_->state.objects[table].position.y += 0.4f;
  };
  show(24);
  const std::vector<float> first = pixels_;
  lift();
  settled(60);
  const std::vector<float> lifted = pixels_;
  EXPECT_GT(differenceFrom(first), 0.01);
  session_->state.live.cells = 24;
  session_->endControls(false);
  settled(60);
  const std::vector<float> finer = pixels_;
  EXPECT_GT(differenceFrom(lifted), 0.01);

  session_.reset();
  options_.live.cells = 24;
  show(1);
  lift();
  settled(60);
  EXPECT_LT(differenceFrom(finer), 0.005);
}

// At the window's own pace, and where light has settled or is frozen, so that no frame of it was to come.
TEST_P(ConesByBackend, comeToLightThatRests) {
  options_.live.backend = GetParam();
  options_.view = "glossy";
  options_.roughness = 0.3f;
  start("");
  ASSERT_TRUE(frames([&] { return session_->viewer && session_->viewer->live()->last().isSettled; }));
  session_->state.cones = true;
  ASSERT_TRUE(frames([&] { return hasCones(); }));
  ASSERT_TRUE(frames([&] { return !session_->isMoving(); }));
  frame();
  const std::vector<float> moving = pixels_;
  session_->state.cones = false;
  frame();
  EXPECT_FALSE(hasCones());

  session_->state.relight = false;
  for (ViewedLight& light : session_->state.lights) light.on = false;
  frame();
  session_->state.cones = true;
  ASSERT_TRUE(frames([&] { return hasCones(); }));
  EXPECT_FALSE(session_->isMoving());
  EXPECT_LT(differenceFrom(moving), 0.01) << "of the lamps that the frozen light is of";
}

// Several volumes in one another: cones see the inner ones too, whoever lights them, and as the eye goes on.
TEST_F(ConeSession, goThroughVolumesInOneAnother) {
  if (!longTests()) GTEST_SKIP() << "RELUME_LONG_TESTS=1 runs it";
  options_.view = "occlusion";
  options_.live.cells = 12;
  show(24);
  const std::vector<float> one = pixels_;
  session_->state.live.cascades = 2;
  session_->endControls(false);
  settled(40);
  EXPECT_TRUE(hasCones());
  const std::vector<float> nested = pixels_;
  EXPECT_GT(differenceFrom(one), 0.03);
  light(BackendKind::gl);
  settled(40);
  EXPECT_TRUE(hasCones());
  EXPECT_LT(differenceFrom(nested), 0.01);
  // There and back
  const glm::vec3 eye = session_->state.camera.position;
  session_->state.camera.position += glm::vec3(0.7f, 0.0f, 0.0f);
  settled(2);
  session_->state.camera.position = eye;
  settled(40);
  EXPECT_LT(differenceFrom(nested), 0.01);
}

// Shadows by rays and by the window's maps: the same light but for what maps miss.
TEST_F(ConeSession, byTheCpusLightAgreeWithOpenGls) {
  options_.view = "glossy";
  options_.roughness = 0.3f;
  options_.exposure = -1.0f;
  options_.cones = true;
  show(24);
  const double mirrored = energy();
  ASSERT_GT(mirrored, 0.005);
  const auto brighten = [&](float factor) {
    for (ViewedLight& light : session_->state.lights) light.light.intensity *= factor;
  };
  brighten(3.0f);
  settled(24);
  const double brighter = energy();
  EXPECT_NEAR(brighter, 3.0 * mirrored, 0.09 * mirrored);
  session_->state.mode = ViewMode::occlusion;
  settled(12);
  const double open = energy();
  ASSERT_GT(open, 0.05);

  light(BackendKind::gl);
  settled(25);
  EXPECT_NEAR(energy(), open, 0.01 * open);
  session_->state.mode = ViewMode::glossy;
  frame();
  EXPECT_TRUE(hasCones());
  EXPECT_NEAR(energy(), brighter, 0.03 * brighter);
  brighten(1.0f / 3.0f);
  settled(24);
  EXPECT_NEAR(energy(), mirrored, 0.03 * mirrored);
  // And back.
  light(BackendKind::cpu);
  settled(25);
  EXPECT_NEAR(energy(), mirrored, 0.01 * mirrored);
}

}  // namespace
}  // namespace relume
