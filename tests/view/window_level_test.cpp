// SPDX-License-Identifier: MIT
// The window of relume-view under Xvfb: a level without a bake is baked and shown, files are dropped on it, a bake
// changes under it, switches of the panel change the picture, and screenshots say so.
#include "formats/color.h"
#include "tests/cli/run_program.h"
#include "tests/samples/virtual_screen.h"
#include "tests/view/drop_file.h"
#include "tools/images/read_picture.h"
#include "tools/render/lights_file.h"

#include <gtest/gtest.h>

#include <cmath>

namespace relume {
namespace {

namespace fs = std::filesystem;

const std::string kLevel = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";
const std::string kOther = RELUME_SOURCE_DIR "/samples/blender/cabin.glb";
constexpr std::uint32_t kWidth = 640, kHeight = 400;
constexpr glm::ivec2 kRelightHeader{100, 206}, kDirectSwitch{25, 229}, kAway{500, 300};
// Of a level without a bake, with an object picked: the panel shows its controls.
constexpr glm::ivec2 kLiveRelightHeader{100, 275}, kDraftButton{62, 298};

class WindowLevel : public testing::Test {
 protected:
  void SetUp() override {
    if (std::system("command -v Xvfb >/dev/null 2>&1 && command -v xdotool >/dev/null 2>&1") != 0)
      GTEST_SKIP() << "Xvfb or xdotool is not installed";
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / ("relume_window_" + std::string(info->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    ASSERT_TRUE(screen_.start(folder_, kWidth, kHeight)) << "Xvfb does not start";
  }
  void TearDown() override {
    if (viewer_ > 0) screen_.end(viewer_);
    screen_.stop();
    if (!folder_.empty()) fs::remove_all(folder_);
  }
  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  std::string log() const { return readAll(folder_ / "viewer.txt"); }

  bool show(std::vector<std::string> arguments) {
    for (const char* more : {"--shadow-size", "64", "--size"}) arguments.emplace_back(more);
    arguments.push_back(std::to_string(kWidth) + "x" + std::to_string(kHeight));
    arguments.insert(arguments.end(), {"-o", at("pictures")});
    viewer_ = screen_.run(RELUME_VIEW, arguments, folder_ / "viewer.txt");
    return screen_.waitFor(
        [](const ScreenPicture& p) { return p.share([](const Rgb& c) { return c.sum() > 90; }) > 0.3; },
        [this] { return screen_.isRunning(viewer_); });
  }
  void bake(const std::string& surfels) {
    const ProgramResult baked = runProgram(
        {"bake", kLevel, "-o", at("level.relume"), "--preset", "draft", "--surfels", surfels, "--lightmap-caches",
         "200", "--links", "64", "--rays", "64", "--walks", "5000", "--progress", "none"},
        folder_);
    ASSERT_EQ(baked.status, 0) << baked.err;
  }

  // What F12 writes, as numbers of the screen's. Empty when nothing comes.
  std::vector<glm::vec3> screenshot() {
    char name[32];
    std::snprintf(name, sizeof name, "relume_%04d.png", ++pictures_);
    const std::string path = at("pictures/") + name;
    screen_.press("F12");
    if (!screen_.waitFor([&](const ScreenPicture&) { return fs::exists(path); })) return {};
    const auto read = readPicture(path, "");
    EXPECT_TRUE(read) << read.error().message;
    return read ? read->picture.pixels : std::vector<glm::vec3>();
  }
  static double meanOf(const std::vector<glm::vec3>& pixels) {
    double sum = 0.0;
    for (const glm::vec3& p : pixels) sum += static_cast<double>(p.g);
    return pixels.empty() ? 0.0 : sum / static_cast<double>(pixels.size());
  }
  static double differenceBetween(const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
      sum += std::abs(static_cast<double>(a[i].g - b[i].g));
    return sum / static_cast<double>(std::max<std::size_t>(a.size(), 1));
  }
  // A click on a control: once the mouse is over it, which is seen.
  void clickControl(const glm::ivec2& place) const {
    const ScreenPicture before = screen_.settled();
    screen_.moveTo(place);
    EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return differenceOf(before, p, 10).width() > 4; }));
    screen_.click(1, place);
    screen_.moveTo(kAway);
  }

