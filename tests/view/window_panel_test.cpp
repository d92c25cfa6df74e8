// SPDX-License-Identifier: MIT
// The panel of relume-view under Xvfb, clicked on by a real mouse: parts of the light, bands, backend and kind of
// links, views and overlays of the bake, the comparison with path tracing, costs, films.
#include "tests/view/window_fixture.h"

namespace relume {
namespace {

using namespace test;

constexpr std::uint32_t kWidth = 640, kHeight = 560;
constexpr int kRowStep = 23, kItemStep = 17;  // [pixel] between controls, and between the lines of a list

// The panel from above, once Relight is open.
enum Row {
  kShow = 1,
  kOverlay = 3,
  kSources = 6,
  kRelight = 7,
  kParts,
  kBounces,
  kLuma = 11,
  kChroma,
  kBy,
  kObjects,
  kLinks,
  kCompare = 21,
  kCosts
};
// Once what emits is open.
constexpr int kEmission = 7, kSky = 9;
constexpr glm::ivec2 kCancelButton{590, 45};
glm::ivec2 rowAt(int row, int x = 60) { return {x, 45 + kRowStep * row}; }

// Where a slider of so many steps says one of them.
glm::ivec2 sliderAt(int row, int step, int steps) {
  constexpr float kWay = 146.0f;
  const float grab = std::max(10.0f, kWay / static_cast<float>(steps + 1));
  return rowAt(row, static_cast<int>(18.5f + 0.5f * grab +
                                     (kWay - grab) * static_cast<float>(step) / static_cast<float>(steps)));
}

enum OverlayItem { kSurfels, kHierarchy, kCaches, kLinksOfPoint, kLightmap };

class WindowPanel : public WindowTest {
 protected:
  explicit WindowPanel(std::uint32_t width = kWidth, std::uint32_t height = kHeight) : WindowTest(width, height) {}
  bool showBake(const std::string& surfels, const std::string& view = "full") {
    bake(surfels);
    return show(
        {kWindowLevel, "--bake", at("level.relume"), "--camera", "cam_living", "--lights", "lamp", "--view", view});
  }
  // A line of the list that a row opens, once it is open.
  void choose(int row, int item) const {
    const ScreenPicture closed = screen_.picture();
    clickControl(rowAt(row));
    EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return isListOpen(closed, p, row); })) << row;
    clickControl(rowAt(row) + glm::ivec2(0, kRowStep + kItemStep * item));
  }
  // Whether there is something else below a row than before, where a list of two lines is.
  static bool isListOpen(const ScreenPicture& closed, const ScreenPicture& now, int row) {
    int changed = 0;
    for (int y = rowAt(row).y + 14; y < rowAt(row).y + 14 + 2 * kItemStep; ++y) {
      for (int x = 20; x < 160; ++x) {
        const std::size_t i = static_cast<std::size_t>(y) * closed.width + static_cast<std::size_t>(x);
        changed += std::abs(closed.pixel[i].sum() - now.pixel[i].sum()) > 20 ? 1 : 0;
      }
    }
    return changed > 200;
  }
  void switchOverlay(int item) const {
    clickControl(rowAt(kOverlay));
    clickControl({30, rowAt(kOverlay).y + 27 + kRowStep * item});
    screen_.click(1, {kWidth - 140, kHeight - 100});  // closes the list
  }
};

// As small a window as has all controls of the light, with messages beside them: a software rasteriser's frames take as
// long as they have pixels.
class SmallWindowPanel : public WindowPanel {
 protected:
  SmallWindowPanel() : WindowPanel(584, 440) {}
};

