// SPDX-License-Identifier: MIT
// Frames of fewer pixels while what is seen moves: alike in light, and whole again as soon as it rests.
#include "tests/view/session_fixture.h"

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

using namespace test;

class CoarseSession : public ViewerSession {
 protected:
  // A frame, where whole ones take long; returns its pixels.
  const std::vector<float>& slowFrame() {
    session_->coarse.expectSlow();
    frame();
    return pixels_;
  }
  static float greenAt(const std::vector<float>& pixels, std::uint32_t x, std::uint32_t y) {
    return pixels[4 * (std::size_t{y} * kWidth + x) + 1];
  }
  // Whether a picture has been enlarged twofold: then the texel between columns 2 i and 2 i + 1 is told alike by both
  // with the column beyond each, which has a quarter of it.
  static bool isEnlarged(const std::vector<float>& pixels) {
    std::size_t different = 0, all = 0;
    for (std::uint32_t y = 0; y < kHeight; ++y) {
      for (std::uint32_t x = 2; x + 2 < kWidth; x += 2) {
        const float left = 1.5f * greenAt(pixels, x, y) - 0.5f * greenAt(pixels, x - 1, y);
        const float right = 1.5f * greenAt(pixels, x + 1, y) - 0.5f * greenAt(pixels, x + 2, y);
        different += std::abs(left - right) > 0.03f ? 1 : 0;
        ++all;
      }
    }
    return 500 * different < all;
  }
};

TEST_F(CoarseSession, isWholeOnceTheViewRests) {
  writeBakeFile(small(512));
  options_.view = "full";
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  for (int i = 0; i < 30; ++i) frame();
  session_->state.relight = false;
  session_->state.coarse = true;
  const std::vector<float> rests = slowFrame();
  EXPECT_FALSE(isEnlarged(rests));
  const double whole = brightness_;

  session_->state.camera.yawRad += 1e-6f;
  const std::vector<float> turned = slowFrame();
  EXPECT_TRUE(isEnlarged(turned)) << "a frame while the camera turns has fewer pixels";
  EXPECT_NEAR(brightness_, whole, 0.03 * whole) << "and their light";
  const std::vector<float> after = slowFrame();
  EXPECT_FALSE(isEnlarged(after));
  EXPECT_NEAR(brightness_, whole, 1e-3 * whole);

  // So has one while a light is dragged; not where that is switched off, frames are quick or a picture is taken.
  const auto lit = std::find_if(session_->state.lights.begin(), session_->state.lights.end(),
                                [](const ViewedLight& light) { return light.on; });
  ASSERT_NE(lit, session_->state.lights.end());
  const auto isCoarse = [&](bool slow) {
    lit->light.positionWorld.x += 1e-5f;
    if (slow) return isEnlarged(slowFrame());
    session_->coarse.tell(1.0, false);
    frame();
    return isEnlarged(pixels_);
  };
  EXPECT_TRUE(isCoarse(true));
  EXPECT_FALSE(isCoarse(false));
  session_->run(Command::screenshot);
  EXPECT_FALSE(isCoarse(true));
  EXPECT_TRUE(isCoarse(true));
  session_->state.coarse = false;
  EXPECT_FALSE(isCoarse(true));
}

// Near the bar frames would be coarse and whole by turns.
TEST(CoarseFrames, staySlowUntilTheyAreMuchQuicker) {
  CoarseFrames frames;
  ViewState state;
  const auto isCoarseAfter = [&](double drawMs, bool wasCoarse) {
    frames.tell(drawMs, wasCoarse);
    state.camera.yawRad += 0.01f;
    return frames.isWanted(state);
  };
  EXPECT_FALSE(isCoarseAfter(90.0, false));
  EXPECT_TRUE(isCoarseAfter(110.0, false));
  EXPECT_TRUE(isCoarseAfter(30.0, true)) << "a whole one would take some 90 ms";
  EXPECT_FALSE(isCoarseAfter(10.0, true));
  EXPECT_FALSE(isCoarseAfter(90.0, false));
}

TEST_F(CoarseSession, fitsAWindowOfOddSize) {
  writeBakeFile(small(512));
  start(at("level.relume"));
  ASSERT_TRUE(frames([&] { return session_->level != nullptr; }));
  for (const auto& [width, height] : {std::pair{1u, 1u}, {5u, 3u}, {kWidth, kHeight}}) {
    const auto target = session_->coarse.begin(width, height);
    ASSERT_TRUE(target);
    EXPECT_EQ(target->width, (width + 1) / 2);
    EXPECT_EQ(target->height, (height + 1) / 2);
    session_->coarse.end(framebuffer_.name(), width, height);
    EXPECT_EQ(glGetError(), GLenum{GL_NO_ERROR});
  }
}

}  // namespace
}  // namespace relume
