// SPDX-License-Identifier: MIT
// `relume render --live` as a user runs it: by voxels, by reflective shadow maps, with cones.
#include "tests/render/render_command.h"
#include "tools/images/image_io.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

using namespace test;

TEST_F(RenderCommand, lightsALevelWithoutABake) {
  const auto live = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"render", kLevel,     "--live",   "--live-cells", "16",    "--live-rays",
                                   "16",     "--camera", "cam_hall", "--size",       "64x36", "--samples",
                                   "1",      "--force",  "-o",       image()};
    words.insert(words.end(), more.begin(), more.end());
    return runProgram(words, folder_);
  };
  const ProgramResult drawn = live({"--lights", "spot,emissive", "--aov", "indirect,voxels,bounced", "--json"});
  ASSERT_EQ(drawn.status, 0) << drawn.err;
  EXPECT_NE(drawn.out.find("\"gather\""), std::string::npos) << drawn.out;
  std::array<double, 3> light{};
  const std::array<std::string, 3> names{"indirect", "voxels", "bounced"};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto picture = readExr(folder_ / ("image." + names[i] + ".exr"));
    ASSERT_TRUE(picture) << picture.error().message;
    for (const float v : picture->channels.begin()->second) light[i] += v;
  }
  EXPECT_GT(light[1], 0.0);
  EXPECT_GT(light[2], 0.0);
  EXPECT_GT(light[0], light[2]) << "emitters send straight to the caches as well";
  expectRefused(live({"--live-cells", "65"}), 1, {"--live-cells"});

  // Smaller voxels about the camera.
  double onCpu[2] = {0.0, 0.0};
  for (const char* backend : {"cpu", "gl"}) {
    const ProgramResult nested =
        live({"--lights", "spot", "--aov", "indirect,voxels", "--live-cascades", "3", "--backend", backend});
    ASSERT_EQ(nested.status, 0) << nested.err;
    for (const std::size_t i : {0u, 1u}) {
      const auto picture = readExr(folder_ / ("image." + names[i] + ".exr"));
      ASSERT_TRUE(picture);
      double sum = 0.0;
      for (const float v : picture->channels.begin()->second) sum += v;
      EXPECT_GT(sum, 0.0) << names[i];
      if (onCpu[i] == 0.0) onCpu[i] = sum;
      EXPECT_NEAR(sum, onCpu[i], 0.05 * onCpu[i]) << names[i] << ", whose shadows are maps";
    }
  }
  expectRefused(live({"--live-cascades", "5"}), 1, {"--live-cascades"});
  expectRefused(live({"--live-cascades", "2", "--bake", bake_}), 1, {"--live-cascades", "--bake"});
  expectRefused(live({"--live-cascades", "2", "--live-transport", "rsm"}), 1, {"--live-cascades", "rsm"});
  expectRefused(live({"--bands", "Y3Co1Cg1"}), 1, {"--bands", "--live-transport rsm"});
  // What only maps read, and what they do not.
  for (const auto& [option, value] : std::vector<std::pair<std::string, std::string>>{{"--rsm-size", "64"},
                                                                                      {"--rsm-samples", "100"},
                                                                                      {"--rsm-frames", "2"},
                                                                                      {"--occupancy", "voxels"},
                                                                                      {"--live-visibility", "exact"},
                                                                                      {"--presence", "2"},
                                                                                      {"--bleeding", "0"}})
    expectRefused(live({option, value}), 1, {option + " needs --live-transport rsm"});
  expectRefused(live({"--live-transport", "rsm"}), 1, {"--live-rays", "--live-transport rsm"});
  expectRefused(live({"--occlusion-falloff", "2"}), 1, {"--occlusion-falloff needs --aov occlusion"});
  expectRefused(live({"--exponent", "50"}), 1, {"--exponent needs --aov glossy"});
}