TEST_F(SmallWindowPanel, partsOfTheLightBandsAndBackendsAreSwitched) {
  if (!showBake("2048")) GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  clickControl(rowAt(kRelight));
  const auto all = restingPixels();
  ASSERT_GT(meanOf(all), 0.02);
  // Direct light, indirect light: each alone is less, and none is nothing.
  const glm::ivec2 direct = rowAt(kParts, 25), indirect = rowAt(kParts, 98);
  clickControl(indirect);
  const double directAlone = meanOf(restingPixels());
  clickControl(direct);
  EXPECT_LT(meanOf(restingPixels()), 0.05 * meanOf(all));
  clickControl(indirect);
  const double indirectAlone = meanOf(restingPixels());
  clickControl(direct);
  EXPECT_LT(directAlone, 0.97 * meanOf(all));
  EXPECT_LT(indirectAlone, 0.97 * meanOf(all));
  EXPECT_LT(differenceBetween(restingPixels(), all), 2e-3);

  // Each bounce adds light.
  double before = directAlone;
  for (int bounces = 1; bounces <= 3; ++bounces) {
    clickControl(sliderAt(kBounces, bounces, 8));
    const double now = meanOf(restingPixels());
    EXPECT_GT(now, before) << bounces;
    before = now;
  }
  clickControl(sliderAt(kBounces, 0, 8));
  EXPECT_NEAR(meanOf(restingPixels()), meanOf(all), 0.01 * meanOf(all));

  // Bands of chroma, then of luma: other light of about the same power. Then more than there were.
  clickControl(sliderAt(kChroma, 0, 2));
  const auto grey = restingPixels();
  EXPECT_GT(differenceBetween(grey, all), 1e-4);
  clickControl(sliderAt(kLuma, 0, 7));
  const auto flat = restingPixels();
  EXPECT_GT(differenceBetween(flat, grey), 1e-3);
  EXPECT_NEAR(meanOf(flat), meanOf(all), 0.2 * meanOf(all));
  clickControl(sliderAt(kLuma, 3, 7));
  EXPECT_LT(differenceBetween(restingPixels(), all), differenceBetween(flat, all));

  // The CPU's light is OpenGL's, but for the edges of shadows.
  const auto gl = restingPixels();
  choose(kBy, 1);
  const auto cpu = restingPixels();
  EXPECT_GT(differenceBetween(cpu, gl), 0.0);
  EXPECT_NEAR(meanOf(cpu), meanOf(gl), 0.03 * meanOf(gl));
  choose(kBy, 0);
  EXPECT_LT(differenceBetween(restingPixels(), gl), 2e-3);
}

// Of a level without a bake, which OpenGL lights and then the CPU.
TEST_F(SmallWindowPanel, conesMirrorAndShowHowOpenPlacesAre) {
  constexpr int kLiveRelight = 6, kLiveBy = 13, kMirrorByCones = 16, kGlossy = 3, kOcclusion = 8;
  if (!show({kWindowLevel, "--camera", "cam_living", "--lights", "lamp", "--live-cells", "12", "--live-rays", "32",
             "--live-backend", "gl", "--view", "glossy", "--roughness", "0.3"}))
    GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  // Light of the caches settles, and so does what cones turn about.
  const auto settled = [&] {
    auto last = screenshot(), now = screenshot();
    for (int i = 0; i < 100 && differenceBetween(last, now) > 5e-4; ++i) last = std::exchange(now, screenshot());
    return now;
  };
  clickControl(rowAt(kLiveRelight));
  const auto byCaches = settled();
  clickControl(rowAt(kMirrorByCones, 25));
  const auto byCones = settled();
  EXPECT_GT(meanOf(byCones), 0.01);
  EXPECT_GT(differenceBetween(byCones, byCaches), 3e-3);
  clickControl(rowAt(kMirrorByCones, 25));
  EXPECT_LT(differenceBetween(settled(), byCaches), 0.3 * differenceBetween(byCones, byCaches));
  choose(kShow, kOcclusion);
  const auto open = settled();
  EXPECT_GT(meanOf(open), 0.1);
  EXPECT_GT(differenceBetween(open, byCaches), 0.01);
  choose(kLiveBy, 1);
  EXPECT_LT(differenceBetween(settled(), open), 0.005) << "by the CPU's voxels";
  choose(kShow, kGlossy);
  clickControl(rowAt(kMirrorByCones, 25));
  const auto byCpu = settled();
  EXPECT_GT(differenceBetween(byCpu, byCones), 2e-4) << "shadows by rays are others than those of 64 texels";
  EXPECT_LT(differenceBetween(byCpu, byCones), 0.3 * differenceBetween(byCones, byCaches));
  EXPECT_TRUE(screen_.isRunning(viewer_));
}

