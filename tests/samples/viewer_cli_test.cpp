// SPDX-License-Identifier: MIT
// relume-view without a window: bakes that are not of the level, lights of a file, cameras.
#include "tests/cli/make_gltf.h"
#include "tests/cli/run_program.h"
#include "tools/images/read_picture.h"

#include <gtest/gtest.h>

#include <cmath>

namespace relume {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLevel = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";
constexpr int kNoGl = 5;  // exit status without EGL

class ViewerCommand : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / ("relume_viewer_" + std::string(info->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string at(const char* name) const { return (folder_ / name).string(); }
  std::string bake(const std::string& level) {
    const ProgramResult baked = runProgram(
        {"bake", level, "-o", at("level.relume"), "--preset", "draft", "--surfels", "512", "--lightmap-caches", "200",
         "--links", "64", "--rays", "64", "--walks", "5000", "--progress", "none"},
        folder_);
    EXPECT_EQ(baked.status, 0) << baked.err;
    return at("level.relume");
  }
  // Exit status of the viewer for one frame to `frames`; what it says goes to log().
  int view(const std::string& level, const std::string& bake, const char* frames, const std::string& more = "") {
    const std::string command = "'" RELUME_VIEW "' '" + level + "' --bake '" + bake +
                                "' --headless 1 --size 64x36 --shadow-size 64 -o '" + at(frames) + "' " + more + " >'" +
                                at("log.txt") + "' 2>&1";
    const int status = std::system(command.c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  std::string log() const { return readAll(folder_ / "log.txt"); }

  fs::path folder_;
};

// The level with a word of its JSON changed everywhere into another of the same length.
std::string changed(const fs::path& to, const std::string& from, const std::string& into) {
  std::string bytes = readAll(kLevel);
  std::size_t count = 0;
  for (std::size_t at = bytes.find(from); at != std::string::npos; at = bytes.find(from, at + 1), ++count)
    bytes.replace(at, from.size(), into);
  EXPECT_GT(count, 0u) << from;
  std::ofstream(to, std::ios::binary) << bytes;
  return to.string();
}

TEST_F(ViewerCommand, aBakeOfAnotherLevelIsRefusedOrShownWithAWarning) {
  // As many instances as the level has, one of another name: their number says nothing.
  const std::string other = changed(folder_ / "other.glb", "\"name\":\"sofa\"", "\"name\":\"seat\"");
  const std::string made = bake(other);
  EXPECT_EQ(view(kLevel, made, "frames"), 3);
  EXPECT_NE(log().find("was not baked from"), std::string::npos) << log();
  EXPECT_NE(log().find("--allow-stale"), std::string::npos) << log();
  EXPECT_FALSE(fs::exists(folder_ / "frames"));

  const int status = view(kLevel, made, "frames", "--allow-stale");
  EXPECT_NE(log().find("warning: "), std::string::npos) << log();
  if (status == kNoGl) GTEST_SKIP() << log();
  EXPECT_EQ(status, 0) << log();
  EXPECT_TRUE(fs::exists(folder_ / "frames" / "frame_0000.png"));
}

TEST_F(ViewerCommand, lightsOfAFileAreOn) {
  const std::string made = bake(kLevel), lights = at("lights.json");
  std::ofstream(lights) << R"([{"type": "point", "position": [2.5, 1.5, 1.5], "intensity": 40}])";
  const int status = view(kLevel, made, "dark", "--lights none");
  if (status == kNoGl) GTEST_SKIP() << log();
  EXPECT_EQ(status, 0) << log();
  EXPECT_EQ(view(kLevel, made, "lit", "--lights none --lights-file '" + lights + "'"), 0) << log();
  EXPECT_NE(readAll(folder_ / "dark" / "frame_0000.png"), readAll(folder_ / "lit" / "frame_0000.png"));
  std::ofstream(lights) << R"([{"type": "point"}])";
  EXPECT_EQ(view(kLevel, made, "wrong", "--lights-file '" + lights + "'"), 3);
  EXPECT_NE(log().find("has no \"position\""), std::string::npos) << log();
}

// As many lights are on as the window has on, and the one that is to move is one of them.
TEST_F(ViewerCommand, noMoreLightsAreOnThanThereAreShadowMaps) {
  const std::string made = bake(kLevel), lights = at("lights.json");
  std::string list;
  for (int i = 0; i < 31; ++i)
    list += std::string(i > 0 ? "," : "") + R"({"type": "point", "name": "l)" + std::to_string(i) +
            R"(", "position": [2.5, 1.5, 1.5]})";
  std::ofstream(lights) << "[" << list << "]";
  const std::string all = "--lights-file '" + lights + "'";
  const int status = view(kLevel, made, "many", all);
  if (status == kNoGl) GTEST_SKIP() << log();
  EXPECT_EQ(status, 0) << log();
  EXPECT_NE(log().find("warning: 2 lights switched off: 32 are on, and no more can be"), std::string::npos) << log();
  const ProgramResult rendered = runProgram({"render", kLevel, "--bake", made, "--lights-file", lights, "--backend",
                                             "gl", "--size", "64x36", "--progress", "none", "-o", at("render.png")},
                                            folder_);
  EXPECT_EQ(rendered.status, 1);
  EXPECT_NE(rendered.err.find("34 lights are on, and at most 32 can be where shadow maps are drawn; choose them with "
                              "--lights"),
            std::string::npos)
      << rendered.err;

  EXPECT_EQ(view(kLevel, made, "none", "--lights none --move lamp"), 1);
  EXPECT_NE(log().find("--move: \"lamp\" is off; --lights has to name it"), std::string::npos) << log();
  EXPECT_EQ(view(kLevel, made, "none", all + " --move l30"), 1);
  EXPECT_NE(log().find("--move: \"l30\" is off"), std::string::npos) << log();
  EXPECT_EQ(view(kLevel, made, "none", "--move moon"), 1);
  EXPECT_NE(log().find("--move: no light \"moon\" in the scene"), std::string::npos) << log();
  EXPECT_FALSE(fs::exists(folder_ / "none"));
}

TEST_F(ViewerCommand, aLevelWithoutABakeIsBaked) {
  const std::string command =
      "'" RELUME_VIEW "' '" + std::string(kLevel) +
      "' --headless 1 --size 64x36 --shadow-size 64 --overlay links,clusters --view texels -o '" + at("frames") +
      "' >'" + at("log.txt") + "' 2>&1";
  const int status = WEXITSTATUS(std::system(command.c_str()));
  if (status == kNoGl) GTEST_SKIP() << log();
  EXPECT_EQ(status, 0) << log();
  EXPECT_TRUE(fs::exists(folder_ / "frames" / "frame_0000.png"));
  // What is no level ends before there is a window.
  for (const auto& [file, expected] : {std::pair{at("none.glb"), 2}, std::pair{at("log.txt"), 3}}) {
    const std::string wrong = "'" RELUME_VIEW "' '" + file + "' >'" + at("wrong.txt") + "' 2>&1";
    EXPECT_EQ(WEXITSTATUS(std::system(wrong.c_str())), expected) << readAll(folder_ / "wrong.txt");
  }
}

// Lit by its own caches, in frames that are the same each time.
TEST_F(ViewerCommand, aLevelWithoutABakeIsLit) {
  const auto frames = [&](const char* folder, const std::string& more) {
    const std::string command = "'" RELUME_VIEW "' '" + std::string(kLevel) +
                                "' --headless 3 --size 64x36 --shadow-size 64 --live-cells 16 --live-rays 16 -o '" +
                                at(folder) + "' " + more + " >'" + at("log.txt") + "' 2>&1";
    return WEXITSTATUS(std::system(command.c_str()));
  };
  const auto last = [&](const char* folder) { return readAll(folder_ / folder / "frame_0002.png"); };
  const int status = frames("first", "");
  if (status == kNoGl) GTEST_SKIP() << log();
  ASSERT_EQ(status, 0) << log();
  for (const char* pass : {"voxelise", "direct", "gather"}) EXPECT_NE(log().find(pass), std::string::npos) << log();
  ASSERT_EQ(frames("again", ""), 0);
  EXPECT_EQ(last("first"), last("again"));
  ASSERT_EQ(frames("direct", "--view direct"), 0);
  ASSERT_EQ(frames("links", "--view links"), 0);
  EXPECT_NE(last("first"), last("direct"));
  ASSERT_EQ(frames("dark", "--view links --lights none"), 0);
  EXPECT_NE(last("links"), last("dark"));
  EXPECT_EQ(frames("wrong", "--live-cells 65"), 1);
  ASSERT_EQ(frames("volumes", "--live-cascades 2 --live-backend gl --view links"), 0);
  EXPECT_NE(last("volumes"), last("dark"));
}

// Of the same level and camera, the same picture as `relume render` draws in OpenGL, by the same exposure.
TEST_F(ViewerCommand, framesAreThePicturesThatRenderDraws) {
  const std::string made = bake(kLevel);
  for (const std::string light : {"spot,emissive", "sun"}) {
    const int status = view(kLevel, made, "frames", "--camera cam_hall --lights " + light);
    if (status == kNoGl) GTEST_SKIP() << log();
    ASSERT_EQ(status, 0) << log();
    const ProgramResult rendered =
        runProgram({"render",        kLevel,   "--bake",     made,        "--camera", "cam_hall",      "--lights",
                    light,           "--size", "64x36",      "--samples", "1",        "--backend",     "gl",
                    "--shadow-size", "64",     "--progress", "none",      "-o",       at("render.png")},
                   folder_);
    ASSERT_EQ(rendered.status, 0) << rendered.err;
    const auto frame = readPicture(at("frames/frame_0000.png"), ""), expected = readPicture(at("render.png"), "");
    ASSERT_TRUE(frame && expected);
    ASSERT_EQ(frame->picture.pixels.size(), expected->picture.pixels.size());
    double difference = 0.0, sum = 0.0;
    for (std::size_t i = 0; i < expected->picture.pixels.size(); ++i) {
      const glm::vec3 a = frame->picture.pixels[i], b = expected->picture.pixels[i];
      difference += static_cast<double>(std::abs(a.r - b.r) + std::abs(a.g - b.g) + std::abs(a.b - b.b));
      sum += static_cast<double>(b.r + b.g + b.b);
    }
    EXPECT_LT(difference, 0.02 * sum) << light;
    const std::size_t stops = log().find("exposure: ");
    ASSERT_NE(stops, std::string::npos) << log();
    EXPECT_NE(log().substr(stops, 16), "exposure: +0.00 ") << "the test needs a picture that is made brighter";
  }
  EXPECT_EQ(view(kLevel, made, "frames", "--exposure 31"), 1);
  EXPECT_EQ(view(kLevel, made, "frames", "--exposure -1"), 0);
  EXPECT_EQ(log().find("exposure: "), std::string::npos) << "stops that are given are not told";
}

// Nor is a window opened for it, which would say that there is no display here.
TEST_F(ViewerCommand, aLevelWithoutTrianglesMakesNoFrames) {
  std::ofstream(at("none.gltf")) << R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{}]})";
  for (const std::string how : {"", "--draft", "--headless 1 -o frames", "--headless 1 -o frames --draft"}) {
    const std::string command = "cd '" + folder_.string() + "' && DISPLAY= WAYLAND_DISPLAY= '" RELUME_VIEW "' '" +
                                at("none.gltf") + "' --size 64x36 " + how + " >'" + at("log.txt") + "' 2>&1";
    EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 4) << how;
    EXPECT_EQ(log().rfind("relume-view: error: scene \"none.gltf\" has no triangle to draw: no mesh has one", 0), 0u)
        << how << ": " << log();
    EXPECT_FALSE(fs::exists(folder_ / "frames"));
  }
}