// A level that was edited since its bake: what changed is told, and what is asked for without it refused by name.
TEST_F(RenderCommand, drawsAnEditedLevelWithItsOldBake) {
  const std::vector<std::string> edited{"--bake",      bake_, "--edited-from", kLevel, "--live-cells", "16",
                                        "--live-rays", "16",  "--force"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), edited.begin(), edited.end());
    return render(more);
  };
  const ProgramResult drawn = with({"--move-node", "sofa=0.8,0,0.3", "--camera", "cam_living", "--json"});
  ASSERT_EQ(drawn.status, 0) << drawn.err;
  EXPECT_NE(drawn.out.find("\"edits\":[\"node \\\"sofa\\\" moved\"]"), std::string::npos) << drawn.out;
  EXPECT_NE(drawn.out.find("before the edit: "), std::string::npos) << drawn.out;
  const ProgramResult told = with({"--move-node", "sofa=0.8,0,0.3", "--lights", "lamp", "--gloss"});
  ASSERT_EQ(told.status, 0) << told.err;
  EXPECT_NE(told.out.find("since the bake: node \"sofa\" moved"), std::string::npos) << told.out;
  const ProgramResult asBaked = with({"--json"});
  ASSERT_EQ(asBaked.status, 0) << asBaked.err;
  EXPECT_NE(asBaked.out.find("\"edits\":[]"), std::string::npos) << asBaked.out;
  const ProgramResult inWords = with({});
  EXPECT_NE(inWords.out.find("drawn by the bake alone"), std::string::npos) << inWords.out;
  expectRefused(with({"--move-node", "sofa=0.8,0,0.3", "--edit-reach", "-1"}), 1, {"--edit-reach"});
  expectRefused(render({"--edited-from", kLevel}), 1, {"--edited-from", "--bake"});
  expectRefused(render({"--edit-fade", "2"}), 1, {"--edit-fade", "--edited-from"});
  expectRefused(render({"--live-cells", "16"}), 1, {"--live-cells", "--live"});
  expectRefused(render({"--bake", bake_, "--edited-from", bake_}), 3, {"level.relume"});
}