// As narrow as the panel allows: cones take as long as there are pixels.
class NarrowWindowPanel : public WindowPanel {
 protected:
  NarrowWindowPanel() : WindowPanel(420, 490) {}
};

// Of a level with a bake: once its voxels are found, and no longer than the switch is on.
TEST_F(NarrowWindowPanel, conesMirrorBesideABake) {
  constexpr int kMirrorByCones = 18;
  bake("2048");
  if (!show({kWindowLevel, "--bake", at("level.relume"), "--camera", "cam_living", "--lights", "lamp", "--live-cells",
             "12", "--view", "glossy", "--roughness", "0.3"}))
    GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  clickControl(rowAt(kRelight));
  const auto byCaches = restingPixels();
  clickControl(rowAt(kMirrorByCones, 25));
  auto byCones = screenshot();
  for (int i = 0; i < 60 && differenceBetween(byCones, byCaches) < 3e-3; ++i) byCones = screenshot();
  EXPECT_GT(differenceBetween(byCones, byCaches), 3e-3);
  EXPECT_GT(meanOf(byCones), 0.01);
  clickControl(rowAt(kMirrorByCones, 25));
  EXPECT_LT(differenceBetween(restingPixels(), byCaches), 1e-4);
}

TEST_F(WindowPanel, linksOfAnotherKindAreBaked) {
  if (!showBake("2048", "links")) GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  clickControl(rowAt(kRelight));
  const auto packed = restingPixels();
  // 12 bytes a link in place of 6 round less: about the same light, and not the same.
  choose(kLinks, 1);
  auto cones = screenshot();
  for (int i = 0; i < 60 && differenceBetween(cones, packed) < 1e-5; ++i) cones = restingPixels();
  EXPECT_GT(differenceBetween(cones, packed), 1e-5);
  EXPECT_NEAR(meanOf(cones), meanOf(packed), 0.03 * meanOf(packed));
  // And back, by the same options: the same bake.
  choose(kLinks, 2);
  auto again = screenshot();
  for (int i = 0; i < 60 && differenceBetween(again, packed) > 1e-5; ++i) again = restingPixels();
  EXPECT_LT(differenceBetween(again, packed), 1e-5);
}

// A bake of many seconds is called off by the button beside its bar, and what was shown stays.
TEST_F(WindowPanel, aBakeBehindItsBarIsCalledOff) {
  if (!showBake("100000", "links")) GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  clickControl(rowAt(kRelight));
  const auto before = restingPixels();
  choose(kLinks, 1);
  // Yellow as far as the bake is, beside the button
  const auto hasBar = [](const ScreenPicture& p) {
    return p.share([](const Rgb& c) { return c.r > 200 && c.g > 150 && c.g < 200 && c.b < 40; }) > 1e-4;
  };
  ASSERT_TRUE(screen_.waitFor(hasBar)) << "no bar";
  screen_.click(1, kCancelButton);
  EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return !hasBar(p); }));
  moveAway();
  EXPECT_TRUE(screen_.isRunning(viewer_));
  EXPECT_LT(differenceBetween(restingPixels(), before), 1e-5) << "another bake is shown";
}

// Emitters and sky are changed by the mouse, and one key takes each change back.
TEST_F(WindowPanel, changesOfEmittersAndSkyAreUndone) {
  if (!showBake("2048")) GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  clickControl(rowAt(kSources));
  const auto first = restingPixels();
  clickControl(sliderAt(kEmission, 6, 8));
  const auto brighter = restingPixels();
  EXPECT_GT(meanOf(brighter), 1.05 * meanOf(first));
  // Its red, which the window of the room shows
  const auto isRed = [](const ScreenPicture& p) {
    return p.share([](const Rgb& c) { return c.r > 100 && c.g < 40 && c.b < 40; }) > 0.02;
  };
  ASSERT_FALSE(isRed(screen_.picture()));
  ASSERT_TRUE(screen_.drag(1, rowAt(kSky, 30), rowAt(kSky, 230), isRed));
  moveAway();
  EXPECT_TRUE(isRed(restingScreen()));
  screen_.press("ctrl+z");
  EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return !isRed(p); }));
  EXPECT_LT(differenceBetween(restingPixels(), brighter), 1e-4) << "the sky is not put back";
  screen_.press("ctrl+z");
  EXPECT_LT(differenceBetween(restingPixels(), first), 1e-4) << "emitters are not put back";
  screen_.press("ctrl+y");
  EXPECT_LT(differenceBetween(restingPixels(), brighter), 1e-4) << "no redo";
}

