// SPDX-License-Identifier: MIT
// `relume render` as a user runs it: what it writes, and what it says when it cannot.
#include "bake/tools/image_io.h"
#include "tests/cli/run_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

namespace relume {
namespace {

namespace fs = std::filesystem;
const std::string kLevel = RELUME_SOURCE_DIR "/samples/level/two_rooms.glb";

class RenderCommand : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("relume_render_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    bake_ = (folder_ / "level.relume").string();
    const ProgramResult made = runProgram(
        {"bake", kLevel, "-o", bake_, "--preset", "draft", "--surfels", "2000", "--progress", "none"}, folder_);
    ASSERT_EQ(made.status, 0) << made.err;
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }

  // Render the level with these further arguments, to image.exr unless they say otherwise.
  static ProgramResult render(std::vector<std::string> more) {
    std::vector<std::string> arguments{"render", kLevel, "--size", "32x18", "--samples", "1", "--progress", "none"};
    if (std::find(more.begin(), more.end(), "-o") == more.end()) {
      arguments.push_back("-o");
      arguments.push_back(image());
    }
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runProgram(arguments, folder_);
  }
  static std::string image() { return (folder_ / "image.exr").string(); }
  static void expectRefused(const ProgramResult& r, int status, const std::vector<std::string>& words) {
    EXPECT_EQ(r.status, status) << r.err;
    for (const std::string& word : words)
      EXPECT_NE(r.err.find(word), std::string::npos) << "\"" << word << "\" in: " << r.err;
  }

  static fs::path folder_;
  static std::string bake_;
};
fs::path RenderCommand::folder_;
std::string RenderCommand::bake_;

TEST_F(RenderCommand, writesOneFileALayerOrOneForAll) {
  ASSERT_EQ(render({"--bake", bake_, "--aov", "indirect,direct,depth"}).status, 0);
  for (const char* name : {"image.indirect.exr", "image.direct.exr", "image.depth.exr"}) {
    auto read = readExr(folder_ / name);
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->width, 32u);
    EXPECT_EQ(read->height, 18u);
    EXPECT_EQ(read->layer("").size(), 32u * 18u);
  }
  ASSERT_EQ(render({"--bake", bake_, "--aov", "indirect,full", "--side-by-side"}).status, 0);
  auto wide = readExr(image());
  ASSERT_TRUE(wide) << wide.error().message;
  EXPECT_EQ(wide->width, 64u);
  // The left half is the layer by itself.
  auto left = readExr(folder_ / "image.indirect.exr");
  for (std::size_t i = 0; i < left->layer("").size(); ++i)
    ASSERT_EQ(wide->layer("")[i / 32 * 64 + i % 32], left->layer("")[i]);
}

TEST_F(RenderCommand, namesWhatThereIsWhenANameIsUnknown) {
  expectRefused(render({"--bake", bake_, "--camera", "nowhere"}), 1, {"--camera", "nowhere", "cam_living", "cam_hall"});
  expectRefused(render({"--bake", bake_, "--lights", "torch"}), 1,
                {"--lights", "torch", "sun", "lamp", "spot", "emissive"});
  expectRefused(render({"--bake", bake_, "--lights", "all,sun"}), 1, {"\"all\""});
  expectRefused(render({"--bake", bake_, "--aov", "shine"}), 1, {"--aov", "shine", "indirect", "depth"});
}

TEST_F(RenderCommand, refusesOptionsOutOfRange) {
  for (const char* size : {"0x10", "10", "axb", "99999x10", "10x-1", "16x16x16"})
    expectRefused(render({"--bake", bake_, "--size", size}), 1, {"--size"});
  for (const char* bounces : {"0", "-1", "2.5", "many", "99999"})
    expectRefused(render({"--bake", bake_, "--bounces", bounces}), 1, {"--bounces"});
  expectRefused(render({"--bake", bake_, "--sky", "1,-1,0"}), 1, {"--sky"});
  expectRefused(render({"--bake", bake_, "--samples", "0"}), 1, {"--samples"});
  expectRefused(render({"--bake", bake_, "--backend", "vulkan"}), 1, {"--backend"});
  expectRefused(render({"--bake", bake_, "-o", "image.jpg"}), 1, {".exr", ".png"});
  for (const char* bands : {"Y3Co5Cg5", "Y9Co1Cg1", "Y3Co1Cg2", "Y0Co0Cg0", "3", "y3co1cg1", "Y3Co1Cg1 "})
    expectRefused(render({"--bake", bake_, "--bands", bands}), 1, {"--bands", "Y3Co1Cg1"});
  expectRefused(render({"--bake", bake_, "--deringing", "2"}), 1, {"--deringing"});
}