TEST_F(ViewerCommand, emissionIsReadAsRenderReadsIt) {
  const std::string made = bake(kLevel);
  const int status = view(kLevel, made, "dark", "--lights none");
  if (status == kNoGl) GTEST_SKIP() << log();
  EXPECT_EQ(view(kLevel, made, "none", "--emission nothing=1,1,1"), 1);
  EXPECT_NE(log().find("no material \"nothing\""), std::string::npos) << log();
  EXPECT_EQ(view(kLevel, made, "none", "--emission panel"), 1);
  EXPECT_EQ(view(kLevel, made, "none", "--emission panel='" + at("nowhere.png") + "'"), 2);
  EXPECT_FALSE(fs::exists(folder_ / "none"));
}

TEST_F(ViewerCommand, aSkyMapLightsAndIsSeen) {
  const std::string made = bake(kLevel), sky = at("sky.hdr");
  // Red toward -X and +Z, dark elsewhere: 4 x 2 texels of shared exponents.
  std::string texels;
  for (int i = 0; i < 8; ++i) texels += i % 4 == 0 ? std::string("\x80\0\0\x84", 4) : std::string("\0\0\0\0", 4);
  std::ofstream(sky, std::ios::binary) << "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n" << texels;
  const int status = view(kLevel, made, "dark", "--lights none");
  if (status == kNoGl) GTEST_SKIP() << log();
  const auto frame = [&](const char* folder, const std::string& rotation) {
    EXPECT_EQ(view(kLevel, made, folder, "--lights none --sky-map '" + sky + "' --sky-rotation " + rotation), 0)
        << log();
    return readAll(folder_ / folder / "frame_0000.png");
  };
  const std::string one = frame("one", "0"), other = frame("other", "90");
  EXPECT_NE(one, readAll(folder_ / "dark" / "frame_0000.png"));
  EXPECT_NE(one, other);
  EXPECT_EQ(view(kLevel, made, "none", "--sky-map '" + at("nowhere.hdr") + "'"), 2);
  EXPECT_EQ(view(kLevel, made, "none", "--sky-map '" + made + "'"), 3);
  EXPECT_EQ(view(kLevel, made, "none", "--sky-map '" + sky + "' --sky-rotation 400"), 1);
  EXPECT_NE(log().find("--sky-rotation: a number of -360..360 expected, \"400\" found"), std::string::npos) << log();
  EXPECT_EQ(view(kLevel, made, "none", "--sky-rotation 90"), 1);
  EXPECT_NE(log().find("--sky-rotation needs --sky-map"), std::string::npos) << log();
  EXPECT_FALSE(fs::exists(folder_ / "none"));
}

