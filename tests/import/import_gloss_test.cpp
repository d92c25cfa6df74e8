// SPDX-License-Identifier: MIT
// What pictures of glossy surfaces need of a level: metalness, roughness, normal maps and their tangents. Whatever is
// wrong with it, the level is read, and a bake is the same with and without it.
#include "bake/import/make_tangents.h"
#include "relume/bake/provenance.h"
#include "tests/import/expect_near.h"
#include "tests/import/gltf_builder.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include <cmath>
#include <limits>

namespace relume {
namespace {

using namespace relume::testing;

using Bytes = std::vector<std::uint8_t>;

Bytes oneTexel(int r, int g, int b) {
  return png(1, 1, {static_cast<std::uint8_t>(r), static_cast<std::uint8_t>(g), static_cast<std::uint8_t>(b), 255});
}

// The middle of the unit quad.
const SurfacePoint kMiddle{0, 0, {0.0f, 0.5f}};

Result<Scene> importGlossy(const GltfBuilder& b, bool gloss = true) {
  b.messages.clear();
  Context context;
  context.onMessage = [&b](Severity, std::string_view text) { b.messages.emplace_back(text); };
  ImportOptions options;
  options.gloss = gloss;
  return importGltf(b.write(), context, options);
}

Scene glossyOrFail(const GltfBuilder& b, bool gloss = true) {
  auto scene = importGlossy(b, gloss);
  EXPECT_TRUE(scene) << (scene ? "" : scene.error().message);
  return scene ? std::move(*scene) : Scene{};
}

bool warned(const GltfBuilder& b, const std::string& words) {
  for (const std::string& message : b.messages) {
    if (message.find(words) != std::string::npos) return true;
  }
  return false;
}

json withNormalMap(int texture, float scale = 1.0f) {
  return {{"normalTexture", {{"index", texture}, {"scale", scale}}}};
}

TEST(ImportGloss, factorsAreReadAndThoseOutOfRangeClampedWithAWarning) {
  const auto glossOf = [](const json& factors, bool isWarned) {
    GltfBuilder b;
    b.quad({{"material", b.material({{"name", "paint"}, {"pbrMetallicRoughness", factors}})}});
    const Scene scene = glossyOrFail(b);
    EXPECT_EQ(warned(b, "materials[0] 'paint'"), isWarned) << factors.dump();
    return glossAt(scene, kMiddle);
  };
  EXPECT_EQ(glossOf(json::object(), false).metalness, 1.0f);
  EXPECT_EQ(glossOf(json::object(), false).roughness, 1.0f);
  EXPECT_EQ(glossOf({{"metallicFactor", 0.25}, {"roughnessFactor", 0.5}}, false).metalness, 0.25f);
  EXPECT_EQ(glossOf({{"metallicFactor", 0.25}, {"roughnessFactor", 0.5}}, false).roughness, 0.5f);
  EXPECT_EQ(glossOf({{"roughnessFactor", 2}}, true).roughness, 1.0f);
  EXPECT_EQ(glossOf({{"roughnessFactor", -0.5}}, true).roughness, 0.0f);
  EXPECT_EQ(glossOf({{"metallicFactor", 1.0001}}, false).metalness, 1.0f);
  EXPECT_EQ(glossOf({{"metallicFactor", 1e30}}, true).metalness, 1.0f);
}

TEST(ImportGloss, theOlderWorkflowHasNoMetals) {
  GltfBuilder b;
  b.quad({{"material",
           b.material({{"extensions", {{"KHR_materials_pbrSpecularGlossiness", {{"glossinessFactor", 0.75}}}}}})}});
  const Scene scene = glossyOrFail(b);
  EXPECT_EQ(glossAt(scene, kMiddle).metalness, 0.0f);
  EXPECT_EQ(glossAt(scene, kMiddle).roughness, 0.25f);
}

TEST(ImportGloss, aTextureHasRoughnessInGreenAndMetalnessInBlueAsNumbers) {
  GltfBuilder b;
  const int texture = b.texture(oneTexel(7, 128, 51));
  b.quad({{"material", b.material({{"pbrMetallicRoughness",
                                    {{"metallicRoughnessTexture", {{"index", texture}}},
                                     {"baseColorTexture", {{"index", texture}}},
                                     {"metallicFactor", 0.5}}}})}});
  const Scene scene = glossyOrFail(b);
  EXPECT_NEAR(glossAt(scene, kMiddle).roughness, 128.0f / 255.0f, 1e-6f);
  EXPECT_NEAR(glossAt(scene, kMiddle).metalness, 0.5f * 51.0f / 255.0f, 1e-6f);
  // The same image as a colour stays one.
  EXPECT_EQ(scene.images.size(), 2u);
  EXPECT_EQ(albedoAt(scene, kMiddle), albedoAt(glossyOrFail(b, false), kMiddle));
}

TEST(ImportGloss, mipLevelsOfNumbersAreTheirMean) {
  GltfBuilder b;
  const int texture = b.texture(png(2, 1, {0, 10, 0, 255, 0, 210, 0, 255}));
  b.quad({{"material", b.material({{"pbrMetallicRoughness", {{"metallicRoughnessTexture", {{"index", texture}}}}}})}});
  const Scene scene = glossyOrFail(b);
  ASSERT_EQ(scene.images.size(), 1u);
  ASSERT_EQ(scene.images[0].levels.size(), 2u);
  EXPECT_EQ(scene.images[0].levels[1].rgba[1], 110);
}

TEST(ImportGloss, nothingOfItIsReadUnlessItIsAskedFor) {
  GltfBuilder b;
  b.root["images"] = {{{"uri", "missing.png"}}};
  b.root["textures"] = {{{"source", 0}}};
  json m = withNormalMap(0);
  m["pbrMetallicRoughness"] = {{"roughnessFactor", 7}};
  b.quad({{"material", b.material(m)}});
  const Scene scene = glossyOrFail(b, false);
  EXPECT_TRUE(b.messages.empty());
  EXPECT_TRUE(scene.images.empty());
  EXPECT_TRUE(scene.meshes.at(0).cornerTangent.empty());
}

TEST(ImportGloss, whatCannotBeReadIsLeftOutWithAWarning) {
  const auto importWith = [](const std::function<void(GltfBuilder&)>& spoil, const std::string& words) {
    GltfBuilder b;
    const int texture = b.texture(oneTexel(255, 128, 128));
    b.quad({{"material", b.material(withNormalMap(texture))}});
    spoil(b);
    const Scene scene = glossyOrFail(b);
    EXPECT_TRUE(warned(b, words)) << words << " in: " << (b.messages.empty() ? "" : b.messages[0]);
    ASSERT_FALSE(scene.instances.empty());
    expectNear(mappedNormal(scene, kMiddle), {0, 0, 1}, 0.01f);
  };
  importWith([](GltfBuilder& b) { b.root["images"][0] = {{"uri", "missing.png"}}; }, "missing.png");
  importWith(
      [](GltfBuilder& b) {
        b.binary[20] ^= 0xFF;
        b.binary[1] ^= 0xFF;
      },
      "images[0]");
  importWith([](GltfBuilder& b) { b.root["materials"][0]["normalTexture"]["index"] = 9; },
             "textures[9] does not exist");
  importWith([](GltfBuilder& b) { b.root["materials"][0]["normalTexture"]["texCoord"] = 3; }, "TEXCOORD_3");
  importWith([](GltfBuilder& b) { b.root["textures"][0].erase("source"); }, "no image");
  importWith(
      [](GltfBuilder& b) {
        b.root["textures"][0] = {{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}};
      },
      "KHR_texture_basisu");
  // Coordinates without an area, or none at all, give no tangents.
  importWith(
      [](GltfBuilder& b) {
        auto& attributes = b.root["meshes"][0]["primitives"][0]["attributes"];
        attributes["TEXCOORD_0"] = b.floats({0, 0, 0, 0, 0, 0, 0, 0}, "VEC2");
      },
      "2 of 2 triangles have a normal map");
  importWith([](GltfBuilder& b) { b.root["meshes"][0]["primitives"][0]["attributes"].erase("TEXCOORD_0"); },
             "2 of 2 triangles have a normal map");
  importWith(
      [](GltfBuilder& b) {
        auto& attributes = b.root["meshes"][0]["primitives"][0]["attributes"];
        attributes.erase("TEXCOORD_0");
        attributes["NORMAL"] = b.floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
        attributes["TANGENT"] = b.floats({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}, "VEC4");
      },
      "2 of 2 triangles have a normal map");
}

TEST(ImportGloss, aScaleBeyondReasonIsTakenForOne) {
  GltfBuilder b;
  b.quad({{"material", b.material(withNormalMap(b.texture(oneTexel(128, 128, 255)), 1e9f))}});
  EXPECT_EQ(glossyOrFail(b).materials[0].gloss.normalScale, 1.0f);
  EXPECT_TRUE(warned(b, "normalTexture.scale"));
}

TEST(ImportGloss, aNormalMapBendsAlongTheImage) {
  // The quad faces +Z; its image is upright: x of the map is +X, y is +Y.
  const auto bentBy = [](const Bytes& image, float scale, const json& node = json::object()) {
    GltfBuilder b;
    b.quad({{"material", b.material(withNormalMap(b.texture(image), scale))}});
    b.root["nodes"][0].merge_patch(node);
    return mappedNormal(glossyOrFail(b), kMiddle);
  };
  const float half = std::sqrt(0.5f);
  expectNear(bentBy(oneTexel(128, 128, 255), 1.0f), {0, 0, 1}, 0.01f);
  expectNear(bentBy(oneTexel(218, 128, 218), 1.0f), {half, 0, half}, 0.01f);
  expectNear(bentBy(oneTexel(128, 218, 218), 1.0f), {0, half, half}, 0.01f);
  expectNear(bentBy(oneTexel(218, 128, 218), 2.0f), glm::normalize(glm::vec3(2, 0, 1)), 0.01f);
  // Turned a quarter about Z, and seen in a mirror at x = 0, what it shows turns with it.
  expectNear(bentBy(oneTexel(218, 128, 218), 1.0f, {{"rotation", {0, 0, half, half}}}), {0, half, half}, 0.01f);
  expectNear(bentBy(oneTexel(218, 128, 218), 1.0f, {{"scale", {-1, 1, 1}}}), {-half, 0, half}, 0.01f);
  expectNear(bentBy(oneTexel(128, 218, 218), 1.0f, {{"scale", {-1, 1, 1}}}), {0, half, half}, 0.01f);
}

TEST(ImportGloss, mirroredCoordinatesBendTheOtherWay) {
  GltfBuilder b;
  b.quad({{"material", b.material(withNormalMap(b.texture(oneTexel(218, 218, 218))))}});
  b.root["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = b.floats({1, 1, 0, 1, 0, 0, 1, 0}, "VEC2");
  expectNear(mappedNormal(glossyOrFail(b), kMiddle), glm::normalize(glm::vec3(-1, 1, 1)), 0.01f);
}

TEST(ImportGloss, givenTangentsCountWhereThereAreNormals) {
  for (const bool normals : {true, false}) {
    GltfBuilder b;
    b.quad({{"material", b.material(withNormalMap(b.texture(oneTexel(218, 128, 218))))}});
    auto& attributes = b.root["meshes"][0]["primitives"][0]["attributes"];
    attributes["TANGENT"] = b.floats({0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1}, "VEC4");
    if (normals) attributes["NORMAL"] = b.floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
    const glm::vec3 along = normals ? glm::vec3(0, 1, 0) : glm::vec3(1, 0, 0);
    expectNear(mappedNormal(glossyOrFail(b), kMiddle), glm::normalize(along + glm::vec3(0, 0, 1)), 0.01f);
  }
}

TEST(ImportGloss, tangentsOfABallPointEastAndAreSmooth) {
  // u grows eastward, v southward. Corners at one point of the ball share a tangent, but at the poles and the seam.
  constexpr std::uint32_t kColumns = 24, kRows = 12;
  constexpr float kPi = 3.14159265f;
  Mesh ball;
  for (std::uint32_t r = 0; r <= kRows; ++r) {
    for (std::uint32_t c = 0; c <= kColumns; ++c) {
      const float phi = 2 * kPi * static_cast<float>(c) / kColumns, theta = kPi * static_cast<float>(r) / kRows;
      ball.position.emplace_back(std::sin(theta) * std::sin(phi), std::cos(theta), std::sin(theta) * std::cos(phi));
      ball.uv[0].emplace_back(static_cast<float>(c) / kColumns, static_cast<float>(r) / kRows);
    }
  }
  ball.normal = ball.position;
  for (std::uint32_t r = 1; r + 1 < kRows; ++r) {
    for (std::uint32_t c = 0; c < kColumns; ++c) {
      const std::uint32_t a = r * (kColumns + 1) + c, b = a + kColumns + 1;
      ball.triangle.emplace_back(a, b, a + 1);
      ball.triangle.emplace_back(a + 1, b, b + 1);
    }
  }
  EXPECT_EQ(makeTangents(ball, {}, TextureRef{}), 0u);
  for (std::size_t t = 0; t < ball.triangle.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::vec3 p = ball.position[ball.triangle[t][static_cast<int>(k)]];
      const glm::vec3 east = glm::normalize(glm::vec3(p.z, 0.0f, -p.x));
      const glm::vec4 tangent = ball.cornerTangent[3 * t + k];
      EXPECT_GT(glm::dot(glm::vec3(tangent), east), 0.98f);
      EXPECT_EQ(tangent.w, 1.0f);
      EXPECT_NEAR(glm::length(glm::vec3(tangent)), 1.0f, 1e-5f);
    }
  }
}

TEST(ImportGloss, givenTangentsThatAreNoNumbersAreNone) {
  Mesh mesh = test::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0});
  mesh.normal.assign(4, {0, 0, 1});
  const std::vector<glm::vec4> given(4, glm::vec4(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_EQ(makeTangents(mesh, given, TextureRef{}), 2u);
  for (const glm::vec4& tangent : mesh.cornerTangent) EXPECT_EQ(tangent, glm::vec4(0.0f));
}

TEST(ImportGloss, noHashOfABakeDependsOnIt) {
  GltfBuilder b;
  const int color = b.texture(oneTexel(200, 100, 50)), map = b.texture(oneTexel(218, 128, 218));
  json m = withNormalMap(map);
  m["pbrMetallicRoughness"] = {{"baseColorTexture", {{"index", color}}},
                               {"metallicRoughnessTexture", {{"index", color}}},
                               {"roughnessFactor", 0.5}};
  b.quad({{"material", b.material(m)}});
  const auto hashOf = [](const Scene& scene) { return hashScene(scene, describeInstances(scene)); };
  const Scene plain = glossyOrFail(b, false), glossy = glossyOrFail(b, true);
  EXPECT_FALSE(glossy.meshes[0].cornerTangent.empty());
  EXPECT_EQ(hashOf(plain), hashOf(glossy));
  EXPECT_EQ(describeShapes(plain), describeShapes(glossy));
  b.root["materials"][0]["pbrMetallicRoughness"]["roughnessFactor"] = 0.1;
  b.root["materials"][0]["normalTexture"]["scale"] = 0.3;
  EXPECT_EQ(hashOf(glossyOrFail(b, true)), hashOf(plain));
  // The base colour does.
  b.root["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {0.5, 1, 1, 1};
  EXPECT_NE(hashOf(glossyOrFail(b, true)), hashOf(plain));
}

}  // namespace
}  // namespace relume
