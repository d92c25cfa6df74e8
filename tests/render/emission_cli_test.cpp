// SPDX-License-Identifier: MIT
// `render` and `reference --emission` as a user runs them: the light is what was asked for, twice as much where twice
// as much was asked for, and every mistake is named.
#include "tests/cli/run_program.h"
#include "tools/images/image_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <limits>

namespace relume {
namespace {

namespace fs = std::filesystem;
const std::string kLevel = RELUME_SOURCE_DIR "/samples/area_lights/stars.glb";

class EmissionOption : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = fs::temp_directory_path() / ("relume_emission_" + std::to_string(::getpid()));
    fs::create_directories(folder_);
    const ProgramResult made = runProgram(
        {"bake", kLevel, "-o", file("level.relume"), "--preset", "draft", "--surfels", "4000", "--progress", "none"},
        folder_);
    ASSERT_EQ(made.status, 0) << made.err;
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }
  static std::string file(const std::string& name) { return (folder_ / name).string(); }

  static ProgramResult render(const std::vector<std::string>& more, const std::string& output = "image.exr") {
    std::vector<std::string> arguments{"render",  kLevel,      "--bake",    file("level.relume"), "--size",
                                       "32x20",   "--samples", "1",         "--progress",         "none",
                                       "--force", "-o",        file(output)};
    if (std::find(more.begin(), more.end(), "--aov") == more.end())
      arguments.insert(arguments.end(), {"--aov", "full"});
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runProgram(arguments, folder_);
  }
  // Sum of the light of an image that was drawn.
  static glm::dvec3 sumOf(const std::string& output, const std::vector<std::string>& layers = {""}) {
    const Result<ChannelImage> image = readExr(file(output));
    EXPECT_TRUE(image);
    glm::dvec3 sum(0.0);
    for (const std::string& layer : layers) {
      for (const glm::vec3& pixel : image ? image->layer(layer) : std::vector<glm::vec3>()) sum += glm::dvec3(pixel);
    }
    return sum;
  }
  static void expectRefused(const ProgramResult& r, int status, const std::string& words) {
    EXPECT_EQ(r.status, status) << r.err;
    EXPECT_NE(r.err.find(words), std::string::npos) << "\"" << words << "\" in: " << r.err;
  }

  static fs::path folder_;
};
fs::path EmissionOption::folder_;

TEST_F(EmissionOption, lightsWhatItNamesAlone) {
  ASSERT_EQ(render({"--lights", "none", "--emission", "ring=2,0,0"}, "one.exr").status, 0);
  ASSERT_EQ(render({"--lights", "none", "--emission", "ring=4,0,0"}, "two.exr").status, 0);
  ASSERT_EQ(render({"--lights", "none"}, "dark.exr").status, 0);
  EXPECT_EQ(sumOf("dark.exr"), glm::dvec3(0.0));
  const glm::dvec3 one = sumOf("one.exr"), two = sumOf("two.exr");
  EXPECT_GT(one.x, 1.0);
  EXPECT_LT(one.y, 0.001 * one.x);  // packed colours are rounded with a dither
  EXPECT_NEAR(two.x, 2.0 * one.x, 0.01 * two.x);
  // Beside the level's own, which it replaces on that material.
  ASSERT_EQ(render({}, "all.exr").status, 0);
  ASSERT_EQ(render({"--emission", "ring=0,0,0", "--emission", "star_red=0,0,0"}, "fewer.exr").status, 0);
  EXPECT_LT(sumOf("fewer.exr").x, 0.7 * sumOf("all.exr").x);
  EXPECT_GT(sumOf("fewer.exr").x, 0.1 * sumOf("all.exr").x);
}

TEST_F(EmissionOption, anImageIsReadAndLitAsTheReferenceDoes) {
  std::vector<glm::vec3> texels(16 * 8, glm::vec3(0.0f));
  for (std::size_t i = 0; i < texels.size(); ++i) texels[i] = i % 16 < 8 ? glm::vec3(20, 4, 0) : glm::vec3(0, 4, 20);
  ASSERT_TRUE(writeImage(file("signs.exr"), 16, 8, texels));
  const std::vector<std::string> driven = {"--lights", "none", "--emission", "screen=" + file("signs.exr")};
  std::vector<std::string> light = driven;
  light.insert(light.end(), {"--aov", "indirect"});
  ASSERT_EQ(render(light).status, 0);
  std::vector<std::string> reference{"reference", kLevel,       "--size", "32x20", "--spp",
                                     "64",        "--progress", "none",   "-o",    file("truth.exr")};
  reference.insert(reference.end(), driven.begin(), driven.end());
  const ProgramResult traced = runProgram(reference, folder_);
  ASSERT_EQ(traced.status, 0) << traced.err;
  const glm::dvec3 found = sumOf("image.exr"), expected = sumOf("truth.exr", {"DiffDir", "DiffInd"});
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 0.05 * expected[c]);
  light.insert(light.end(), {"--backend", "gl"});
  const ProgramResult gl = render(light, "gl.exr");
  if (gl.status == 5) return;  // no OpenGL here
  ASSERT_EQ(gl.status, 0) << gl.err;
  const glm::dvec3 onGl = sumOf("gl.exr");
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(onGl[c], found[c], 0.02 * found[c]);
}

TEST_F(EmissionOption, mistakesAreNamed) {
  expectRefused(render({"--emission", "ring"}), 1, "MATERIAL=R,G,B, three numbers of 0 to 1e9");
  expectRefused(render({"--emission", "ring=1,2"}), 1, "\"ring=1,2\" found");
  expectRefused(render({"--emission", "ring=1,-2,3"}), 1, "\"ring=1,-2,3\" found");
  expectRefused(render({"--emission", "ring=1,2e9,3"}), 1, "found");
  expectRefused(render({"--emission", "=1,2,3"}), 1, "found");
  expectRefused(render({"--emission", "ring=1,2,3", "--emission", "ring=1,1,1"}), 1, "\"ring\" appears twice");
  expectRefused(render({"--emission", "white=1,2,3"}), 1, "no material \"white\" in the scene that emits");
  expectRefused(render({"--emission", "moon=1,2,3"}), 1, "there are: \"screen\", \"star_red\"");
  expectRefused(render({"--emission", "screen=" + file("none.exr")}), 2, "no such file");
  std::vector<glm::vec3> texels(4, glm::vec3(1.0f));
  ASSERT_TRUE(writeImage(file("fine.exr"), 2, 2, texels));
  expectRefused(render({"--emission", "ring=" + file("fine.exr")}), 1, "has no texture coordinates");
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1.0f}) {
    texels[3].y = bad;
    ASSERT_TRUE(writeImage(file("bad.exr"), 2, 2, texels));
    expectRefused(render({"--emission", "screen=" + file("bad.exr")}), 3, "texel 1, 1 is negative, not finite");
  }
  // The image is not written over.
  expectRefused(render({"--emission", "screen=" + file("fine.exr")}, "fine.exr"), 1, "an image of --emission");
}

}  // namespace
}  // namespace relume
