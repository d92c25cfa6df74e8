// SPDX-License-Identifier: MIT
// How large the numbers of a level may be: each kind that is beyond its bound is refused by name, and each at the bound
// is taken.
#include "formats/limits.h"
#include "bake/scene/check_limits.h"
#include "tests/import/gltf_builder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace relume {
namespace {

using namespace relume::testing;

// A quad, a camera, an orthographic camera, a light, a play volume and a textured, glowing material.
GltfBuilder wholeLevel() {
  GltfBuilder b;
  const int texture = b.texture(png(1, 1, {1, 2, 3, 255}));
  const int glowing =
      b.material({{"name", "glow"},
                  {"emissiveFactor", {1, 1, 1}},
                  {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 1}}}}},
                  {"pbrMetallicRoughness",
                   {{"baseColorTexture",
                     {{"index", texture}, {"extensions", {{"KHR_texture_transform", {{"offset", {0, 0}}}}}}}}}}});
  b.quad({{"material", glowing}});
  b.root["cameras"] =
      json::array({{{"name", "eye"}, {"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}},
                   {{"name", "plan"},
                    {"type", "orthographic"},
                    {"orthographic", {{"xmag", 2}, {"ymag", 1}, {"znear", 0.1}, {"zfar", 9}}}}});
  b.root["extensions"]["KHR_lights_punctual"]["lights"] = json::array({{{"name", "lamp"}, {"type", "point"}}});
  b.node({{"camera", 0}});
  b.node({{"camera", 1}});
  b.node({{"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  b.node({{"name", "hall"}, {"extras", {{"relume", {{"volume", {1, 1, 1}}}}}}});
  return b;
}

json& nodeOf(GltfBuilder& b, std::size_t i) { return b.root["nodes"][i]; }
json& light(GltfBuilder& b) { return b.root["extensions"]["KHR_lights_punctual"]["lights"][0]; }
json& material(GltfBuilder& b) { return b.root["materials"][0]; }

void refused(void (*change)(GltfBuilder&), const std::string& words) {
  GltfBuilder b = wholeLevel();
  change(b);
  const Result<Scene> scene = b.import();
  ASSERT_FALSE(scene) << words;
  EXPECT_EQ(scene.error().code, ErrorCode::invalidFile);
  EXPECT_NE(scene.error().message.find(words), std::string::npos) << scene.error().message;
  EXPECT_NE(scene.error().message.find("test.glb"), std::string::npos) << scene.error().message;
}

void taken(void (*change)(GltfBuilder&)) {
  GltfBuilder b = wholeLevel();
  change(b);
  const Result<Scene> scene = b.import();
  EXPECT_TRUE(scene) << scene.error().message;
}

TEST(Limits, nodesBeyondThemAreNamed) {
  refused(
      [](GltfBuilder& b) {
        nodeOf(b, 0) = {{"name", "wall"}, {"mesh", 0}, {"translation", {0, 1e9, 0}}};
      },
      "nodes[0] 'wall': its transform to the world takes the origin to (0, 1e+09, 0)");
  refused([](GltfBuilder& b) { nodeOf(b, 0)["scale"] = {1, 1, 1e20}; }, "takes the z axis to (0, 0, 1e+20)");
  refused(
      [](GltfBuilder& b) {
        nodeOf(b, 0)["scale"] = {1e8, 1, 1};
        nodeOf(b, 0)["translation"] = {5, 0, 0};
        nodeOf(b, 0)["name"] = "wall";
        const float far = 2.0f;
        std::memcpy(&b.binary[b.root["bufferViews"][1]["byteOffset"].get<std::size_t>()], &far, 4);
      },
      "nodes[0] 'wall': vertex 0 of mesh 'mesh0' is at (2e+08, 0, 0)");
  refused(
      [](GltfBuilder& b) {
        const int places = b.floats({1, 2, 3, 0, 0, -3e8f}, "VEC3");
        nodeOf(b, 0)["extensions"] = {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", places}}}}}};
      },
      "nodes[0] 'unnamed node 0', instance 1: its transform to the world takes the origin to (0, 0, -3e+08)");
  taken([](GltfBuilder& b) { nodeOf(b, 0)["scale"] = {1e8, 1, 1e-8}; });
}

TEST(Limits, positionsBeyondThemAreNamedByMeshAndVertex) {
  for (const float far : {1e20f, 3e38f, -1e10f}) {
    GltfBuilder b = wholeLevel();
    std::memcpy(&b.binary[b.root["bufferViews"][1]["byteOffset"].get<std::size_t>() + 16], &far, 4);
    const Result<Scene> scene = b.import();
    ASSERT_FALSE(scene);
    EXPECT_NE(scene.error().message.find("mesh 'mesh0': vertex 1 is at ("), std::string::npos) << scene.error().message;
  }
}

TEST(Limits, camerasVolumesAndLightsBeyondThemAreNamed) {
  refused([](GltfBuilder& b) { nodeOf(b, 1)["translation"] = {0, 0, -3e8}; }, "camera 'eye': its transform");
  refused([](GltfBuilder& b) { b.root["cameras"][0]["perspective"]["znear"] = 1e38; }, "camera 'eye': its znear");
  refused([](GltfBuilder& b) { b.root["cameras"][0]["perspective"]["aspectRatio"] = 1e38; },
          "camera 'eye': it is 1e+38");
  refused([](GltfBuilder& b) { b.root["cameras"][1]["orthographic"]["ymag"] = 1e38; }, "camera 'plan': its ymag");
  refused([](GltfBuilder& b) { b.root["cameras"][1]["orthographic"]["xmag"] = 1e30; }, "camera 'plan'");
  refused([](GltfBuilder& b) { b.root["cameras"][1]["orthographic"]["znear"] = 1e10; }, "camera 'plan': its znear");
  refused(
      [](GltfBuilder& b) {
        nodeOf(b, 4)["extras"]["relume"]["volume"] = {1, 1e38, 1};
      },
      "play volume of node 'hall': a corner is at (-0.5, -5e+37, -0.5)");
  refused([](GltfBuilder& b) { nodeOf(b, 4)["scale"] = {1e300, 1, 1}; }, "play volume of node 'hall'");
  refused([](GltfBuilder& b) { nodeOf(b, 4)["translation"] = {1e20, 1, 1}; }, "play volume of node 'hall'");
  refused([](GltfBuilder& b) { nodeOf(b, 3)["translation"] = {0, 1e20, 0}; }, "light 'lamp' is at (0, 1e+20, 0)");
  refused([](GltfBuilder& b) { light(b)["intensity"] = 1e30; }, "light 'lamp': its intensity is (1e+30");
  taken([](GltfBuilder& b) {
    nodeOf(b, 1)["translation"] = {0, 0, -1e8};
    nodeOf(b, 4)["extras"]["relume"]["volume"] = {1e8, 1, 1};
    nodeOf(b, 3)["translation"] = {0, 1e8, 0};
    light(b)["intensity"] = 1e20;
    light(b)["range"] = 1e300;
    b.root["cameras"][1]["orthographic"] = {{"xmag", 1e8}, {"ymag", 1e8}, {"znear", 1e8}, {"zfar", 2e8}};
  });
}

TEST(Limits, lightOfMaterialsBeyondThemIsNamed) {
  refused(
      [](GltfBuilder& b) { material(b)["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 1e300; },
      "material 'glow': its emission, factor times strength, is (3.40282e+38");
  refused([](GltfBuilder& b) { material(b)["emissiveFactor"] = {0, 2e9, 0}; }, "material 'glow': its emission");
  refused(
      [](GltfBuilder& b) {
        json& texture = material(b)["pbrMetallicRoughness"]["baseColorTexture"];
        texture["extensions"]["KHR_texture_transform"]["offset"] = {1e300, 0};
      },
      "material 'glow': its texture transform");
  taken([](GltfBuilder& b) { material(b)["emissiveFactor"] = {0, 1e9, 0}; });
}

TEST(Limits, coloursOutsideTheirRangeAreClampedWithAWarning) {
  GltfBuilder b = wholeLevel();
  material(b)["pbrMetallicRoughness"]["baseColorFactor"] = {1e300, -4, 0.5, 7};
  material(b)["emissiveFactor"] = {-1, 0, 0};
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->materials[0].albedo, glm::vec3(1, 0, 0.5f));
  EXPECT_EQ(scene->materials[0].emission, glm::vec3(0.0f));
  ASSERT_EQ(b.messages.size(), 2u);
  EXPECT_NE(b.messages[0].find("materials[0] 'glow': base colour or alpha is outside 0 to 1"), std::string::npos);
  EXPECT_NE(b.messages[1].find("materials[0] 'glow': emissive factor or strength is negative"), std::string::npos);
}

// A level that a host builds itself goes through the same rule.
TEST(Limits, holdForLevelsThatWereNotImported) {
  Result<Scene> scene = wholeLevel().import();
  ASSERT_TRUE(scene);
  ASSERT_TRUE(checkLimits(*scene));
  scene->lights[0].positionWorld.y = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(checkLimits(*scene));
  scene = wholeLevel().import();
  scene->instances[0].toWorld[1][1] = std::numeric_limits<float>::infinity();
  EXPECT_FALSE(checkLimits(*scene));
  scene = wholeLevel().import();
  scene->materials[0].emission.z = std::nanf("");
  EXPECT_FALSE(checkLimits(*scene));
}

}  // namespace
}  // namespace relume
