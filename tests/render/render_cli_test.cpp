// SPDX-License-Identifier: MIT
// `relume render` as a user runs it: what it writes, and what it says when it cannot.
#include "tests/cli/make_gltf.h"
#include "tests/render/render_command.h"
#include "tools/images/image_io.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb_image.h>
#pragma GCC diagnostic pop

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>

namespace relume {
namespace {

using namespace test;

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

TEST_F(RenderCommand, drawsTheGlossOfMaterials) {
  ASSERT_EQ(render({"--bake", bake_, "--gloss", "--aov", "full,glossy,albedo"}).status, 0);
  const auto full = readExr(folder_ / "image.full.exr"), glossy = readExr(folder_ / "image.glossy.exr");
  ASSERT_TRUE(full && glossy);
  double all = 0.0, mirrored = 0.0;
  for (const glm::vec3& p : full->layer("")) all += p.y;
  for (const glm::vec3& p : glossy->layer("")) mirrored += p.y;
  EXPECT_GT(mirrored, 0.0);
  EXPECT_GT(all, mirrored);
  expectRefused(render({"--bake", bake_, "--gloss", "--exponent", "4", "--aov", "glossy"}), 1,
                {"--exponent", "--gloss"});
  expectRefused(render({"--bake", bake_, "--aov", "glossy"}), 1, {"--exponent", "--gloss"});
  for (const char* const none : {"-1", "nan", "inf", "10001", "wide"})
    expectRefused(render({"--bake", bake_, "--aov", "glossy", "--exponent", none}), 1,
                  {"--exponent", "0 to 10000", none});
  EXPECT_EQ(render({"--bake", bake_, "--aov", "glossy", "--exponent", "0"}).status, 0) << "the half above a surface";
  expectRefused(render({"--bake", bake_, "--gloss", "--aov", "unbounced"}), 1, {"--aov unbounced", "--gloss"});
}

TEST_F(RenderCommand, referenceHasTheSameGloss) {
  const auto reference = [](std::vector<std::string> more) {
    std::vector<std::string> arguments{"reference", kLevel,       "--size", "32x18", "--spp",
                                       "8",         "--progress", "none",   "-o",    image()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return runProgram(arguments, folder_);
  };
  ASSERT_EQ(reference({"--gloss"}).status, 0);
  const auto traced = readExr(image());
  ASSERT_TRUE(traced);
  const auto radiance = traced->layer(""), indirect = traced->layer("GlossInd"), direct = traced->layer("GlossDir");
  ASSERT_EQ(indirect.size(), radiance.size());
  for (std::size_t i = 0; i < radiance.size(); ++i) EXPECT_GE(radiance[i].y + 1e-4f, indirect[i].y + direct[i].y);
  expectRefused(reference({"--gloss", "--exponent", "4"}), 1, {"--exponent", "--gloss"});
  expectRefused(reference({"--aov", "glossy"}), 1, {"--exponent", "--gloss"});
  for (const char* const none : {"-1", "nan", "inf", "10001"})
    expectRefused(reference({"--aov", "glossy", "--exponent", none}), 1, {"--exponent", "0 to 10000", none});
}

TEST_F(RenderCommand, namesWhatThereIsWhenANameIsUnknown) {
  expectRefused(render({"--bake", bake_, "--camera", "nowhere"}), 1, {"--camera", "nowhere", "cam_living", "cam_hall"});
  expectRefused(render({"--bake", bake_, "--lights", "torch"}), 1,
                {"--lights", "torch", "sun", "lamp", "spot", "emissive"});
  expectRefused(render({"--bake", bake_, "--lights", "all,sun"}), 1, {"\"all\""});
  expectRefused(render({"--bake", bake_, "--aov", "full,direct,full"}), 1, {"--aov: \"full\" found twice"});
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
  for (const char* sky :
       {"1,1", "1,1,1,1", "1,1,1,1,1,-1", "1,1,1,1,1,1,1", "1,1,1,", "1,nan,1", "1,inf,1", "a,b,c", ""})
    expectRefused(render({"--bake", bake_, "--sky", sky}), 1, {"--sky", "R,G,B"});
  for (const char* exposure : {"nan", "inf", "31", "-31", "bright", "1 ", ""})
    expectRefused(render({"--bake", bake_, "--exposure", exposure}), 1, {"--exposure", "auto"});
  for (const char* fov : {"0", "nan", "180", "-60"})
    expectRefused(render({"--bake", bake_, "--fov", fov}), 1, {"--fov", "1..170"});
  for (const char* bands : {"Y3Co5Cg5", "Y9Co1Cg1", "Y3Co1Cg2", "Y0Co0Cg0", "3", "y3co1cg1", "Y3Co1Cg1 "})
    expectRefused(render({"--bake", bake_, "--bands", bands}), 1, {"--bands", "Y3Co1Cg1"});
}

TEST_F(RenderCommand, looksFromWhereItIsTold) {
  // From the middle of the hall straight down: the floor's height, and up in the image is -Z.
  ASSERT_EQ(render({"--aov", "position", "--eye", "3,1.5,2", "--target", "3,0,2", "--fov", "40"}).status, 0);
  const auto position = readExr(image())->layer("");
  const glm::vec3 centre = position[9 * 32 + 16], higher = position[4 * 32 + 16];
  EXPECT_NEAR(centre.x, 3.0f, 0.1f);
  EXPECT_NEAR(centre.z, 2.0f, 0.1f);
  EXPECT_LT(higher.z, centre.z - 0.1f);

  expectRefused(render({"--aov", "albedo", "--eye", "1,1,1"}), 1, {"--target"});
  expectRefused(render({"--aov", "albedo", "--target", "1,1,1"}), 1, {"--eye"});
  expectRefused(render({"--aov", "albedo", "--eye", "1,1,1", "--target", "1,1,1"}), 1, {"--target", "1,1,1"});
  expectRefused(render({"--aov", "albedo", "--eye", "1,1", "--target", "1,1,1"}), 1, {"--eye", "X,Y,Z"});
  expectRefused(render({"--aov", "albedo", "--eye", "1,nan,1", "--target", "1,1,1"}), 1, {"--eye", "X,Y,Z"});
  expectRefused(render({"--aov", "albedo", "--eye", "1,3e38,1", "--target", "1,1,1"}), 1, {"--eye", "within 1e8"});
  expectRefused(render({"--aov", "albedo", "--eye", "1,1,1", "--target", "1,-1e20,1"}), 1, {"--target", "within 1e8"});
  expectRefused(render({"--aov", "albedo", "--eye", "1,1,1", "--target", "2,1,1", "--camera", "cam_hall"}), 1,
                {"--camera"});
}

// Editors show the names of nodes: Blender's camera "cam_nave" is "Camera" in the file, on a node of that name.
TEST_F(RenderCommand, camerasAndLightsAnswerToTheirNodes) {
  const fs::path level = folder_ / "room.gltf";
  std::ofstream(level, std::ios::binary) << makeGltf(GltfParts{});
  const auto draw = [&](const std::string& name) {
    return runProgram({"render", level.string(), "--aov", "position", "-o", image(), "--size", "32x18", "--samples",
                       "1", "--camera", name, "--progress", "none"},
                      folder_);
  };
  EXPECT_EQ(draw("cam").status, 0);
  EXPECT_EQ(draw("Eye").status, 0);
  expectRefused(draw("eye"), 1, {"--camera", "\"cam\" (node \"Eye\")"});
}

TEST_F(RenderCommand, framesALevelThatHasNoCamera) {
  // A closed room is looked at from within, an open box through its open side.
  for (const bool open : {false, true}) {
    GltfParts parts;
    if (open) parts.room.index.resize(parts.room.index.size() - 6);  // the wall at +Z
    std::string gltf = makeGltf(parts);
    const std::string camera = "\"camera\":0,";
    gltf.erase(gltf.find(camera), camera.size());
    const fs::path level = folder_ / "room.gltf";
    std::ofstream(level, std::ios::binary) << gltf;
    const ProgramResult r = runProgram({"render", level.string(), "--aov", "position", "-o", image(), "--size", "32x18",
                                        "--samples", "1", "--progress", "plain"},
                                       folder_);
    ASSERT_EQ(r.status, 0) << r.err;
    EXPECT_NE(r.err.find("no camera"), std::string::npos) << r.err;
    EXPECT_NE(r.err.find("--eye"), std::string::npos) << r.err;
    const auto position = readExr(image())->layer("");
    const auto hits =
        std::count_if(position.begin(), position.end(), [](const glm::vec3& p) { return p != glm::vec3(0.0f); });
    EXPECT_GT(hits, 32 * 18 / 4) << (open ? "open" : "closed");
  }
  expectRefused(runProgram({"render", (folder_ / "room.gltf").string(), "--aov", "direct", "-o", image(), "--camera",
                            "cam", "--progress", "none"},
                           folder_),
                1, {"--camera", "none"});
}

// 8-bit values of a PNG, RGB.
std::vector<std::uint8_t> readPng(const fs::path& path) {
  const std::string file = readAll(path);
  int width = 0, height = 0, channels = 0;
  stbi_uc* pixels = stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(file.data()), static_cast<int>(file.size()),
                                          &width, &height, &channels, 3);
  if (pixels == nullptr) return {};
  std::vector<std::uint8_t> rgb(pixels, pixels + 3 * std::size_t(width) * std::size_t(height));
  stbi_image_free(pixels);
  return rgb;
}

TEST_F(RenderCommand, pngsOfGeometryAreMappedToWhatAPersonCanSee) {
  const std::vector<std::string> layers{"--aov", "normal,position,depth", "--camera", "cam_hall"};
  ASSERT_EQ(render(layers).status, 0);
  std::vector<std::string> asPng = layers;
  asPng.insert(asPng.end(), {"-o", (folder_ / "g.png").string(), "--json"});
  const ProgramResult r = render(asPng);
  ASSERT_EQ(r.status, 0) << r.err;
  const nlohmann::json png = nlohmann::json::parse(r.out).at("png");
  EXPECT_FALSE(png.contains("exposureStops"));
  const auto layer = [&](const char* name) {
    return readExr(folder_ / ("image." + std::string(name) + ".exr"))->layer("");
  };
  const auto normal = layer("normal"), position = layer("position"), depth = layer("depth");
  const auto normals = readPng(folder_ / "g.normal.png"), positions = readPng(folder_ / "g.position.png"),
             depths = readPng(folder_ / "g.depth.png");
  ASSERT_EQ(depths.size(), 3 * depth.size());
  const float nearest = png.at("depthWhiteM"), farthest = png.at("depthDarkestM");
  for (std::size_t i = 0; i < depth.size(); ++i) {
    const bool hit = depth[i].x > 0.0f;
    for (int c = 0; c < 3; ++c) {
      const std::size_t at = 3 * i + static_cast<std::size_t>(c);
      const float low = png.at("positionBlackM")[c], high = png.at("positionWhiteM")[c];
      EXPECT_NEAR(normals[at], hit ? 255.0f * (0.5f * normal[i][c] + 0.5f) : 0.0f, 0.51f);
      EXPECT_NEAR(positions[at], hit ? 255.0f * (position[i][c] - low) / (high - low) : 0.0f, 0.51f);
      EXPECT_NEAR(depths[at], hit ? 255.0f * (1.0f - 0.9f * (depth[i].x - nearest) / (farthest - nearest)) : 0.0f,
                  0.51f);
    }
  }
}

TEST_F(RenderCommand, theExposureOfAPngComesFromThePictureAndCanBeRepeated) {
  const std::string a = (folder_ / "a.png").string(), b = (folder_ / "b.png").string();
  const auto draw = [&](const std::string& output, const std::string& intensity, std::vector<std::string> more) {
    std::ofstream(folder_ / "sun.json") << R"([{"type": "directional", "direction": [0.1, -0.2, 1], "intensity": )"
                                        << intensity << "}]";
    std::vector<std::string> arguments{"--aov", "direct",        "--lights",
                                       "none",  "--json",        "-o",
                                       output,  "--lights-file", (folder_ / "sun.json").string()};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult r = render(arguments);
    EXPECT_EQ(r.status, 0) << r.err;
    return nlohmann::json::parse(r.out).at("png").at("exposureStops").get<double>();
  };
  // A thousand times the light: ten stops less, the same picture but for the rounding of the stops.
  const double dim = draw(a, "0.01", {}), bright = draw(b, "10.24", {});
  EXPECT_NEAR(dim - bright, 10.0, 1e-5);
  EXPECT_EQ(readPng(a), readPng(b));
  // The number gives the picture again.
  draw(a, "10.24", {"--exposure", std::to_string(bright)});
  EXPECT_EQ(readPng(a), readPng(b));
  // Without light there is nothing to expose.
  EXPECT_EQ(draw(a, "0", {}), 0.0);
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

  // However long its direction is.
  for (const char* direction : {"[1e29, -2e29, 1e30]", "[1e-41, -2e-41, 1e-40]", "[1e-310, -2e-310, 1e-309]"}) {
    const std::string text = R"([{"type": "directional", "direction": )" + std::string(direction) +
                             R"(, "color": [1, 0, 0], "intensity": 2}])";
    ASSERT_EQ(render({"--aov", "direct", "--lights", "none", "--lights-file", file(text)}).status, 0);
    EXPECT_NEAR(brightness(), one, 1e-3 * one) << direction;
    const ProgramResult lit =
        render({"--bake", bake_, "--aov", "indirect", "--lights", "none", "--lights-file", file(text)});
    EXPECT_EQ(lit.status, 0) << lit.err;
    EXPECT_GT(brightness(), 0.0) << direction;
  }

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

TEST_F(RenderCommand, aSkyMapLightsWhatASkyOfItsRadianceDoes) {
  const std::string sky = (folder_ / "sky.exr").string();
  ChannelImage map{4, 2, {}};
  const std::vector<glm::vec3> even(8, glm::vec3(1.0f, 2.0f, 3.0f));
  map.setLayer("", even);
  ASSERT_TRUE(writeExr(sky, map));
  const auto drawn = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"--bake", bake_, "--lights", "none", "--force"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult r = render(arguments);
    EXPECT_EQ(r.status, 0) << r.err;
    const auto picture = readExr(image());
    return picture ? picture->layer("") : std::vector<glm::vec3>();
  };
  const auto constant = drawn({"--sky", "1,2,3"}), mapped = drawn({"--sky-map", sky, "--sky-rotation", "33"});
  ASSERT_EQ(constant.size(), 32u * 18u);
  ASSERT_EQ(mapped.size(), constant.size());
  float brightest = 0.0f;
  for (std::size_t i = 0; i < constant.size(); ++i) {
    EXPECT_NEAR(mapped[i].y, constant[i].y, 1e-4f * (1.0f + constant[i].y)) << i;
    brightest = std::max(brightest, constant[i].y);
  }
  EXPECT_GT(brightest, 0.0f);

  // So does one of two colours that are the same; of two that are not, neither of them.
  const auto both = drawn({"--sky", "1,2,3,1,2,3"}), above = drawn({"--sky", "1,2,3,0,0,0"}),
             below = drawn({"--sky", "0,0,0,1,2,3"});
  ASSERT_EQ(both.size(), constant.size());
  for (std::size_t i = 0; i < constant.size(); ++i) {
    EXPECT_NEAR(both[i].y, constant[i].y, 1e-4f * (1.0f + constant[i].y)) << i;
    // Light adds up, and so does what it is reflected to.
    EXPECT_NEAR(above[i].y + below[i].y, constant[i].y, 0.02f * (1.0f + constant[i].y)) << i;
  }
  EXPECT_NE(above, below);

  // Light from one side: the picture changes with the turn.
  std::vector<glm::vec3> oneSide(8, glm::vec3(0.0f));
  oneSide[0] = oneSide[4] = glm::vec3(8.0f);
  map.setLayer("", oneSide);
  ASSERT_TRUE(writeExr(sky, map));
  EXPECT_NE(drawn({"--sky-map", sky}), drawn({"--sky-map", sky, "--sky-rotation", "180"}));

  expectRefused(render({"--bake", bake_, "--sky-map", sky, "--sky", "1,1,1"}), 1, {"--sky", "--sky-map"});
  for (const char* command : {"render", "reference", "preview"})
    expectRefused(runProgram({command, kLevel, "--sky-rotation", "33", "-o", image()}, folder_), 1,
                  {"--sky-rotation needs --sky-map"});
  expectRefused(render({"--bake", bake_, "--sky-map", sky, "--sky-rotation", "nan"}), 1, {"--sky-rotation", "nan"});
  expectRefused(render({"--bake", bake_, "--sky-map", kLevel}), 3, {"two_rooms.glb", "neither"});
  expectRefused(render({"--bake", bake_, "--sky-map", sky, "--force", "-o", sky}), 1, {"--sky-map"});
}

TEST_F(RenderCommand, saysThatABakeSeesNoSky) {
  const std::string blind = (folder_ / "blind.relume").string();
  const ProgramResult baked = runProgram({"bake", kLevel, "-o", blind, "--preset", "draft", "--surfels", "2000",
                                          "--sky-patches", "0", "--progress", "none"},
                                         folder_);
  ASSERT_EQ(baked.status, 0) << baked.err;
  EXPECT_NE(render({"--bake", blind, "--sky", "1,1,1", "--force"}).err.find("--sky-patches"), std::string::npos);
  EXPECT_EQ(render({"--bake", blind, "--force"}).err.find("--sky-patches"), std::string::npos);
  EXPECT_EQ(render({"--bake", bake_, "--sky", "1,1,1", "--force"}).err.find("--sky-patches"), std::string::npos);
}

TEST_F(RenderCommand, knowsOnlyDirectLightWithoutABake) {
  expectRefused(render({"--aov", "indirect"}), 1, {"--bake"});
  expectRefused(render({"--aov", "direct", "--allow-stale"}), 1, {"--allow-stale needs --bake"});
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
  expectRefused(r, 3, {"living_wall_west", "changed", "--allow-stale"});

  // Its light is taken all the same when that is asked for, and said.
  const auto drawn = [&](const fs::path& scene, std::vector<std::string> more) {
    std::vector<std::string> arguments{"render", scene.string(), "--bake", bake_,       "--aov", "indirect",   "-o",
                                       image(),  "--size",       "32x18",  "--samples", "1",     "--progress", "none"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const ProgramResult made = runProgram(arguments, folder_);
    EXPECT_EQ(made.status, 0) << made.err;
    return std::pair(made, readExr(image())->layer(""));
  };
  const auto [stale, light] = drawn(changed, {"--allow-stale"});
  EXPECT_NE(stale.err.find("living_wall_west"), std::string::npos) << stale.err;
  const auto [good, before] = drawn(kLevel, {"--allow-stale"});
  EXPECT_EQ(good.err, "");
  // The same irradiance, but for the roundings of an albedo multiplied in and divided out.
  ASSERT_EQ(light.size(), before.size());
  for (std::size_t i = 0; i < light.size(); ++i) EXPECT_NEAR(light[i].r, before[i].r, 1e-4f * before[i].r + 1e-6f);
}

// With an instance less, the parts behind it are found by their names and not by their places.
TEST_F(RenderCommand, aStaleBakeIsReadByTheNamesOfItsParts) {
  std::string glb = readAll(kLevel);
  const std::string dynamic = R"("extras":{"relume":{"bake":"dynamic"}})";
  const std::string ignored = R"("extras":{"relume":{"bake":"ignore" }})";
  ASSERT_EQ(dynamic.size(), ignored.size());
  ASSERT_NE(glb.find(dynamic), std::string::npos) << "the level's JSON is written otherwise";
  glb.replace(glb.find(dynamic), dynamic.size(), ignored);
  const fs::path changed = folder_ / "fewer.glb";
  std::ofstream(changed, std::ios::binary) << glb;
  const ProgramResult r = runProgram({"render", changed.string(), "--bake", bake_, "--allow-stale", "-o", image(),
                                      "--size", "32x18", "--samples", "1", "--progress", "none"},
                                     folder_);
  EXPECT_EQ(r.status, 0) << r.err;
  EXPECT_NE(r.err.find("removed"), std::string::npos) << r.err;
}

TEST_F(RenderCommand, aBakeWithAGridAloneLightsAllFromIt) {
  const std::string grid = (folder_ / "grid.relume").string();
  const ProgramResult made = runProgram({"bake", kLevel, "-o", grid, "--preset", "draft", "--surfels", "2000",
                                         "--lightmap-caches", "0", "--progress", "none"},
                                        folder_);
  ASSERT_EQ(made.status, 0) << made.err;
  const ProgramResult r = render({"--bake", grid, "--aov", "indirect", "--camera", "cam_living"});
  ASSERT_EQ(r.status, 0) << r.err;
  for (const glm::vec3& light : readExr(image())->layer("")) EXPECT_TRUE(std::isfinite(light.r) && light.r >= 0.0f);
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
