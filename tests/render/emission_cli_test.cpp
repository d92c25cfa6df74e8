// SPDX-License-Identifier: MIT
// `render` and `reference --emission` as a user runs them: the light is what was asked for, twice as much where twice
// as much was asked for, and every mistake is named.
#include "tests/cli/run_program.h"
#include "tools/images/image_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <initializer_list>
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
    bake(kLevel, "level.relume");
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }
  static std::string file(const std::string& name) { return (folder_ / name).string(); }

  static void bake(const std::string& level, const std::string& output) {
    const ProgramResult made = runProgram(
        {"bake", level, "-o", file(output), "--preset", "draft", "--surfels", "4000", "--progress", "none"}, folder_);
    ASSERT_EQ(made.status, 0) << made.err;
  }
  // The level with other words in its JSON, which end between two of its tokens.
  static std::string changed(const std::string& name, const std::string& words, std::string others) {
    std::string glb = readAll(kLevel);
    while (others.size() % 4 != words.size() % 4) others += ' ';
    glb.replace(glb.find(words), words.size(), others);
    for (const std::size_t at : {8, 12}) {  // lengths: of the file, of its JSON
      std::uint32_t length = 0;
      std::memcpy(&length, &glb[at], sizeof length);
      length += static_cast<std::uint32_t>(others.size() - words.size());
      std::memcpy(&glb[at], &length, sizeof length);
    }
    std::ofstream(file(name), std::ios::binary) << glb;
    return file(name);
  }

  static ProgramResult render(const std::vector<std::string>& more, const std::string& output = "image.exr",
                              const std::string& level = kLevel, const std::string& bake = "level.relume") {
    std::vector<std::string> arguments{"render", level,        "--bake", file(bake), "--size", "32x20",     "--samples",
                                       "1",      "--progress", "none",   "--force",  "-o",     file(output)};
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

// What no bake knows shines by it as well, and is as dark as the rest where emitters are off.
TEST_F(EmissionOption, lightsWhatMoves) {
  const std::string level =
      changed("moving.glb", "{\"mesh\":14,", "{\"extras\":{\"relume\":{\"bake\":\"dynamic\"}},\"mesh\":14,");
  bake(level, "moving.relume");
  const auto light = [&](std::vector<std::string> more) {
    more.insert(more.end(), {"--aov", "indirect"});
    const ProgramResult r = render(more, "image.exr", level, "moving.relume");
    EXPECT_TRUE(r.status == 0 || r.status == 5) << r.err;  // 5: no OpenGL here
    return r.status == 0 ? sumOf("image.exr") : glm::dvec3(-1.0);
  };
  EXPECT_EQ(light({"--dynamic", "solid", "--lights", "none"}), glm::dvec3(0.0));
  const std::vector<std::string> red{"--lights", "none", "--emission", "ring=2,0,0", "--dynamic"};
  const auto with = [](std::vector<std::string> words, std::initializer_list<const char*> more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  EXPECT_EQ(light(with(red, {"receivers"})), glm::dvec3(0.0));
  const glm::dvec3 one = light(with(red, {"solid"})), onGl = light(with(red, {"solid", "--backend", "gl"}));
  EXPECT_GT(one.x, 0.1);
  EXPECT_LT(one.y, 0.01 * one.x);
  if (onGl.x >= 0.0) {
    EXPECT_NEAR(onGl.x, one.x, 0.02 * one.x);
  }
  const glm::dvec3 two = light({"--lights", "none", "--emission", "ring=4,0,0", "--dynamic", "solid"});
  EXPECT_NEAR(two.x, 2.0 * one.x, 0.01 * two.x);
  // Beside what the bake knows, which is driven at the same time.
  const glm::dvec3 both = light(with(red, {"solid", "--emission", "star_blue=0,0,5"}));
  EXPECT_NEAR(both.x, one.x, 0.02 * one.x);
  EXPECT_GT(both.z, 0.1);
  // The level's own, from which it takes its green and blue.
  const glm::dvec3 all = light({"--dynamic", "solid", "--lights", "emissive"}),
                   fewer = light({"--dynamic", "solid", "--lights", "emissive", "--emission", "ring=14,0,0"});
  EXPECT_LT(fewer.z, all.z - 0.1);
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
  // Baked parts have it, but when they were baked it did not emit.
  const std::string later =
      changed("later.glb", "{\"name\":\"grey\",", "{\"emissiveFactor\":[1,1,1],\"name\":\"grey\",");
  const std::vector<std::string> grey{"--allow-stale", "--emission", "grey=1,2,3"};
  expectRefused(render(grey, "image.exr", later), 1, "--emission: \"" + file("level.relume") + "\" knows nothing of");
  // The image is not written over.
  expectRefused(render({"--emission", "screen=" + file("fine.exr")}, "fine.exr"), 1, "an image of --emission");
}

}  // namespace
}  // namespace relume
