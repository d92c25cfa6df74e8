// SPDX-License-Identifier: MIT
// The window of relume-view under Xvfb: a level without a bake is baked and shown, files are dropped on it, a bake
// changes under it, switches of the panel change the picture, and screenshots say so.
#include "formats/color.h"
#include "tests/view/drop_file.h"
#include "tests/view/window_fixture.h"
#include "tools/render/lights_file.h"

#include <unistd.h>

#include <chrono>
#include <thread>

namespace relume {
namespace {

using namespace test;

const std::string& kLevel = kWindowLevel;
const std::string kOther = RELUME_SOURCE_DIR "/samples/blender/cabin.glb";
constexpr std::uint32_t kWidth = 640, kHeight = 400;
constexpr glm::ivec2 kRelightHeader{100, 206}, kDirectSwitch{25, 229};
// Of a level without a bake, with an object picked: the panel shows its controls.
constexpr glm::ivec2 kLiveRelightHeader{100, 275}, kDraftButton{62, 298};

// That a process has used, in all.
double processorSeconds(pid_t process) {
  std::ifstream file("/proc/" + std::to_string(process) + "/stat");
  std::string word;
  double ticks = 0.0;
  for (int field = 1; field <= 15 && file >> word; ++field) ticks += field >= 14 ? std::stod(word) : 0.0;
  return ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
}

class WindowLevel : public WindowTest {
 protected:
  WindowLevel() : WindowTest(kWidth, kHeight) {}
};

TEST_F(WindowLevel, aLevelWithoutABakeIsBakedAndFilesCanBeDropped) {
  if (!show({kLevel, "--draft", "--camera", "cam_living", "--lights", "lamp"})) {
    GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  }
  const auto first = restingPixels();
  EXPECT_GT(meanOf(first), 0.02);

  // Another level: baked, and shown by its own camera.
  ASSERT_EQ(dropFile(screen_.display(), kOther), "");
  const ScreenPicture rooms = screen_.picture();
  ASSERT_TRUE(
      screen_.waitFor([&](const ScreenPicture& p) { return differenceOf(rooms, p, 60).width() > kWidth * 9 / 10; }));
  const auto second = restingPixels();
  EXPECT_GT(differenceBetween(first, second), 0.02);

  // What is no level is told; the window goes on.
  std::ofstream(at("notes.glb")) << "not a level";
  const double pink = screen_.picture().share(isErrorText);
  ASSERT_EQ(dropFile(screen_.display(), at("notes.glb")), "");
  EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return p.share(isErrorText) > pink + 1e-4; }))
      << "no error shown";
  EXPECT_TRUE(screen_.isRunning(viewer_));

  // A list of lights is loaded: the dropped file is what Control and S then write.
  std::ofstream(at("set.json")) << R"([{"type":"point","name":"new","position":[1,1,1]}])";
  ASSERT_EQ(dropFile(screen_.display(), at("set.json")), "");
  const std::string before = readAll(at("set.json"));
  screen_.press("ctrl+s");
  EXPECT_TRUE(VirtualScreen::waitUntil([&] { return readAll(at("set.json")) != before; }));
  const auto lights = readLightsFile(at("set.json"));
  ASSERT_TRUE(lights) << lights.error().message;
  ASSERT_EQ(lights->size(), 1u);
  EXPECT_EQ((*lights)[0].name, "new");
}

// The level is lit without a bake; the wall that is dragged by its gizmo takes its window along; a draft bake that a
// button asks for replaces live light, with the wall where the file has it.
TEST_F(WindowLevel, aLevelWithoutABakeIsLitAtOnceAndObjectsAreDragged) {
  if (!show({kLevel, "--camera", "cam_living", "--lights", "lamp", "--live-cells", "16"})) {
    GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  }
  EXPECT_TRUE(VirtualScreen::waitUntil([&] { return log().find("indirect light after") != std::string::npos; }));
  // The lower part of the window's right pane: black, or the wall below it.
  const auto pane = [](const ScreenPicture& picture) {
    int sum = 0;
    for (std::uint32_t y = 165; y < 185; ++y) {
      for (std::uint32_t x = 350; x < 385; ++x) sum += picture.pixel[y * picture.width + x].sum();
    }
    return sum / (20 * 35);
  };
  EXPECT_LT(pane(screen_.settled()), 60);  // without news of pictures, which would cover the wall

  // A click picks the wall: its gizmo has a red axis. The vertical one lifts it.
  const auto isRed = [](const Rgb& c) { return c.r > 200 && c.g < 110 && c.b < 110; };
  const double red = screen_.picture().share(isRed);
  screen_.click(1, {400, 250});
  ASSERT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return p.share(isRed) > red + 3e-4; })) << "no gizmo";
  screen_.dragOnce(1, {310, 90}, {310, 40});
  ASSERT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return pane(p) > 120; })) << "the wall is where it was";

  clickControl(kLiveRelightHeader);
  clickControl(kDraftButton);
  EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return pane(p) < 60; })) << "no bake";
  EXPECT_TRUE(VirtualScreen::waitUntil([&] { return screen_.hasWindow("two_rooms.glb, baked in memory"); }));
  EXPECT_TRUE(screen_.isRunning(viewer_));
}

