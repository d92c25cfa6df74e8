// SPDX-License-Identifier: MIT
// Units and directions of punctual lights, and which cameras are play space.
#include "tests/import/gltf_builder.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <utility>

namespace relume {
namespace {

using namespace relume::testing;

// A level with one light of each kind.
GltfBuilder lightsLevel(const json& lights) {
  GltfBuilder b;
  b.quad();
  b.root["extensionsUsed"] = {"KHR_lights_punctual"};
  b.root["extensions"]["KHR_lights_punctual"]["lights"] = lights;
  for (std::size_t i = 0; i < lights.size(); ++i) b.node({{"extensions", {{"KHR_lights_punctual", {{"light", i}}}}}});
  return b;
}
json pointLight(double intensity) { return {{"type", "point"}, {"name", "lamp"}, {"intensity", intensity}}; }
json sunLight(double intensity) { return {{"type", "directional"}, {"name", "sun"}, {"intensity", intensity}}; }

bool anyMessage(const GltfBuilder& b, std::string_view part) {
  return std::any_of(b.messages.begin(), b.messages.end(),
                     [&](const std::string& text) { return text.find(part) != std::string::npos; });
}

bool warns(const GltfBuilder& b) { return anyMessage(b, "photometric"); }

Result<Scene> importAs(const GltfBuilder& b, LightUnit unit) {
  Context context;
  return importGltf(b.write(), context, {unit});
}

TEST(LightUnit, candelaAndLuxBecomeWattsWhenAskedFor) {
  const GltfBuilder b = lightsLevel(json::array({pointLight(6830), sunLight(1366)}));
  const Result<Scene> scene = importAs(b, LightUnit::photometric);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->lightUnit, LightUnit::photometric);
  EXPECT_FLOAT_EQ(scene->lights.at(0).intensity.x, 10.0f);
  EXPECT_FLOAT_EQ(scene->lights.at(1).intensity.x, 2.0f);
}

TEST(LightUnit, theFileMaySayItAndTheCommandLineHasTheLastWord) {
  for (const char* where : {"scene", "asset"}) {
    GltfBuilder b = lightsLevel(json::array({pointLight(6830)}));
    json& element = where == std::string("scene") ? b.root["scenes"][0] : b.root["asset"];
    element["extras"]["relume"]["lightUnit"] = "photometric";
    const Result<Scene> scene = b.import();
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_FLOAT_EQ(scene->lights.at(0).intensity.x, 10.0f) << where;
    EXPECT_FALSE(warns(b)) << where;
    const Result<Scene> meant = importAs(b, LightUnit::radiometric);
    ASSERT_TRUE(meant) << meant.error().message;
    EXPECT_FLOAT_EQ(meant->lights.at(0).intensity.x, 6830.0f) << where;

    element["extras"]["relume"]["lightUnit"] = "lumen";
    const Result<Scene> unknown = b.import();
    ASSERT_FALSE(unknown) << where;
    EXPECT_NE(unknown.error().message.find("lightUnit"), std::string::npos) << unknown.error().message;
  }
}

TEST(LightUnit, numbersThatLookPhotometricAreWarnedOfAndKept) {
  const struct {
    const char* generator;
    json light;
    bool warned;
  } kCases[] = {
      {"Khronos glTF Blender I/O v4.2.57", pointLight(54351.41), true},  // 1000 W, Blender's own default lamp
      {"Khronos glTF Blender I/O v4.2.57", sunLight(683), true},         // 1 W/m², its default sun
      {"Khronos glTF Blender I/O v4.2.57", pointLight(79.58), false},    // 1000 W exported without lumens
      {"Khronos glTF Blender I/O v4.2.57", sunLight(3), false},
      {"", pointLight(900), false},  // a strong lamp of somebody's own exporter
      {"", sunLight(1300), false},
      {"", sunLight(100000), true},  // daylight in lux
      {"", pointLight(50000), true},
  };
  for (const auto& c : kCases) {
    GltfBuilder b = lightsLevel(json::array({c.light}));
    b.root["asset"]["generator"] = c.generator;
    const Result<Scene> scene = b.import();
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(warns(b), c.warned) << c.generator << " " << c.light;
    EXPECT_EQ(scene->lightUnit, LightUnit::radiometric);
    EXPECT_FLOAT_EQ(scene->lights.at(0).intensity.x, c.light["intensity"].get<float>());
  }
}

// Quarter turns under scales whose squares a float cannot hold, and whose products a double just can.
TEST(LightDirection, isAUnitVectorUnderAnyScale) {
  for (const double scale : {1e-30, 1.0, 1e30}) {
    GltfBuilder b = lightsLevel(json::array({sunLight(1)}));
    const int light = static_cast<int>(b.root["nodes"].size()) - 1;
    b.root["nodes"][light]["matrix"] = {0, 0, -scale, 0, 0, scale, 0, 0, scale, 0, 0, 0, 0, 0, 0, 1};
    const Result<Scene> scene = b.import();
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_LT(glm::length(scene->lights.at(0).direction - glm::vec3(-1, 0, 0)), 1e-6f) << scale;
  }
}

TEST(LightDirection, thatIsFlattenedToNothingIsWarnedOf) {
  GltfBuilder b = lightsLevel(json::array({sunLight(1)}));
  const int light = static_cast<int>(b.root["nodes"].size()) - 1;
  b.root["nodes"][light]["matrix"] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1};
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_FLOAT_EQ(glm::length(scene->lights.at(0).direction), 1.0f);
  EXPECT_TRUE(std::any_of(b.messages.begin(), b.messages.end(), [](const std::string& text) {
    return text.find("points nowhere") != std::string::npos && text.find("sun") != std::string::npos;
  }));
}