  fs::path folder_;
  VirtualScreen screen_;
  pid_t viewer_ = -1;
  int pictures_ = 0;
};

bool isErrorText(const Rgb& c) { return c.r > 220 && c.g > 115 && c.g < 165 && c.b > 100 && c.b < 155; }

TEST_F(WindowLevel, aLevelWithoutABakeIsBakedAndFilesCanBeDropped) {
  if (!show({kLevel, "--draft", "--camera", "cam_living", "--lights", "lamp"})) {
    GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  }
  screen_.settled();
  const auto first = screenshot();
  EXPECT_GT(meanOf(first), 0.02);

  // Another level: baked, and shown by its own camera.
  ASSERT_EQ(dropFile(screen_.display(), kOther), "");
  const ScreenPicture rooms = screen_.picture();
  ASSERT_TRUE(
      screen_.waitFor([&](const ScreenPicture& p) { return differenceOf(rooms, p, 60).width() > kWidth * 9 / 10; }));
  screen_.settled();
  const auto second = screenshot();
  EXPECT_GT(differenceBetween(first, second), 0.02);

  // What is no level is told; the window goes on.
  std::ofstream(at("notes.glb")) << "not a level";
  const double pink = screen_.settled().share(isErrorText);
  ASSERT_EQ(dropFile(screen_.display(), at("notes.glb")), "");
  EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return p.share(isErrorText) > pink + 1e-4; }))
      << "no error shown";
  EXPECT_TRUE(screen_.isRunning(viewer_));

  // A list of lights is loaded: the dropped file is what Control and S then write.
  std::ofstream(at("set.json")) << R"([{"type":"point","name":"new","position":[1,1,1]}])";
  ASSERT_EQ(dropFile(screen_.display(), at("set.json")), "");
  screen_.settled();
  const std::string before = readAll(at("set.json"));
  screen_.press("ctrl+s");
  EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture&) { return readAll(at("set.json")) != before; }));
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
  EXPECT_TRUE(
      screen_.waitFor([&](const ScreenPicture&) { return log().find("indirect light after") != std::string::npos; }));
  // The lower part of the window's right pane: black, or the wall below it.
  const auto pane = [](const ScreenPicture& picture) {
    int sum = 0;
    for (std::uint32_t y = 165; y < 185; ++y) {
      for (std::uint32_t x = 350; x < 385; ++x) sum += picture.pixel[y * picture.width + x].sum();
    }
    return sum / (20 * 35);
  };
  EXPECT_LT(pane(screen_.settled()), 60);

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
  EXPECT_TRUE(screen_.isRunning(viewer_));
}

TEST_F(WindowLevel, switchesChangeThePictureAndABakeIsLoadedAgain) {
  bake("512");
  if (!show({kLevel, "--bake", at("level.relume"), "--camera", "cam_living", "--lights", "lamp"})) {
    GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  }
  screen_.settled();
  const double all = meanOf(screenshot());

  // Without direct light it is darker; with it again, as before.
  clickControl(kRelightHeader);
  screen_.settled();
  clickControl(kDirectSwitch);
  screen_.settled();
  const double indirect = meanOf(screenshot());
  EXPECT_LT(indirect, 0.95 * all);
  EXPECT_GT(indirect, 0.1 * all);
  clickControl(kDirectSwitch);
  screen_.settled();
  EXPECT_NEAR(meanOf(screenshot()), all, 0.02 * all);

  // Another bake of the level takes the place of the one that is shown.
  const auto before = screenshot();
  bake("300");
  auto after = screenshot();
  for (int i = 0; i < 40 && differenceBetween(before, after) <= 1e-4; ++i) after = screenshot();
  EXPECT_GT(differenceBetween(before, after), 1e-4) << "the new bake is not shown";
  const ScreenPicture old = screen_.settled();
  after = screenshot();
  EXPECT_NEAR(meanOf(after), all, 0.2 * all);

  // A damaged one does not.
  std::ofstream(at("level.relume"), std::ios::binary) << "half a bake";
  EXPECT_TRUE(
      screen_.waitFor([&](const ScreenPicture& p) { return p.share(isErrorText) > old.share(isErrorText) + 1e-4; }));
  EXPECT_NEAR(meanOf(screenshot()), meanOf(after), 0.02 * all);
}

}  // namespace
}  // namespace relume