// A wall that stands elsewhere: the pictures of live light and of path tracing have it there, and the light behind it.
TEST_F(RenderCommand, movesANode) {
  const auto green = [&](std::vector<std::string> words) {
    words.insert(words.begin() + 1, kLevel);
    for (const char* word :
         {"--camera", "cam_hall", "--lights", "lamp", "--size", "48x27", "--progress", "none", "--force", "-o"})
      words.emplace_back(word);
    words.push_back(image());
    const ProgramResult drawn = runProgram(words, folder_);
    EXPECT_EQ(drawn.status, 0) << drawn.err;
    const auto picture = readExr(image());
    EXPECT_TRUE(picture);
    const bool isTraced = picture->channels.count("DiffInd.G") > 0;
    double sum = 0.0;
    for (const float v : picture->channels.at(isTraced ? "DiffInd.G" : "G")) sum += v;
    return sum;
  };
  // The lamp is in the other room: its light comes through the doorway, and over the walls once they have sunk.
  const std::vector<std::string> live{"render", "--live", "--live-cells", "24", "--samples", "1", "--aov", "indirect"},
      traced{"reference", "--spp", "64"},
      sunk{"--move-node", "living_wall_east=0,-2,0", "--move-node", "hall_wall_west=0,-2,0"};
  const auto with = [](std::vector<std::string> words, const std::vector<std::string>& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  const double shut = green(live), open = green(with(live, sunk));
  const double tracedShut = green(traced), tracedOpen = green(with(traced, sunk));
  EXPECT_GT(tracedOpen, 3.0 * tracedShut) << "the test's walls hide nothing";
  EXPECT_NEAR(open, tracedOpen, 0.3 * tracedOpen);
  EXPECT_NEAR(shut, tracedShut, 0.4 * tracedShut);

  expectRefused(render({"--live", "--aov", "indirect", "--move-node", "nothing=1,0,0"}), 1,
                {"--move-node", "\"nothing\"", "\"bench\""});
  expectRefused(render({"--live", "--aov", "indirect", "--move-node", "sofa=1,nan,0"}), 1,
                {"--move-node", "sofa=1,nan,0"});
  expectRefused(render({"--bake", bake_, "--move-node", "sofa=1,0,0"}), 1, {"\"sofa\"", "part of the bake"});
  EXPECT_EQ(render({"--bake", bake_, "--move-node", "toy=1,0,0"}).status, 0);
}

// The toy under the lamp: its shadow in the bake's light is the path tracer's, and without --dynamic solid there is
// none.
TEST_F(RenderCommand, dynamicNodesShadowABakesLight) {
  const auto light = [&](const std::vector<std::string>& words, const std::string& channel) {
    std::vector<std::string> all = words;
    all.insert(all.begin() + 1, kLevel);
    for (const char* word : {"--eye", "4.55,0.8,2.2", "--target", "3.9,0,1.3", "--fov", "20", "--lights", "lamp",
                             "--size", "48x27", "--progress", "none", "--force", "-o"})
      all.emplace_back(word);
    all.push_back(image());
    const ProgramResult drawn = runProgram(all, folder_);
    EXPECT_EQ(drawn.status, 0) << drawn.err;
    const auto picture = readExr(image());
    EXPECT_TRUE(picture);
    double sum = 0.0;
    // The floor before the toy: the lower quarter of the picture
    for (std::size_t i = std::size_t{48} * 20; i < std::size_t{48} * 27; ++i) sum += picture->channels.at(channel)[i];
    return sum;
  };
  const std::vector<std::string> drawn{"render", "--bake", bake_, "--samples", "1", "--aov", "indirect"},
      traced{"reference", "--spp", "256"};
  const auto with = [](std::vector<std::string> words, const char* dynamic) {
    words.insert(words.end(), {"--dynamic", dynamic});
    return words;
  };
  const double apart = light(drawn, "G"), solid = light(with(drawn, "solid"), "G");
  EXPECT_EQ(light(with(drawn, "receivers"), "G"), apart);
  const double tracedApart = light(with(traced, "receivers"), "DiffInd.G"),
               tracedSolid = light(with(traced, "solid"), "DiffInd.G");
  const double share = solid / apart, tracedShare = tracedSolid / tracedApart;
  EXPECT_LT(tracedShare, 0.97) << "the toy hides nothing in this view";
  EXPECT_NEAR(share, tracedShare, 0.6 * (1.0 - tracedShare));
  expectRefused(render({"--dynamic", "solid"}), 1, {"--dynamic solid", "--bake"});
  // OpenGL hides as much of what it draws.
  if (render({"--bake", bake_, "--backend", "gl", "--dynamic", "solid"}).status == 5) return;  // no OpenGL here
  std::vector<std::string> onGl = drawn;
  onGl.insert(onGl.end(), {"--backend", "gl"});
  const double shareOnGl = light(with(onGl, "solid"), "G") / light(onGl, "G");
  EXPECT_NEAR(shareOnGl, share, 0.1 * (1.0 - share));
}

TEST_F(RenderCommand, lightsALevelByReflectiveShadowMaps) {
  const auto live = [&](std::vector<std::string> more) {
    std::vector<std::string> words{
        "render",   kLevel,         "--live",   "--live-transport", "rsm",     "--live-cells",
        "16",       "--rsm-frames", "2",        "--rsm-size",       "64",      "--camera",
        "cam_hall", "--lights",     "spot",     "--size",           "64x36",   "--samples",
        "1",        "--aov",        "indirect", "--json",           "--force", "-o",
        image()};
    words.insert(words.end(), more.begin(), more.end());
    return runProgram(words, folder_);
  };
  const auto lightOf = [&](const std::vector<std::string>& more) {
    const ProgramResult drawn = live(more);
    EXPECT_EQ(drawn.status, 0) << drawn.err;
    for (const char* pass : {"occupancy", "first bounce", "next bounces", "blend", "resolve"})
      EXPECT_NE(drawn.out.find(std::string("\"") + pass + "\""), std::string::npos) << drawn.out;
    const auto picture = readExr(image());
    double sum = 0.0;
    for (const auto& [name, channel] : picture->channels) {
      for (const float v : channel) sum += v;
    }
    return sum;
  };
  const double once = lightOf({"--bounces", "1", "--occupancy", "depth"}), all = lightOf({});
  EXPECT_GT(once, 0.0);
  EXPECT_GT(all, once);
  EXPECT_NEAR(lightOf({"--bounces", "1", "--occupancy", "none", "--bands", "Y3Co3Cg3"}), once, 0.1 * once);
  EXPECT_NEAR(lightOf({"--bounces", "1", "--presence", "2"}), 2.0 * once, 0.1 * once);
  EXPECT_GT(lightOf({"--bounces", "1", "--live-visibility", "none"}), once);
  EXPECT_NE(live({"--lights", "emissive"}).err.find("punctual lights"), std::string::npos);
  expectRefused(live({"--occupancy", "depth"}), 1, {"--occupancy depth", "--bounces 1"});
  expectRefused(live({"--bands", "Y4Co1Cg1"}), 1, {"--bands Y4Co1Cg1", "3 bands"});
  expectRefused(live({"--rsm-samples", "0"}), 1, {"--rsm-samples"});
}

// Gloss by cones through voxels that live light or a bake lights, and how open the surroundings are.
TEST_F(RenderCommand, followsConesThroughALevel) {
  const auto draw = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"render",   kLevel,    "--live", "--live-cells", "16", "--camera",
                                   "cam_hall", "--size",  "48x27",  "--samples",    "1",  "--lights",
                                   "spot",     "--force", "-o",     image()};
    if (std::find(more.begin(), more.end(), "rsm") == more.end()) words.insert(words.end(), {"--live-rays", "16"});
    words.insert(words.end(), more.begin(), more.end());
    return runProgram(words, folder_);
  };
  const auto meanOf = [&](const std::string& name) {
    const auto picture = readExr(folder_ / ("image." + name + ".exr"));
    EXPECT_TRUE(picture);
    double sum = 0.0;
    for (const glm::vec3& p : picture->layer("")) sum += p.y / (48.0 * 27.0);
    return sum;
  };
  ASSERT_EQ(draw({"--aov", "glossy,occlusion", "--exponent", "64"}).status, 0);
  const double live = meanOf("glossy"), open = meanOf("occlusion");
  EXPECT_GT(open, 0.3);
  EXPECT_LT(open, 1.0);
  // Reflective shadow maps light the same voxels once.
  ASSERT_EQ(draw({"--aov", "glossy,occlusion", "--exponent", "64", "--bounces", "1"}).status, 0);
  const double once = meanOf("glossy");
  const std::vector<std::string> byMaps{"--live-transport", "rsm",        "--rsm-frames", "1",     "--aov",
                                        "glossy,voxels",    "--exponent", "64",           "--json"};
  const ProgramResult maps = draw(byMaps);
  ASSERT_EQ(maps.status, 0) << maps.err;
  EXPECT_NE(maps.out.find("\"inject\""), std::string::npos) << maps.out;
  EXPECT_GT(meanOf("voxels"), 0.0);
  EXPECT_NEAR(meanOf("glossy"), once, 0.1 * once);
  ASSERT_EQ(draw({"--live-transport", "rsm", "--rsm-frames", "1", "--gloss", "--aov", "full,direct"}).status, 0);
  ASSERT_EQ(draw({"--aov", "glossy,occlusion", "--exponent", "64", "--occlusion-falloff", "100"}).status, 0);
  EXPECT_GT(meanOf("occlusion"), open);
  const ProgramResult dark = draw({"--aov", "occlusion,depth", "--json"});
  EXPECT_EQ(dark.out.find("\"gather\""), std::string::npos) << "no light is gathered that nobody asked for";
  EXPECT_NEAR(meanOf("occlusion"), open, 1e-6);
  const ProgramResult baked =
      draw({"--bake", bake_, "--aov", "glossy,indirect,occlusion", "--exponent", "64", "--json"});
  ASSERT_EQ(baked.status, 0) << baked.err;
  EXPECT_NE(baked.out.find("\"mips\""), std::string::npos) << baked.out;
  EXPECT_NEAR(meanOf("glossy"), live, 0.35 * live);
  ASSERT_EQ(draw({"--gloss", "--aov", "full,glossy"}).status, 0);
  EXPECT_GT(meanOf("glossy"), 0.0);
  expectRefused(draw({"--bake", "none.relume"}), 2, {"none.relume"});
  expectRefused(draw({"--aov", "occlusion,direct", "--occlusion-falloff", "-1"}), 1, {"--occlusion-falloff"});
  expectRefused(render({"--bake", bake_, "--aov", "occlusion"}), 1, {"--aov occlusion", "--live"});
}

