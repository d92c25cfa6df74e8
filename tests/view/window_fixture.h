// SPDX-License-Identifier: MIT
// relume-view in a window under Xvfb, for tests with real mouse and keys (xdotool): it is started, its controls are
// clicked on, and what F12 writes is read.
#pragma once

#include "tests/cli/run_program.h"
#include "tests/samples/virtual_screen.h"
#include "tools/images/read_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string>
#include <utility>

namespace relume::test {

namespace fs = std::filesystem;

inline const std::string kWindowLevel = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";

// Errors among the messages
inline bool isErrorText(const Rgb& c) { return c.r > 220 && c.g > 115 && c.g < 165 && c.b > 100 && c.b < 155; }

class WindowTest : public testing::Test {
 protected:
  // Of the window [pixel]
  WindowTest(std::uint32_t width, std::uint32_t height) : width_(width), height_(height) {}
  void SetUp() override {
    if (std::system("command -v Xvfb >/dev/null 2>&1 && command -v xdotool >/dev/null 2>&1") != 0)
      GTEST_SKIP() << "Xvfb or xdotool is not installed";
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / ("relume_window_" + std::string(info->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    ASSERT_TRUE(screen_.start(folder_, width_, height_)) << "Xvfb does not start";
  }
  void TearDown() override {
    if (viewer_ > 0) screen_.end(viewer_);
    screen_.stop();
    if (!folder_.empty()) fs::remove_all(folder_);
  }
  std::string at(const std::string& name) const { return (folder_ / name).string(); }
  std::string log() const { return readAll(folder_ / "viewer.txt"); }

  // Whether a window comes that shows a level: so much of it brighter than a sum of channels.
  bool show(std::vector<std::string> arguments, int brightness = 90, double share = 0.3) {
    for (const char* more : {"--shadow-size", "64", "--size"}) arguments.emplace_back(more);
    arguments.push_back(std::to_string(width_) + "x" + std::to_string(height_));
    arguments.insert(arguments.end(), {"-o", at("pictures")});
    viewer_ = screen_.run(RELUME_VIEW, arguments, folder_ / "viewer.txt");
    return screen_.waitFor(
        [=](const ScreenPicture& p) { return p.share([=](const Rgb& c) { return c.sum() > brightness; }) > share; },
        [this] { return screen_.isRunning(viewer_); });
  }
  void bake(const std::string& surfels) {
    const ProgramResult baked = runProgram(
        {"bake", kWindowLevel, "-o", at("level.relume"), "--preset", "draft", "--surfels", surfels, "--lightmap-caches",
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
    if (!VirtualScreen::waitUntil([&] { return fs::exists(path); })) return {};
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
  // More of it than the screen offers.
  void xdotool(const std::string& arguments) const {
    const std::string line = "DISPLAY=" + screen_.display() + " xdotool " + arguments + " >/dev/null 2>&1";
    EXPECT_EQ(std::system(line.c_str()), 0) << arguments;
  }
  void moveAway() const { screen_.moveTo({width_ - 140, height_ - 100}); }
  // A click on a control: once the mouse is over it, which is seen where it is.
  void clickControl(const glm::ivec2& place) const {
    const ScreenPicture before = screen_.picture();
    screen_.moveTo(place);
    EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return isOther(before, p, place); })) << place.y;
    screen_.click(1, place);
    moveAway();
  }
  // Whether much of what is around a place has changed.
  static bool isOther(const ScreenPicture& a, const ScreenPicture& b, const glm::ivec2& place) {
    int changed = 0;
    for (int y = place.y - 6; y < place.y + 6; ++y) {
      for (int x = place.x - 6; x < place.x + 6; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * a.width + static_cast<std::size_t>(x);
        const Rgb &p = a.pixel[i], &q = b.pixel[i];
        changed += std::abs(p.r - q.r) + std::abs(p.g - q.g) + std::abs(p.b - q.b) > 20 ? 1 : 0;
      }
    }
    return changed > 40;
  }
  // What F12 writes once light has come to rest: two frames are the same. Last bounces change a picture by less than
  // tests tell apart, and by more in all. Keys and clicks are handled in their order.
  std::vector<glm::vec3> restingPixels() {
    auto last = screenshot(), now = screenshot();
    for (int i = 0; i < 100 && differenceBetween(last, now) > 1e-7; ++i) last = std::exchange(now, screenshot());
    return now;
  }

  // The screen then, but for the news that pictures are written.
  ScreenPicture restingScreen() {
    restingPixels();
    return screen_.picture();
  }

  std::uint32_t width_, height_;
  fs::path folder_;
  VirtualScreen screen_;
  pid_t viewer_ = -1;
  int pictures_ = 0;
};

}  // namespace relume::test
