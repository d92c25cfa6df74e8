// SPDX-License-Identifier: MIT
// relume-view in a window, under Xvfb, with real keys and a real mouse (xdotool): what is on the screen is what the
// window shows.
#include "tests/cli/run_program.h"
#include "tests/samples/virtual_screen.h"

#include <gtest/gtest.h>

namespace relume {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kWidth = 1280, kHeight = 720;

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

  // Starts the viewer and waits for its first picture. False where there is no OpenGL for it.
  bool show(const std::vector<std::string>& more) {
    std::vector<std::string> arguments = {RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", "--bake",
                                          (folder_ / "level.relume").string(), "--shadow-size", "64"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    viewer_ = screen_.run(RELUME_VIEW, arguments, folder_ / "viewer.txt");
    return screen_.waitFor(
        [](const Picture& picture) { return picture.share([](const Rgb& c) { return c.sum() > 60; }) > 0.3; },
        [this] { return screen_.isRunning(viewer_); });
  }
  void end() {
    if (viewer_ > 0) screen_.end(viewer_);
    viewer_ = -1;
  }

  fs::path folder_;
  VirtualScreen screen_;
  pid_t viewer_ = -1;
};

TEST_F(ViewerWindow, thePanelIsSmallHidesAndKeysFly) {
  if (!show({"--camera", "cam_living"}))
    GTEST_SKIP() << "no window with OpenGL 4.3: " << readAll(folder_ / "viewer.txt");
  screen_.settle();
  const Picture with = screen_.picture();
  screen_.key("Tab");
  screen_.settle();
  const Picture without = screen_.picture();

  // What Tab took away is the panel.
  const Box panel = differenceOf(with, without, 40);
  EXPECT_GT(panel.width(), 150u) << "Tab must hide the panel";
  EXPECT_LE(panel.width(), kWidth / 5);
  EXPECT_LE(panel.width() * panel.height(), kWidth * kHeight / 10);

  // Without it, W flies.
  screen_.holdKey("w", 0.7);
  screen_.settle();
  const Picture flown = screen_.picture();
  EXPECT_GT(differenceOf(without, flown, 40).width(), kWidth / 2);

  // And Tab brings it back where it was.
  screen_.key("Tab");
  screen_.settle();
  const Box back = differenceOf(flown, screen_.picture(), 40);
  EXPECT_NEAR(back.width(), panel.width(), 4);
}

TEST_F(ViewerWindow, theRightMouseButtonLooksAround) {
  if (!show({"--camera", "cam_living"}))
    GTEST_SKIP() << "no window with OpenGL 4.3: " << readAll(folder_ / "viewer.txt");
  screen_.settle();
  const Picture before = screen_.picture();
  screen_.drag(3, {700, 400}, {900, 400});
  screen_.settle();
  EXPECT_GT(differenceOf(before, screen_.picture(), 40).width(), kWidth / 2);
}

}  // namespace
}  // namespace relume