// The same in OpenGL: voxels by its shadow maps, surfaces by its raster, cones by its passes.
TEST_F(RenderCommand, followsConesInOpenGlAsOnTheCpu) {
  const auto draw = [&](const std::string& backend, std::vector<std::string> more) {
    std::vector<std::string> words{"render",      kLevel,      "--live",   "--live-cells", "16",
                                   "--live-rays", "16",        "--camera", "cam_hall",     "--size",
                                   "48x27",       "--samples", "1",        "--backend",    backend,
                                   "--lights",    "spot",      "--force",  "-o",           image()};
    words.insert(words.end(), more.begin(), more.end());
    return runProgram(words, folder_);
  };
  const auto layer = [&](const std::string& name) {
    const auto picture = readExr(folder_ / ("image." + name + ".exr"));
    EXPECT_TRUE(picture);
    return std::vector<glm::vec3>(picture->layer(""));
  };
  // Mean difference of two pictures over the mean of the first.
  const auto difference = [](const std::vector<glm::vec3>& a, const std::vector<glm::vec3>& b) {
    double sum = 0.0, off = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      sum += a[i].y;
      off += std::abs(a[i].y - b[i].y);
    }
    EXPECT_GT(sum, 0.0);
    return off / sum;
  };
  const std::vector<std::string> wanted{"--aov", "occlusion,glossy,indirect,voxels", "--exponent", "64"};
  const ProgramResult onGl = draw("gl", wanted);
  if (onGl.status == 5) GTEST_SKIP() << onGl.err;
  ASSERT_EQ(onGl.status, 0) << onGl.err;
  const auto open = layer("occlusion"), glossy = layer("glossy"), indirect = layer("indirect"),
             voxels = layer("voxels");
  ASSERT_EQ(draw("cpu", wanted).status, 0);
  EXPECT_LE(difference(layer("occlusion"), open), 0.01);
  EXPECT_LE(difference(layer("glossy"), glossy), 0.1);
  EXPECT_LE(difference(layer("indirect"), indirect), 0.1);
  EXPECT_LE(difference(layer("voxels"), voxels), 0.1);

  // Volumes in one another about the camera
  const std::vector<std::string> nested{"--live-cascades", "3", "--aov", "occlusion,glossy", "--exponent", "64"};
  ASSERT_EQ(draw("gl", nested).status, 0);
  const auto nestedOpen = layer("occlusion"), nestedGlossy = layer("glossy");
  EXPECT_GT(difference(open, nestedOpen), 0.02) << "cones see the inner volumes";
  ASSERT_EQ(draw("cpu", nested).status, 0);
  EXPECT_LE(difference(layer("occlusion"), nestedOpen), 0.01);
  EXPECT_LE(difference(layer("glossy"), nestedGlossy), 0.1);

  // A bake lights the voxels by rays on both.
  const std::vector<std::string> baked{"--bake", bake_, "--aov", "occlusion,glossy", "--exponent", "16"};
  ASSERT_EQ(draw("gl", baked).status, 0);
  const auto mirrored = layer("glossy");
  EXPECT_LE(difference(open, layer("occlusion")), 1e-5);
  ASSERT_EQ(draw("cpu", baked).status, 0);
  EXPECT_LE(difference(layer("glossy"), mirrored), 0.02);

  // Materials' gloss; and occlusion alone, for which nothing is lit.
  ASSERT_EQ(draw("gl", {"--gloss", "--aov", "full,bounced"}).status, 0);
  const auto full = layer("full");
  ASSERT_EQ(draw("cpu", {"--gloss", "--aov", "full,bounced"}).status, 0);
  EXPECT_LE(difference(layer("full"), full), 0.1);
  const ProgramResult dark = draw("gl", {"--aov", "occlusion,depth", "--json"});
  ASSERT_EQ(dark.status, 0) << dark.err;
  EXPECT_EQ(dark.out.find("\"gather\": 0"), std::string::npos);
  EXPECT_LE(difference(open, layer("occlusion")), 1e-5);
  expectRefused(draw("gl", {"--live-transport", "rsm", "--aov", "indirect"}), 1, {"--live-transport rsm", "CPU"});
}

}  // namespace
}  // namespace relume