// A number is typed while a frame is drawn: Control, a click, keys and Return at once. The sky turns no further than
// its slider goes, which is a whole turn.
TEST_F(SmallWindowPanel, theSkysTurnIsTyped) {
  bake("512");
  // A quarter each of red, green, blue and white
  std::ofstream(at("sky.hdr"), std::ios::binary)
      << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 4\n"
      << std::string("\x80\0\0\x81\0\x80\0\x81\0\0\x80\x81\x80\x80\x80\x81", 16);
  if (!show({kWindowLevel, "--bake", at("level.relume"), "--camera", "cam_living", "--lights", "lamp", "--view",
             "albedo", "--sky-map", at("sky.hdr")}))
    GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  clickControl(rowAt(kSources));
  const auto turned = [&](const std::string& keys) {
    const glm::ivec2 place = rowAt(kSky);
    xdotool("mousemove " + std::to_string(place.x) + " " + std::to_string(place.y) +
            " keydown ctrl click 1 keyup ctrl key --delay 1 " + keys + " Return");
    moveAway();
    return restingPixels();
  };
  const auto first = restingPixels();
  EXPECT_GT(differenceBetween(turned("9 0"), first), 3e-3);
  EXPECT_LT(differenceBetween(turned("4 5 0"), first), 1e-3) << "turned by more than the slider's end";
  EXPECT_GT(differenceBetween(turned("4 4 BackSpace 5"), first), 1e-3);
}

TEST_F(SmallWindowPanel, isWholeAgainAfterATinyWindow) {
  if (!showBake("512", "albedo")) GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  const ScreenPicture before = restingScreen();
  const auto resize = [this](std::uint32_t width, std::uint32_t height) {
    xdotool("search --name Relume windowsize " + std::to_string(width) + " " + std::to_string(height));
  };
  screen_.moveTo({5, 5});  // keys are the window's below the mouse
  resize(12, 12);
  std::size_t size = screenshot().size();
  for (int i = 0; i < 40 && size != 12 * 12; ++i) size = screenshot().size();
  ASSERT_EQ(size, 12u * 12u);
  resize(width_, height_);
  moveAway();
  const auto isBack = [&](const ScreenPicture& now) {
    for (std::uint32_t y = 0; y < 180; ++y) {
      for (std::uint32_t x = 0; x < 262; ++x) {
        const std::size_t i = std::size_t{y} * before.width + x;
        if (std::abs(before.pixel[i].sum() - now.pixel[i].sum()) > 20) return false;
      }
    }
    return true;
  };
  EXPECT_TRUE(VirtualScreen::waitUntil([&] { return screenshot().size() == std::size_t{width_} * height_; }));
  EXPECT_TRUE(isBack(restingScreen()));
}

TEST_F(WindowPanel, viewsAndOverlaysShowTheBake) {
  if (!showBake("2048", "albedo")) GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  const auto plain = restingPixels();
  for (const OverlayItem item : {kSurfels, kHierarchy, kCaches, kLinksOfPoint, kLightmap}) {
    switchOverlay(item);
    const auto with = restingPixels();
    EXPECT_GT(differenceBetween(with, plain), 5e-3) << item;
    if (item == kHierarchy) {
      // Its level has a slider below: another level has other colours.
      clickControl(sliderAt(kOverlay + 1, 2, 14));
      EXPECT_GT(differenceBetween(restingPixels(), with), 5e-3);
    }
    if (item == kLinksOfPoint) {
      // The links are those of the point that is clicked on.
      screen_.click(1, {620, 150});  // beside the messages
      const auto wall = restingPixels();
      EXPECT_GT(differenceBetween(wall, with), 1e-3);
      screen_.click(1, {450, 30});
      EXPECT_GT(differenceBetween(restingPixels(), wall), 1e-3);
    }
    switchOverlay(item);
    EXPECT_LT(differenceBetween(restingPixels(), plain), 1e-5) << item;
  }
  // Texels of the light map as a checker; where light is read from the grid.
  choose(kShow, 6);
  const auto texels = restingPixels();
  EXPECT_GT(differenceBetween(texels, plain), 0.05);
  choose(kShow, 7);
  const auto grid = restingPixels();
  EXPECT_GT(differenceBetween(grid, texels), 0.05);
  EXPECT_GT(differenceBetween(grid, plain), 0.01);
}

