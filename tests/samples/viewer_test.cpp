// SPDX-License-Identifier: MIT
// relume-view in a window, under Xvfb, with real keys and a real mouse (xdotool): what is on the screen is what the
// window shows.
#include "tests/cli/run_program.h"
#include "tests/samples/virtual_screen.h"

#include <gtest/gtest.h>

namespace relume {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kWidth = 640, kHeight = 400;

class ViewerWindow : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v Xvfb >/dev/null 2>&1 && command -v xdotool >/dev/null 2>&1") != 0)
      GTEST_SKIP() << "Xvfb or xdotool is not installed";
    folder_ = fs::path(testing::TempDir()) / "relume_viewer_window";
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    const ProgramResult baked =
        runProgram({"bake", RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", "-o", (folder_ / "level.relume").string(),
                    "--preset", "draft", "--surfels", "512", "--lightmap-caches", "200", "--links", "64", "--rays",
                    "64", "--walks", "5000", "--progress", "none"},
                   folder_);
    ASSERT_EQ(baked.status, 0) << baked.err;
    ASSERT_TRUE(screen_.start(folder_, kWidth, kHeight)) << "Xvfb does not start";
  }
  void TearDown() override {
    end();
    screen_.stop();
    if (!folder_.empty()) fs::remove_all(folder_);
  }

  // Starts the viewer and waits for its first picture. False where there is no OpenGL for it. Albedo is the same in
  // every frame, whatever bounces.
  bool show() {
    viewer_ =
        screen_.run(RELUME_VIEW,
                    {RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", "--bake", (folder_ / "level.relume").string(),
                     "--shadow-size", "64", "--camera", "cam_living", "--lights", "none", "--view", "albedo", "--size",
                     std::to_string(kWidth) + "x" + std::to_string(kHeight)},
                    folder_ / "viewer.txt");
    const auto isLit = [](const ScreenPicture& picture) {
      return picture.share([](const Rgb& c) { return c.sum() > 60; }) > 0.3;
    };
    return screen_.waitFor(isLit, [this] { return screen_.isRunning(viewer_); });
  }
  void end() {
    if (viewer_ > 0) screen_.end(viewer_);
    viewer_ = -1;
  }

  fs::path folder_;
  VirtualScreen screen_;
  pid_t viewer_ = -1;
};

// Whether a picture differs over more than this width.
VirtualScreen::Condition differsFrom(const ScreenPicture& before, std::uint32_t width) {
  return [&before, width](const ScreenPicture& now) { return differenceOf(before, now, 40).width() > width; };
}

TEST_F(ViewerWindow, thePanelIsSmallAndHidesAndKeysFly) {
  if (!show()) GTEST_SKIP() << "no window with OpenGL 4.3: " << readAll(folder_ / "viewer.txt");
  const ScreenPicture with = screen_.settled();
  EXPECT_TRUE(screen_.holdKey("Tab", differsFrom(with, 100))) << "Tab must hide the panel";
  const ScreenPicture without = screen_.settled();

  // What Tab took away is the panel: a fifth of a window of 1280 pixels, and a third of one of 400 high.
  const Box panel = differenceOf(with, without, 40);
  EXPECT_GT(panel.width(), 150u);
  EXPECT_LE(panel.width(), 1280u / 5);
  EXPECT_LE(panel.height(), 280u);

  // Without it, W flies
  EXPECT_TRUE(screen_.holdKey("w", differsFrom(without, kWidth / 2)));
  const ScreenPicture flown = screen_.settled();

  // And Tab brings it back where it was.
  EXPECT_TRUE(screen_.holdKey("Tab", differsFrom(flown, 100)));
  EXPECT_NEAR(differenceOf(flown, screen_.settled(), 40).width(), panel.width(), 4);
}

// By the slowest speed a second of flight is a centimetre, by the fastest the room is left.
TEST_F(ViewerWindow, theWheelSaysHowFastKeysFly) {
  if (!show()) GTEST_SKIP() << "no window with OpenGL 4.3: " << readAll(folder_ / "viewer.txt");
  EXPECT_TRUE(screen_.holdKey("Tab", differsFrom(screen_.settled(), 100)));
  const ScreenPicture before = screen_.settled();
  // Share of the pixels above the news
  const auto changed = [&](const ScreenPicture& now) {
    const std::size_t above = before.pixel.size() * 3 / 4;
    std::size_t count = 0;
    for (std::size_t i = 0; i < above; ++i) count += std::abs(before.pixel[i].sum() - now.pixel[i].sum()) > 60 ? 1 : 0;
    return static_cast<double>(count) / static_cast<double>(above);
  };
  screen_.scroll(-40, {300, 200});
  EXPECT_TRUE(screen_.waitFor(differsFrom(before, 200))) << "the speed is told";
  screen_.holdKey("w", 1.0);
  const ScreenPicture slow = screen_.settled();
  EXPECT_LT(changed(slow), 0.02);
  screen_.scroll(40, {300, 200});
  screen_.holdKey("w", 0.5);
  EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& now) { return changed(now) > 0.3; }));
}

TEST_F(ViewerWindow, theRightMouseButtonLooksAround) {
  if (!show()) GTEST_SKIP() << "no window with OpenGL 4.3: " << readAll(folder_ / "viewer.txt");
  const ScreenPicture before = screen_.settled();
  EXPECT_TRUE(screen_.drag(3, {350, 300}, {600, 300}, differsFrom(before, kWidth / 2)));
}

}  // namespace
}  // namespace relume
