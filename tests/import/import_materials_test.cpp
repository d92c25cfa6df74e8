// SPDX-License-Identifier: MIT
// Materials: factors, textures and their samplers, transforms and coordinate sets, emission, alpha, older workflows.
#include "formats/color.h"
#include "tests/import/expect_near.h"
#include "tests/import/gltf_builder.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>

namespace relume {
namespace {

using namespace relume::testing;

using Bytes = std::vector<std::uint8_t>;

// Two texels side by side: red, green.
Bytes redGreen() { return png(2, 1, {255, 0, 0, 255, 0, 255, 0, 255}); }

json textured(int texture, const json& info = json::object()) {
  json t = {{"index", texture}};
  t.merge_patch(info);
  return {{"pbrMetallicRoughness", {{"baseColorTexture", t}}}};
}

// The point of the unit quad at (x, y).
SurfacePoint quadPoint(float x, float y) {
  return x >= y ? SurfacePoint{0, 0, {x - y, y}} : SurfacePoint{0, 1, {x, y - x}};
}

Scene importOrFail(const GltfBuilder& b) {
  Result<Scene> scene = b.import();
  EXPECT_TRUE(scene) << (scene ? "" : scene.error().message);
  return scene ? std::move(*scene) : Scene{};
}

TEST(ImportMaterials, albedoIsFactorTimesDecodedTexture) {
  // The closed forms the reference images were checked against: 128 x 0.5 -> 0.1079, 188 -> 0.5029, 64 -> 0.0513.
  GltfBuilder b;
  const int texture = b.texture(png(1, 1, {128, 188, 64, 255}));
  json m = textured(texture);
  m["pbrMetallicRoughness"]["baseColorFactor"] = {0.5, 1, 1, 1};
  b.quad({{"material", b.material(m)}});
  const Scene scene = importOrFail(b);
  expectNear(albedoAt(scene, quadPoint(0.5f, 0.5f)), {0.1079f, 0.5029f, 0.0513f}, 1e-4f);
}

TEST(ImportMaterials, vertexColourMultipliesAlbedoAndTheProductStaysBelowOne) {
  GltfBuilder b;
  const int color = b.floats({0.5, 0.25, 2, 0.5, 0.25, 2, 0.5, 0.25, 2, 0.5, 0.25, 2}, "VEC3");
  b.quad({{"attributes", {{"COLOR_0", color}}},
          {"material", b.material({{"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 5, 1}}}}})}});
  const Scene scene = importOrFail(b);
  expectNear(albedoAt(scene, quadPoint(0.5f, 0.2f)), {0.5f, 0.25f, 1.0f}, 1e-4f);
}

TEST(ImportMaterials, withoutAMaterialEverythingIsWhiteAndOpaque) {
  GltfBuilder b;
  b.quad();
  const Scene scene = importOrFail(b);
  EXPECT_EQ(albedoAt(scene, quadPoint(0.5f, 0.2f)), glm::vec3(1.0f));
  EXPECT_EQ(emissionAt(scene, quadPoint(0.5f, 0.2f)), glm::vec3(0.0f));
  EXPECT_TRUE(opaqueAt(scene, quadPoint(0.5f, 0.2f)));
}

TEST(ImportMaterials, bilinearFilteringMixesInLinearLight) {
  GltfBuilder b;
  b.quad({{"material", b.material(textured(b.texture(redGreen(), {{"wrapS", 33071}, {"wrapT", 33071}})))}});
  const Scene scene = importOrFail(b);
  expectNear(albedoAt(scene, quadPoint(0.25f, 0.5f)), {1, 0, 0}, 1e-4f);
  expectNear(albedoAt(scene, quadPoint(0.5f, 0.5f)), {0.5f, 0.5f, 0}, 1e-4f);
  expectNear(albedoAt(scene, quadPoint(0.0f, 0.5f)), {1, 0, 0}, 1e-4f);  // clamped
}

TEST(ImportMaterials, nearestFilteringDoesNotMix) {
  GltfBuilder b;
  b.quad({{"material", b.material(textured(b.texture(redGreen(), {{"magFilter", 9728}})))}});
  const Scene scene = importOrFail(b);
  expectNear(albedoAt(scene, quadPoint(0.49f, 0.4f)), {1, 0, 0}, 1e-4f);
  expectNear(albedoAt(scene, quadPoint(0.51f, 0.4f)), {0, 1, 0}, 1e-4f);
  expectNear(albedoAt(scene, quadPoint(0.99f, 0.4f)), {0, 1, 0}, 1e-4f);
  expectNear(albedoAt(scene, quadPoint(0.01f, 0.4f)), {1, 0, 0}, 1e-4f);
}

TEST(ImportMaterials, wrapModesRepeatMirrorAndClamp) {
  const struct {
    int wrap;
    glm::vec3 at[4];  // u = -0.25, 0.25, 1.25, 1.75
  } cases[] = {{10497, {{0, 1, 0}, {1, 0, 0}, {1, 0, 0}, {0, 1, 0}}},
               {33648, {{1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}}},
               {33071, {{1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, 0}}}};
  for (const auto& c : cases) {
    GltfBuilder b;
    const int texture = b.texture(redGreen(), {{"magFilter", 9728}, {"wrapS", c.wrap}});
    // u runs from -1 to 3 over the quad.
    b.quad({{"material",
             b.material(textured(
                 texture, {{"extensions", {{"KHR_texture_transform", {{"offset", {-1, 0}}, {"scale", {4, 1}}}}}}}))}});
    const Scene scene = importOrFail(b);
    const float us[4] = {-0.25f, 0.25f, 1.25f, 1.75f};
    for (int i = 0; i < 4; ++i) expectNear(albedoAt(scene, quadPoint((us[i] + 1.0f) / 4.0f, 0.1f)), c.at[i], 1e-4f);
  }
}

TEST(ImportMaterials, textureTransformScalesThenTurnsThenOffsets) {
  GltfBuilder b;
  const double turn = std::acos(-1.0) / 2.0;
  const int texture = b.texture(redGreen());
  b.quad({{"material",
           b.material(textured(texture, {{"extensions",
                                          {{"KHR_texture_transform",
                                            {{"offset", {0.1, 0.2}}, {"rotation", turn}, {"scale", {2, 3}}}}}}}))}});
  const Scene scene = importOrFail(b);
  const auto& t = scene.materials[0].albedoTexture.transform;
  // A quarter turn counter-clockwise, as seen with v downward: (u, v) to (v, -u).
  const auto map = [&](float u, float v) { return glm::vec2(t[0] * u + t[1] * v + t[2], t[3] * u + t[4] * v + t[5]); };
  EXPECT_LT(glm::length(map(1, 0) - glm::vec2(0.1f, -1.8f)), 1e-5f);
  EXPECT_LT(glm::length(map(0, 1) - glm::vec2(3.1f, 0.2f)), 1e-5f);
}

TEST(ImportMaterials, texturesReadTheSetTheyName) {
  GltfBuilder b;
  const int texture = b.texture(redGreen(), {{"magFilter", 9728}});
  const int second = b.floats({0.75, 0, 0.75, 0, 0.75, 0, 0.75, 0}, "VEC2");
  const int third = b.floats({0.25, 0, 0.25, 0, 0.25, 0, 0.25, 0}, "VEC2");
  const json attributes = {{"TEXCOORD_1", second}, {"TEXCOORD_2", third}};
  b.quad({{"attributes", attributes}, {"material", b.material(textured(texture, {{"texCoord", 1}}))}});
  b.quad({{"attributes", attributes}, {"material", b.material(textured(texture, {{"texCoord", 2}}))}});
  b.quad(
      {{"attributes", attributes},
       {"material", b.material(textured(
                        texture, {{"texCoord", 0}, {"extensions", {{"KHR_texture_transform", {{"texCoord", 1}}}}}}))}});
  const Scene scene = importOrFail(b);
  expectNear(albedoAt(scene, {0, 0, {0.2f, 0.1f}}), {0, 1, 0}, 1e-4f);
  expectNear(albedoAt(scene, {1, 0, {0.2f, 0.1f}}), {1, 0, 0}, 1e-4f);  // TEXCOORD_2 takes the place of TEXCOORD_0
  expectNear(albedoAt(scene, {2, 0, {0.2f, 0.1f}}), {0, 1, 0}, 1e-4f);  // the extension overrides the set
}

TEST(ImportMaterials, anyTwoSetsFitWhateverTheirNumbers) {
  for (const auto& [base, glow] : {std::pair{0, 1}, {1, 0}, {0, 2}, {2, 0}, {1, 2}, {2, 1}, {2, 3}, {3, 2}}) {
    GltfBuilder b;
    const int texture = b.texture(redGreen(), {{"magFilter", 9728}});
    json attributes;
    for (int set = 0; set < 4; ++set) {
      const float u = set == base ? 0.25f : 0.75f;
      attributes["TEXCOORD_" + std::to_string(set)] = b.floats({u, 0, u, 0, u, 0, u, 0}, "VEC2");
    }
    json m = textured(texture, {{"texCoord", base}});
    m.merge_patch({{"emissiveFactor", {1, 1, 1}}, {"emissiveTexture", {{"index", texture}, {"texCoord", glow}}}});
    b.quad({{"attributes", attributes}, {"material", b.material(m)}});
    const Scene scene = importOrFail(b);
    EXPECT_TRUE(b.messages.empty()) << b.messages.front();
    EXPECT_EQ(albedoAt(scene, quadPoint(0.5f, 0.2f)), glm::vec3(1, 0, 0)) << base << " and " << glow;
    EXPECT_EQ(emissionAt(scene, quadPoint(0.5f, 0.2f)), glm::vec3(0, 1, 0)) << base << " and " << glow;
  }
}

// Images that a game puts on a material without an emissive texture lie by TEXCOORD_0.
TEST(ImportMaterials, whatMayBeDrivenKeepsItsFirstSet) {
  for (const json& driven :
       {json{{"emissiveFactor", {1, 1, 1}}}, json{{"extras", {{"relume", {{"drivable", true}}}}}}}) {
    GltfBuilder b;
    json m = textured(b.texture(redGreen()), {{"texCoord", 2}});
    m.merge_patch(driven);
    const json third = {{"TEXCOORD_2", b.floats({0.25, 0, 0.25, 0, 0.25, 0, 0.25, 0}, "VEC2")}};
    b.quad({{"attributes", third}, {"material", b.material(m)}});
    const Scene scene = importOrFail(b);
    ASSERT_EQ(scene.materials.size(), 1u);
    EXPECT_EQ(scene.meshes[0].uv[scene.materials[0].emissionTexture.texcoord][1], glm::vec2(1, 1));
    EXPECT_EQ(scene.meshes[0].uv[scene.materials[0].albedoTexture.texcoord][1], glm::vec2(0.25f, 0));
  }
}

TEST(ImportMaterials, emissionIsFactorTimesStrengthTimesTexture) {
  GltfBuilder b;
  const int texture = b.texture(png(1, 1, {188, 255, 0, 255}));
  b.quad(
      {{"material", b.material({{"emissiveFactor", {1, 0.5, 1}},
                                {"emissiveTexture", {{"index", texture}}},
                                {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 10}}}}}})}});
  const Scene scene = importOrFail(b);
  expectNear(emissionAt(scene, quadPoint(0.5f, 0.5f)), {5.029f, 5.0f, 0.0f}, 2e-3f);
  expectNear(scene.materials[0].emission, {10, 5, 10}, 1e-4f);
}

TEST(ImportMaterials, specularGlossinessGivesItsDiffuseColour) {
  GltfBuilder b;
  const int texture = b.texture(png(1, 1, {188, 188, 188, 255}));
  json m = {{"pbrMetallicRoughness", {{"baseColorFactor", {0, 0, 0, 1}}}}};
  m["extensions"]["KHR_materials_pbrSpecularGlossiness"] = {{"diffuseFactor", {0.5, 1, 0.25, 1}},
                                                            {"diffuseTexture", {{"index", texture}}}};
  b.quad({{"material", b.material(m)}});
  const Scene scene = importOrFail(b);
  const float v = srgbToLinear(188.0f / 255.0f);
  expectNear(albedoAt(scene, quadPoint(0.5f, 0.5f)), {0.5f * v, v, 0.25f * v}, 1e-4f);
}

TEST(ImportMaterials, unlitIsItsBaseColour) {
  GltfBuilder b;
  json m = {{"pbrMetallicRoughness", {{"baseColorFactor", {0.2, 0.4, 0.6, 1}}}}};
  m["extensions"]["KHR_materials_unlit"] = json::object();
  b.quad({{"material", b.material(m)}});
  const Scene scene = importOrFail(b);
  expectNear(albedoAt(scene, quadPoint(0.5f, 0.5f)), {0.2f, 0.4f, 0.6f}, 1e-4f);
  EXPECT_EQ(emissionAt(scene, quadPoint(0.5f, 0.5f)), glm::vec3(0.0f));
  ASSERT_EQ(b.messages.size(), 1u);
  EXPECT_NE(b.messages[0].find("read as lit surfaces of their base colour that emit nothing: 1, the first "
                               "\"material0\";"),
            std::string::npos)
      << b.messages[0];
  b.root["nodes"][0]["extras"]["relume"]["bake"] = "dynamic";
  importOrFail(b);
  EXPECT_TRUE(b.messages.empty());
}

TEST(ImportMaterials, masksCutAtTheirCutoffBlendAtAHalfOpaqueNever) {
  const Bytes image = png(2, 1, {255, 255, 255, 100, 255, 255, 255, 140});
  const struct {
    json extra;
    bool left, right;
  } cases[] = {{{{"alphaMode", "OPAQUE"}}, true, true},
               {{{"alphaMode", "MASK"}}, false, true},
               {{{"alphaMode", "MASK"}, {"alphaCutoff", 0.3}}, true, true},
               {{{"alphaMode", "MASK"}, {"alphaCutoff", 0.9}}, false, false},
               {{{"alphaMode", "BLEND"}, {"alphaCutoff", 0.9}}, false, true}};
  for (const auto& c : cases) {
    GltfBuilder b;
    json m = textured(b.texture(image, {{"magFilter", 9728}}));
    m.merge_patch(c.extra);
    b.quad({{"material", b.material(m)}});
    const Scene scene = importOrFail(b);
    EXPECT_EQ(opaqueAt(scene, quadPoint(0.2f, 0.1f)), c.left) << c.extra;
    EXPECT_EQ(opaqueAt(scene, quadPoint(0.8f, 0.1f)), c.right) << c.extra;
  }
}

// One that is a mask's and another material's becomes two images.
TEST(ImportMaterials, imagesUsedInTwoWaysAskTheMemoryBudgetForBoth) {
  const Bytes image = png(8, 8, Bytes(4 * 64, 200));
  for (const bool both : {false, true}) {
    GltfBuilder b;
    const int texture = b.texture(image);
    json m = textured(texture);
    b.quad({{"material", b.material(m)}});
    m["alphaMode"] = both ? "MASK" : "OPAQUE";
    b.quad({{"material", b.material(m)}});
    const std::filesystem::path path = b.write();
    Context context;
    context.maxMemory = 1;
    const Result<Scene> scene = importGltf(path, context);
    ASSERT_FALSE(scene);
    EXPECT_NE(scene.error().message.find(both ? "for 128 texels" : "for 64 texels"), std::string::npos)
        << scene.error().message;
  }
}

TEST(ImportMaterials, alphaFactorAndVertexAlphaCountInTheTest) {
  GltfBuilder b;
  const int color = b.floats({1, 1, 1, 0.5, 1, 1, 1, 0.5, 1, 1, 1, 0.5, 1, 1, 1, 0.5}, "VEC4");
  json m = {{"alphaMode", "MASK"}, {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, 0.8}}}}};
  const int material = b.material(m);
  b.quad({{"material", material}});
  b.quad({{"material", material}, {"attributes", {{"COLOR_0", color}}}});
  const Scene scene = importOrFail(b);
  EXPECT_TRUE(opaqueAt(scene, {0, 0, {0.2f, 0.1f}}));
  EXPECT_FALSE(opaqueAt(scene, {1, 0, {0.2f, 0.1f}}));
}

TEST(ImportMaterials, doubleSidedIsKept) {
  GltfBuilder b;
  b.quad({{"material", b.material({{"doubleSided", true}})}});
  EXPECT_TRUE(importOrFail(b).materials[0].doubleSided);
}

TEST(ImportMaterials, texturesOfASetThatTheMeshLacksAreToldOf) {
  GltfBuilder b;
  const int texture = b.texture(redGreen());
  json m = textured(texture, {{"texCoord", 1}});
  m["alphaMode"] = "MASK";
  b.quad({{"material", b.material(m)}});
  m = textured(texture);
  m.merge_patch({{"emissiveFactor", {1, 1, 1}}, {"emissiveTexture", {{"index", texture}, {"texCoord", 5}}}});
  b.quad({{"material", b.material(m)}});
  b.node({{"mesh", 1}});
  const Scene scene = importOrFail(b);
  const auto warning = [](const char* mesh, const char* set, const char* what) {
    return "test.glb: " + std::string(mesh) + ".primitives[0]: has no " + set + ", by which its " + what +
           " texture lies, so that all of it looks as the texture does at (0, 0); unwrap the mesh, or take the texture "
           "off the material";
  };
  EXPECT_EQ(b.messages, (std::vector<std::string>{warning("meshes[0]", "TEXCOORD_1", "base colour"),
                                                  warning("meshes[1]", "TEXCOORD_5", "emissive")}));
}

TEST(ImportMaterials, imagesNobodyUsesAreNotRead) {
  GltfBuilder b;
  b.quad();
  b.root["images"] = json::array({{{"uri", "missing.png"}}});
  b.root["textures"] = json::array({{{"source", 0}}});
  b.material({{"normalTexture", {{"index", 0}}}});
  const Scene scene = importOrFail(b);
  EXPECT_TRUE(scene.images.empty());
}

TEST(ImportMaterials, imagesComeFromFilesDataUrisAndBufferViews) {
  const Bytes file = png(1, 1, {10, 20, 30, 255});
  writeFile("textures/a b.png", file);
  const std::vector<std::string> uris = {"textures/a%20b.png", "textures/a b.png",
                                         "data:image/png;base64," + base64(file)};
  for (const std::string& uri : uris) {
    GltfBuilder b;
    b.root["images"] = json::array({{{"uri", uri}}});
    b.root["textures"] = json::array({{{"source", 0}}});
    b.quad({{"material", b.material(textured(0))}});
    const Scene scene = importOrFail(b);
    ASSERT_EQ(scene.images.size(), 1u) << uri;
    EXPECT_EQ(scene.images[0].levels[0].rgba, (Bytes{10, 20, 30, 255}));
    EXPECT_EQ(scene.files.size(), uri.starts_with("data:") ? 1u : 2u);
  }
}

TEST(ImportMaterials, drivableIsReadFromExtras) {
  const auto material = [](const json& drivable) {
    GltfBuilder b;
    b.quad({{"material", b.material({{"extras", {{"relume", {{"drivable", drivable}}}}}})}});
    return b.import();
  };
  for (const json& yes : {json(true), json(1)}) EXPECT_TRUE(material(yes)->materials[0].drivable);
  for (const json& no : {json(false), json(0)}) EXPECT_FALSE(material(no)->materials[0].drivable);
  for (const json& wrong : {json("yes"), json(2), json::array({true}), json::object({{"on", true}})}) {
    const Result<Scene> scene = material(wrong);
    ASSERT_FALSE(scene) << wrong.dump();
    EXPECT_EQ(scene.error().code, ErrorCode::invalidFile);
    EXPECT_NE(scene.error().message.find("extras.relume.drivable: expected true or false"), std::string::npos)
        << scene.error().message;
  }
  // A dark one keeps the place of its emissive texture, and is dark.
  GltfBuilder b;
  const int texture = b.texture(redGreen());
  b.quad({{"material",
           b.material({{"emissiveTexture", {{"index", texture}}}, {"extras", {{"relume", {{"drivable", true}}}}}})}});
  const Scene scene = importOrFail(b);
  EXPECT_NE(scene.materials[0].emissionTexture.image, kNone);
  EXPECT_EQ(emissionAt(scene, quadPoint(0.5f, 0.2f)), glm::vec3(0.0f));
}

// glTF's white, where most of what is baked has no material of its own.
TEST(ImportMaterials, aLevelWithoutMaterialsIsToldOf) {
  const auto told = [](int bare, int painted, const char* bake = nullptr) {
    GltfBuilder b;
    const int material = b.material({{"name", "paint"}});
    for (int i = 0; i < bare; ++i) {
      const int node = b.quad();
      if (bake != nullptr) b.root["nodes"][node]["extras"]["relume"]["bake"] = bake;
    }
    for (int i = 0; i < painted; ++i) b.quad({{"material", material}});
    importOrFail(b);
    return b.isToldBare;
  };
  EXPECT_TRUE(told(3, 0));
  EXPECT_TRUE(told(3, 2));
  EXPECT_FALSE(told(2, 2));
  EXPECT_FALSE(told(0, 1));
  EXPECT_FALSE(told(3, 1, "dynamic"));
}

// A pane of glass is a wall to the baker, or nothing. Which of them darken the level is said once for each material,
// with a node.
TEST(ImportMaterials, glassThatBlocksLightIsToldOf) {
  const auto told = [](const json& more, const json& bake = nullptr) {
    GltfBuilder b;
    json glass = {{"name", "pane"}, {"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 0.9}}}}}};
    glass.merge_patch(more);
    const int material = b.material(glass);
    for (int i = 0; i < 2; ++i) {
      const int node = b.quad({{"material", material}});
      if (!bake.is_null()) b.root["nodes"][node]["extras"]["relume"]["bake"] = bake;
    }
    importOrFail(b);
    std::size_t count = 0;
    for (const std::string& message : b.messages)
      count += message.find("material \"pane\" on node \"") != std::string::npos &&
               message.find("transmits light") != std::string::npos;
    return count;
  };
  EXPECT_EQ(told(json::object()), 1u);
  EXPECT_EQ(told(json::object(), "gridLit"), 1u);
  const auto blend = [](double alpha) {
    return json{{"alphaMode", "BLEND"}, {"pbrMetallicRoughness", {{"baseColorFactor", {1, 1, 1, alpha}}}}};
  };
  EXPECT_EQ(told(blend(0.6)), 1u);
  // What is no part of the bake, or not there for it, darkens nothing.
  EXPECT_EQ(told(blend(0.2)), 0u);
  EXPECT_EQ(told(json::object(), "ignore"), 0u);
  EXPECT_EQ(told(json::object(), "dynamic"), 0u);
  EXPECT_EQ(told({{"extensions", {{"KHR_materials_transmission", {{"transmissionFactor", 0}}}}}}), 0u);
}

// Two primitives of one node are one pane, and what is left out of the bake is none.
TEST(ImportMaterials, glassNamesItsFirstNodeAndCountsTheOthers) {
  GltfBuilder b;
  const json transmission = {{"KHR_materials_transmission", {{"transmissionFactor", 0.9}}}};
  const int pane = b.material({{"name", "pane"}, {"extensions", transmission}});
  const int bottle = b.material({{"name", "bottle"}, {"extensions", transmission}});
  for (const char* name : {"left", "door", "right", "away"}) {
    const int node = b.quad({{"material", pane}});
    b.root["nodes"][node]["name"] = name;
    json& primitives = b.root["meshes"].back()["primitives"];
    primitives.push_back(json(primitives[0]));
    if (name == std::string_view("away")) b.root["nodes"][node]["extras"]["relume"]["bake"] = "ignore";
  }
  b.root["nodes"][b.quad({{"material", bottle}})]["name"] = "table";
  importOrFail(b);
  std::vector<std::string> told;
  for (const std::string& message : b.messages) {
    const std::size_t end = message.find(" transmits light");
    if (end != std::string::npos) told.push_back(message.substr(0, end));
  }
  const std::vector<std::string> expected = {"test.glb: material \"pane\" on node \"left\" and 2 more",
                                             "test.glb: material \"bottle\" on node \"table\""};
  EXPECT_EQ(told, expected);
}

TEST(ImportMaterials, lampshadesThatBlockLightAreToldOf) {
  for (const double factor : {0.0, 0.3}) {
    GltfBuilder b;
    json shade = {{"name", "shade"}};
    shade["extensions"]["KHR_materials_diffuse_transmission"]["diffuseTransmissionFactor"] = factor;
    b.root["extensionsRequired"] = {"KHR_materials_diffuse_transmission"};
    b.quad({{"material", b.material(shade)}});
    importOrFail(b);
    ASSERT_EQ(b.messages.size(), factor > 0.0 ? 1u : 0u);
    if (factor > 0.0) {
      EXPECT_NE(b.messages[0].find("material \"shade\" on node \"unnamed node 0\" transmits light, which bakes do not "
                                   "know: it blocks all of it; mark what has to let light through"),
                std::string::npos)
          << b.messages[0];
    }
  }
}

}  // namespace
}  // namespace relume