TEST_F(WindowPanel, theViewIsHeldAgainstPathTracingAndCostsAreShown) {
  if (!showBake("2048")) GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  clickControl(rowAt(kRelight));
  const ScreenPicture before = restingScreen();
  // What is too bright is red, what is too dark is blue, in a picture in the upper right corner.
  const auto heatIn = [](const ScreenPicture& picture, bool red) {
    std::size_t found = 0;
    for (std::uint32_t y = 90; y < 340; ++y) {
      for (std::uint32_t x = kWidth - 340; x < kWidth - 10; ++x) {
        const Rgb& c = picture.pixel[y * picture.width + x];
        found += (red ? c.r > c.g + 40 && std::abs(c.g - c.b) < 30 : c.b > c.r + 30 && c.b > c.g) ? 1 : 0;
      }
    }
    return found;
  };
  EXPECT_LT(heatIn(before, false), 50u);
  EXPECT_LT(heatIn(before, true), 200u);
  clickControl(rowAt(kCompare));
  EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return heatIn(p, false) > 500 && heatIn(p, true) > 500; }))
      << "no heat";

  // The plot of the passes has the colours of the list below it.
  const ScreenPicture closed = restingScreen();
  clickControl(rowAt(kRelight));  // which makes room
  clickControl(rowAt(kParts));    // where Costs is then
  const auto hues = [](const ScreenPicture& picture) {
    std::array<std::size_t, 6> found{};
    for (std::uint32_t y = 240; y < 430; ++y) {
      for (std::uint32_t x = 16; x < 250; ++x) {
        const Rgb& c = picture.pixel[y * picture.width + x];
        const int most = std::max({c.r, c.g, c.b}), least = std::min({c.r, c.g, c.b});
        if (most < 120 || most - least < 60) continue;
        const std::size_t channel = c.r == most ? 0 : c.g == most ? 1 : 2;
        const bool second = channel == 0 ? c.g > c.b : channel == 1 ? c.b > c.r : c.r > c.g;
        ++found[2 * channel + (second ? 1 : 0)];
      }
    }
    return std::count_if(found.begin(), found.end(), [](std::size_t n) { return n > 20; });
  };
  EXPECT_TRUE(screen_.waitFor([&](const ScreenPicture& p) { return hues(p) >= 3; })) << "no plot";
  EXPECT_GT(differenceOf(closed, screen_.picture(), 60).height(), 100u);
}

TEST_F(SmallWindowPanel, aFilmIsMadeOfFrames) {
  if (!showBake("512", "albedo")) GTEST_SKIP() << "no window with OpenGL 4.3: " << log();
  const fs::path film = fs::path(at("pictures")) / "film_0001";
  screen_.press("F11");
  ASSERT_TRUE(VirtualScreen::waitUntil([&] { return fs::exists(film / "frame_0003.png"); }));
  screen_.press("F11");
  screenshot();  // of a later frame
  const auto count = [&] { return std::distance(fs::directory_iterator(film), fs::directory_iterator()); };
  const auto frames = count();
  EXPECT_GE(frames, 4);
  const auto still = screenshot();
  EXPECT_EQ(count(), frames) << "the film has ended";
  const auto first = readPicture((film / "frame_0000.png").string(), "");
  ASSERT_TRUE(first) << first.error().message;
  EXPECT_LT(differenceBetween(first->picture.pixels, still), 1e-5) << "without panel and handles";
}

}  // namespace
}  // namespace relume