TEST_F(ViewerCommand, anOrthographicCameraIsWarnedOf) {
  std::string text = makeGltf({});
  const std::string perspective = R"("type":"perspective","perspective":{"yfov":1,"znear":0.1})";
  const std::size_t found = text.find(perspective);
  ASSERT_NE(found, std::string::npos);
  text.replace(found, perspective.size(),
               R"("type":"orthographic","orthographic":{"xmag":2,"ymag":2,"znear":0.1,"zfar":9})");
  std::ofstream(at("plan.gltf")) << text;
  const std::string command = "'" RELUME_VIEW "' '" + at("plan.gltf") +
                              "' --headless 1 --size 64x36 --shadow-size 64 --live-cells 8 --live-rays 16 --camera "
                              "Eye -o '" +
                              at("frames") + "' >'" + at("log.txt") + "' 2>&1";
  const int status = WEXITSTATUS(std::system(command.c_str()));
  const std::string warning = "relume-view: warning: camera \"cam\" is orthographic";
  EXPECT_NE(log().find(warning), std::string::npos) << log();
  EXPECT_EQ(log().find(warning), log().rfind(warning)) << "once: " << log();
  if (status == kNoGl) GTEST_SKIP() << log();
  EXPECT_EQ(status, 0) << log();
  EXPECT_TRUE(fs::exists(folder_ / "frames" / "frame_0000.png"));
}

// Cameras that no node has are none of the level's: the viewer looks where `relume render` does.
TEST_F(ViewerCommand, aLevelWithoutACameraIsFramed) {
  const std::string level = changed(folder_ / "no_camera.glb", "\"camera\":", "\"cameri\":");
  const std::string made = bake(level);
  const int status = view(level, made, "frames", "--view albedo");
  if (status == kNoGl) GTEST_SKIP() << log();
  ASSERT_EQ(status, 0) << log();
  // The projections agree but for the filter of their textures; another view differs by 0.5 and more.
  const ProgramResult rendered =
      runProgram({"render", level, "--aov", "albedo", "--size", "64x36", "--samples", "1", "--fov", "57.29578",
                  "--exposure", "0", "--progress", "none", "-o", at("rendered.png")},
                 folder_);
  ASSERT_EQ(rendered.status, 0) << rendered.err;
  const ProgramResult same = runProgram(
      {"diff", (folder_ / "frames" / "frame_0000.png").string(), at("rendered.png"), "--max-flip", "0.3"}, folder_);
  EXPECT_EQ(same.status, 0) << same.out << same.err;
}

}  // namespace
}  // namespace relume