TEST_F(RenderCommand, lightsTheBandsItIsToldAndNamesThem) {
  for (const char* bands : {"Y1Co1Cg1", "Y2Co2Cg2", "Y3Co1Cg1", "Y8Co3Cg3"}) {
    const ProgramResult r = render({"--bake", bake_, "--bands", bands});
    ASSERT_EQ(r.status, 0) << r.err;
    EXPECT_NE(r.out.find(bands), std::string::npos) << r.out;
  }
}

TEST_F(RenderCommand, addsTheLightsOfAFile) {
  const auto file = [](const std::string& text) {
    std::ofstream(folder_ / "lights.json") << text;
    return (folder_ / "lights.json").string();
  };
  const auto brightness = [] {
    double sum = 0.0;
    for (const glm::vec3& c : readExr(image())->layer("")) sum += c.r;
    return sum;
  };
  ASSERT_EQ(render({"--aov", "direct", "--lights", "none"}).status, 0);
  EXPECT_EQ(brightness(), 0.0);
  // A sun from above, twice as bright as another.
  const std::string sun = R"([{"type": "directional", "direction": [0.1, -0.2, 1], "color": [1, 0, 0], "intensity": )";
  ASSERT_EQ(render({"--aov", "direct", "--lights", "none", "--lights-file", file(sun + "2}]")}).status, 0);
  const double one = brightness();
  EXPECT_GT(one, 0.0);
  ASSERT_EQ(render({"--aov", "direct", "--lights", "none", "--lights-file", file(sun + "4}]")}).status, 0);
  EXPECT_NEAR(brightness(), 2.0 * one, 1e-3 * one);

  const std::pair<const char*, const char*> kWrong[] = {
      {"[{", "JSON list"},
      {"{}", "JSON list"},
      {"[3]", "light 0"},
      {R"([{"type": "laser"}])", "type"},
      {R"([{"type": "point"}])", "position"},
      {R"([{"type": "point", "position": [0, 0]}])", "position"},
      {R"([{"type": "point", "position": [0, "a", 0]}])", "position"},
      {R"([{"type": "spot", "position": [0, 0, 0]}])", "direction"},
      {R"([{"type": "directional", "direction": [0, 0, 0]}])", "direction"},
      {R"([{"type": "point", "position": [0, 0, 0], "intensity": -1}])", "dark"},
      {R"([{"type": "point", "position": [0, 0, 0], "range": -1}])", "range"},
      {R"([{"type": "point", "position": [0, 0, 0], "colour": 1}])", "colour"},
      {R"([{"type": "spot", "position": [0, 0, 0], "direction": [0, 0, 1], "innerConeAngle": 1}])", "innerConeAngle"},
  };
  for (const auto& [text, what] : kWrong) {
    expectRefused(render({"--aov", "direct", "--lights", "none", "--lights-file", file(text)}), 3, {what});
  }
  expectRefused(render({"--aov", "direct", "--lights-file", "nowhere.json"}), 2, {"nowhere.json"});
}

TEST_F(RenderCommand, knowsOnlyDirectLightWithoutABake) {
  expectRefused(render({"--aov", "indirect"}), 1, {"--bake"});
  EXPECT_EQ(render({"--aov", "direct"}).status, 0);
}

TEST_F(RenderCommand, refusesABakeOfAnotherScene) {
  // A level of the same parts, one of them changed.
  std::string glb = readAll(kLevel);
  const std::string albedo = "0.62,0.07,0.05";
  const std::size_t at = glb.find(albedo);
  ASSERT_NE(at, std::string::npos);
  glb.replace(at, albedo.size(), "0.61,0.07,0.05");
  const fs::path changed = folder_ / "changed.glb";
  std::ofstream(changed, std::ios::binary) << glb;
  const ProgramResult r =
      runProgram({"render", changed.string(), "--bake", bake_, "-o", image(), "--progress", "none"}, folder_);
  expectRefused(r, 3, {"living_wall_west", "changed"});
}

TEST_F(RenderCommand, saysWhatItCannotRead) {
  expectRefused(
      runProgram({"render", (folder_ / "none.glb").string(), "--bake", bake_, "-o", image(), "--progress", "none"},
                 folder_),
      2, {"none.glb"});
  expectRefused(render({"--bake", (folder_ / "none.relume").string()}), 2, {"none.relume"});
  expectRefused(render({"--bake", kLevel}), 3, {"two_rooms.glb"});
  expectRefused(render({"--bake", bake_, "-o", (folder_ / "no" / "such" / "folder.exr").string()}), 2, {"folder.exr"});
}

TEST_F(RenderCommand, saysSoWithoutEgl) {
  ::setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nonexistent", 1);
  const ProgramResult r = render({"--bake", bake_, "--backend", "gl"});
  ::unsetenv("__EGL_VENDOR_LIBRARY_FILENAMES");
  EXPECT_EQ(r.status, 5) << r.err;
  EXPECT_NE(r.err.find("relume: error: "), std::string::npos) << r.err;
}

}  // namespace
}  // namespace relume