// What is dropped on a window of live light is lit at once, and baked behind that.
TEST_F(WindowLevel, aLevelDroppedOnAWindowWithoutABakeIsLitAndBaked) {
  if (!show({kLevel, "--camera", "cam_living", "--lights", "lamp", "--live-cells", "16"})) {
    GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  }
  const ScreenPicture rooms = restingScreen();
  EXPECT_TRUE(screen_.hasWindow("two_rooms.glb, without a bake"));
  ASSERT_EQ(dropFile(screen_.display(), kOther), "");
  ASSERT_TRUE(
      screen_.waitFor([&](const ScreenPicture& p) { return differenceOf(rooms, p, 60).width() > kWidth * 9 / 10; }));
  EXPECT_GT(meanOf(screenshot()), 0.02);
  EXPECT_TRUE(VirtualScreen::waitUntil([&] { return screen_.hasWindow("cabin.glb, baked in memory"); }));
  EXPECT_GT(meanOf(screenshot()), 0.02);
}

// Where nothing changes nearly nothing is drawn; a new bake is seen still, and keys are heard.
TEST_F(WindowLevel, restsUntilSomethingHappens) {
  bake("512");
  if (!show({kLevel, "--bake", at("level.relume"), "--camera", "cam_living", "--lights", "lamp"})) {
    GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  }
  const auto rests = [this] {
    const double before = processorSeconds(viewer_);
    std::this_thread::sleep_for(std::chrono::seconds(2));
    return processorSeconds(viewer_) - before < 0.7;
  };
  ASSERT_TRUE(VirtualScreen::waitUntil(rests)) << "it draws and draws";
  EXPECT_TRUE(screen_.hasWindow("two_rooms.glb, level.relume"));
  const ScreenPicture screen = screen_.picture();
  bake("300");
  EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return differenceOf(screen, p, 60).width() > kWidth / 4; }))
      << "no news of the bake";
  EXPECT_GT(meanOf(screenshot()), 0.02);
}

TEST_F(WindowLevel, switchesChangeThePictureAndABakeIsLoadedAgain) {
  bake("512");
  if (!show({kLevel, "--bake", at("level.relume"), "--camera", "cam_living", "--lights", "lamp"})) {
    GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  }
  const double all = meanOf(restingPixels());

  // Without direct light it is darker; with it again, as before.
  clickControl(kRelightHeader);
  screenshot();  // after which it is open
  clickControl(kDirectSwitch);
  const double indirect = meanOf(restingPixels());
  EXPECT_LT(indirect, 0.95 * all);
  EXPECT_GT(indirect, 0.1 * all);
  clickControl(kDirectSwitch);
  const auto before = restingPixels();
  EXPECT_NEAR(meanOf(before), all, 0.02 * all);

  // Another bake of the level takes the place of the one that is shown.
  bake("300");
  auto after = screenshot();
  for (int i = 0; i < 40 && differenceBetween(before, after) <= 1e-4; ++i) after = screenshot();
  EXPECT_GT(differenceBetween(before, after), 1e-4) << "the new bake is not shown";
  after = restingPixels();
  const double pink = screen_.picture().share(isErrorText);
  EXPECT_NEAR(meanOf(after), all, 0.2 * all);

  // A damaged one does not.
  std::ofstream(at("level.relume"), std::ios::binary) << "half a bake";
  EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return p.share(isErrorText) > pink + 1e-4; }));
  EXPECT_NEAR(meanOf(screenshot()), meanOf(after), 0.02 * all);
}

}  // namespace
}  // namespace relume