// A turn of 90 degrees about Y, then a scale: as rotation and scale, and as the matrix that they make.
Result<Scene> turnedAndScaled(GltfBuilder& b, double x, double y, double z, bool asMatrix) {
  b = lightsLevel(json::array({sunLight(1)}));
  json& node = b.root["nodes"].back();
  if (asMatrix) {
    node["matrix"] = {0, 0, -x, 0, 0, y, 0, 0, z, 0, 0, 0, 0, 0, 0, 1};
  } else {
    node["rotation"] = {0, std::sqrt(0.5), 0, std::sqrt(0.5)};
    node["scale"] = {x, y, z};
  }
  return b.import();
}

TEST(LightDirection, isTheSameByAMatrixAsByRotationAndScale) {
  for (const auto& [x, y, z] : {std::array{1, 1, 1}, {2, 3, 4}, {-1, 1, 1}, {1, -1, 1}, {-2, -3, 1}, {1, 1, 0}}) {
    for (const bool asMatrix : {false, true}) {
      GltfBuilder b;
      const Result<Scene> scene = turnedAndScaled(b, x, y, z, asMatrix);
      ASSERT_TRUE(scene) << scene.error().message;
      EXPECT_LT(glm::length(scene->lights.at(0).direction - glm::vec3(-1, 0, 0)), 1e-6f)
          << x << ' ' << y << ' ' << z << (asMatrix ? " as a matrix" : "");
      EXPECT_FALSE(anyMessage(b, "points nowhere")) << x << ' ' << y << ' ' << z;
    }
  }
}

// The matrix does not tell Z mirrored from X mirrored and half a turn about Y.
TEST(LightDirection, ofAMatrixThatMirrorsIsThatOfItsZ) {
  GltfBuilder b;
  const Result<Scene> scene = turnedAndScaled(b, 1, 1, -1, true);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_LT(glm::length(scene->lights.at(0).direction - glm::vec3(1, 0, 0)), 1e-6f);
}

TEST(LightDirection, thatIsFlattenedIsBlamedOnWhatFlattensIt) {
  GltfBuilder b;
  ASSERT_TRUE(turnedAndScaled(b, 0, 1, 0, true));
  EXPECT_TRUE(anyMessage(b, "points nowhere, as its own matrix flattens its axis"));
  b = lightsLevel(json::array({sunLight(1)}));
  const std::size_t light = b.root["nodes"].size() - 1;
  b.root["scenes"][0]["nodes"].erase(b.root["scenes"][0]["nodes"].size() - 1);
  b.node({{"children", {light}}, {"scale", {1, 1, 0}}});
  ASSERT_TRUE(b.import());
  EXPECT_TRUE(anyMessage(b, "points nowhere, as the nodes above flatten its axis"));
}

// A camera that only looks, one below a node that says so, and one that is play space.
TEST(PlaySpaceCameras, areThoseThatDoNotOptOutAndNoneBesideVolumes) {
  GltfBuilder b;
  b.quad();
  b.root["cameras"] = json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 0.05}}}}});
  const json only = {{"relume", {{"playSpace", false}}}};
  b.node({{"camera", 0}, {"extras", only}});
  const int child = b.node({{"camera", 0}});
  b.root["scenes"][0]["nodes"].erase(b.root["scenes"][0]["nodes"].size() - 1);
  b.node({{"children", {child}}, {"extras", only}});
  b.node({{"camera", 0}});
  Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->cameras.size(), 3u);
  EXPECT_EQ(scene->playSpaceCameras(), std::vector<std::uint32_t>{2});

  b.node({{"extras", {{"relume", {{"volume", {1, 1, 1}}}}}}});
  scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->cameras.size(), 3u);
  EXPECT_TRUE(scene->playSpaceCameras().empty());

  json& extras = b.root["nodes"][1]["extras"];
  for (const json& wrong : {json("no"), json(2), json(0.5)}) {
    extras = {{"relume", {{"playSpace", wrong}}}};
    EXPECT_FALSE(b.import()) << wrong;
  }
}

// Blender 3.4 has no booleans in custom properties: it writes 0 and 1.
TEST(PlaySpaceCameras, optOutByZeroAsBlenderWritesIt) {
  GltfBuilder b;
  b.quad();
  b.root["cameras"] = json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 0.05}}}}});
  for (const int value : {0, 1}) b.node({{"camera", 0}, {"extras", {{"relume", {{"playSpace", value}}}}}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->playSpaceCameras(), std::vector<std::uint32_t>{1});
}

}  // namespace
}  // namespace relume
