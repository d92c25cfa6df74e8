// SPDX-License-Identifier: MIT
// Primitives: topologies, index sizes, sparse and quantised accessors, missing and broken attributes.
#include "tests/import/gltf_builder.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <cmath>
#include <limits>

namespace relume {
namespace {

using namespace relume::testing;

Result<Scene> importPrimitive(GltfBuilder& b, const json& primitive) {
  b.node({{"mesh", b.mesh(primitive)}});
  return b.import();
}

double facingArea(const Scene& scene) {
  double area = 0.0;
  for (const Instance& instance : scene.instances) {
    for (std::uint32_t t = 0; t < scene.meshes[instance.mesh].triangle.size(); ++t) {
      const auto c = scene.corners(instance, t);
      area += 0.5 * glm::cross(c[1] - c[0], c[2] - c[0]).z;
    }
  }
  return area;
}

TEST(ImportMeshes, stripsFansAndListsCoverTheSameSquareWithTheSameWinding) {
  const std::vector<float> zigzag = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0};
  for (const int mode : {4, 5, 6}) {
    GltfBuilder b;
    json primitive = {{"mode", mode}, {"attributes", {{"POSITION", b.floats(mode == 5 ? zigzag : kSquare, "VEC3")}}}};
    if (mode == 4) primitive["indices"] = b.indices({0, 1, 2, 0, 2, 3});
    const Result<Scene> scene = importPrimitive(b, primitive);
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->triangleCount(), 2u) << mode;
    EXPECT_NEAR(facingArea(*scene), 1.0, 1e-6) << mode;
  }
}

TEST(ImportMeshes, withoutIndicesVerticesAreTakenInOrder) {
  GltfBuilder b;
  const Result<Scene> scene = importPrimitive(
      b, {{"attributes", {{"POSITION", b.floats({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0}, "VEC3")}}}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_NEAR(facingArea(*scene), 1.0, 1e-6);
}

TEST(ImportMeshes, pointsAndLinesAreLeftOutAndSaidSo) {
  for (const int mode : {0, 1, 2, 3}) {
    GltfBuilder b;
    const Result<Scene> scene =
        importPrimitive(b, {{"mode", mode}, {"attributes", {{"POSITION", b.floats(kSquare, "VEC3")}}}});
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_TRUE(scene->instances.empty());
    ASSERT_EQ(b.messages.size(), 1u);
    EXPECT_NE(b.messages[0].find("meshes[0].primitives[0]: points or lines"), std::string::npos) << b.messages[0];
  }
}

TEST(ImportMeshes, indicesOfOneTwoAndFourBytesMeanTheSame) {
  for (const int type : {5121, 5123, 5125}) {
    GltfBuilder b;
    const int position = b.floats(kSquare, "VEC3");
    const std::vector<std::uint8_t> bytes = {0, 1, 2, 0, 2, 3};
    const std::vector<std::uint16_t> shorts(bytes.begin(), bytes.end());
    const std::vector<std::uint32_t> words(bytes.begin(), bytes.end());
    const int view = type == 5121 ? b.view(bytes) : type == 5123 ? b.view(shorts) : b.view(words);
    const Result<Scene> scene = importPrimitive(
        b, {{"attributes", {{"POSITION", position}}}, {"indices", b.accessor(view, type, 6, "SCALAR")}});
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_NEAR(facingArea(*scene), 1.0, 1e-6) << type;
  }
}

TEST(ImportMeshes, interleavedAttributesAreReadByStrideAndOffset) {
  GltfBuilder b;
  std::vector<float> interleaved;
  for (int v = 0; v < 4; ++v) {
    for (int k = 0; k < 3; ++k) interleaved.push_back(kSquare[3 * v + k]);
    interleaved.insert(interleaved.end(), {0.25f * v, 0.5f});
  }
  const int view = b.view(interleaved, 20);
  const int position = b.accessor(view, 5126, 4, "VEC3");
  const int uv = b.accessor(view, 5126, 4, "VEC2");
  b.root["accessors"][uv]["byteOffset"] = 12;
  const Result<Scene> scene = importPrimitive(
      b, {{"attributes", {{"POSITION", position}, {"TEXCOORD_0", uv}}}, {"indices", b.indices({0, 1, 2, 0, 2, 3})}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_NEAR(facingArea(*scene), 1.0, 1e-6);
  for (std::size_t v = 0; v < 4; ++v)
    EXPECT_EQ(scene->meshes[0].uv[0][v], glm::vec2(0.25f * static_cast<float>(v), 0.5f));
}

TEST(ImportMeshes, sparseAccessorsReplaceElementsOfTheirBaseOrOfZeros) {
  for (const bool base : {true, false}) {
    GltfBuilder b;
    const int position = b.floats(kSquare, "VEC3");
    const std::vector<std::uint16_t> at = {1, 2};
    const std::vector<float> values = {5, 0, 0, 6, 7, 0};
    json& a = b.root["accessors"][position];
    if (!base) a.erase("bufferView");
    const int indexView = b.view(at), valueView = b.view(values);
    b.root["accessors"][position]["sparse"] = {{"count", 2},
                                               {"indices", {{"bufferView", indexView}, {"componentType", 5123}}},
                                               {"values", {{"bufferView", valueView}}}};
    const Result<Scene> scene =
        importPrimitive(b, {{"attributes", {{"POSITION", position}}}, {"indices", b.indices({0, 1, 2, 0, 2, 3})}});
    ASSERT_TRUE(scene) << scene.error().message;
    const auto& p = scene->meshes[0].position;
    EXPECT_EQ(p[0], glm::vec3(0, 0, 0));
    EXPECT_EQ(p[1], glm::vec3(5, 0, 0));
    EXPECT_EQ(p[2], glm::vec3(6, 7, 0));
    EXPECT_EQ(p[3], base ? glm::vec3(0, 1, 0) : glm::vec3(0, 0, 0));
  }
}

TEST(ImportMeshes, sparseIndicesOverZerosMakeTriangles) {
  GltfBuilder b;
  const int position = b.floats(kSquare, "VEC3");
  const std::vector<std::uint8_t> at = {1, 2};
  const std::vector<std::uint16_t> values = {1, 2};
  const int indexView = b.view(at), valueView = b.view(values);
  b.root["accessors"].push_back({{"componentType", 5123},
                                 {"count", 3},
                                 {"type", "SCALAR"},
                                 {"sparse",
                                  {{"count", 2},
                                   {"indices", {{"bufferView", indexView}, {"componentType", 5121}}},
                                   {"values", {{"bufferView", valueView}}}}}});
  const Result<Scene> scene = importPrimitive(b, {{"attributes", {{"POSITION", position}}}, {"indices", 1}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->meshes[0].triangle[0], glm::uvec3(0, 1, 2));
}

TEST(ImportMeshes, quantisedAttributesAreScaledAsTheExtensionSays) {
  GltfBuilder b;
  const std::vector<std::int16_t> positions = {-32768, 0, 0, 0, 32767, 0, 0, 0, 16384, 0, 0, 0};  // padded to 8 bytes
  const std::vector<std::int8_t> normals = {0, 0, 127, 0, 0, 0, 127, 0, 0, 0, 127, 0};
  const std::vector<std::uint16_t> uvs = {0, 65535, 32768, 0, 1, 2};
  const int position = b.accessor(b.view(positions, 8), 5122, 3, "VEC3", true);
  const int normal = b.accessor(b.view(normals, 4), 5120, 3, "VEC3", true);
  const int uv = b.accessor(b.view(uvs), 5123, 3, "VEC2", true);
  const int plainUv = b.accessor(b.view(uvs), 5123, 3, "VEC2", false);
  b.root["extensionsRequired"] = b.root["extensionsUsed"] = {"KHR_mesh_quantization"};
  const Result<Scene> scene = importPrimitive(
      b, {{"attributes", {{"POSITION", position}, {"NORMAL", normal}, {"TEXCOORD_0", uv}, {"TEXCOORD_1", plainUv}}}});
  ASSERT_TRUE(scene) << scene.error().message;
  const Mesh& mesh = scene->meshes[0];
  EXPECT_EQ(mesh.position[0], glm::vec3(-1, 0, 0));  // -32768 clamps to -1
  EXPECT_EQ(mesh.position[1], glm::vec3(1, 0, 0));
  EXPECT_FLOAT_EQ(mesh.position[2].x, 16384.0f / 32767.0f);
  EXPECT_EQ(mesh.normal[0], glm::vec3(0, 0, 1));
  EXPECT_EQ(mesh.uv[0][0], glm::vec2(0, 1));
  EXPECT_EQ(mesh.uv[1][2], glm::vec2(1, 2));
}

TEST(ImportMeshes, vertexColoursComeFromBytesAndShortsAndCarryAlpha) {
  GltfBuilder b;
  const std::vector<std::uint8_t> bytes = {255, 0, 51, 128, 255, 255, 255, 255, 0, 0, 0, 0, 1, 2, 3, 4};
  const int position = b.floats(kSquare, "VEC3");
  const int color = b.accessor(b.view(bytes), 5121, 4, "VEC4", true);
  const Result<Scene> scene = importPrimitive(
      b, {{"attributes", {{"POSITION", position}, {"COLOR_0", color}}}, {"indices", b.indices({0, 1, 2, 0, 2, 3})}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->meshes[0].color[0], glm::vec3(1.0f, 0.0f, 0.2f));
  EXPECT_FLOAT_EQ(scene->meshes[0].colorAlpha[0], 128.0f / 255.0f);
}

TEST(ImportMeshes, missingNormalsStayMissingAndShadeFlat) {
  GltfBuilder b;
  b.quad();
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_TRUE(scene->meshes[0].normal.empty());
  EXPECT_EQ(shadingNormal(*scene, {0, 0, {0.3f, 0.3f}}), glm::vec3(0, 0, 1));
}

TEST(ImportMeshes, brokenNormalsAreTakenFromTheTriangles) {
  GltfBuilder b;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const int position = b.floats(kSquare, "VEC3");
  const int normal = b.floats({0, 0, 0, nan, 0, 0, 0, 3, 0, 0, 0, 1}, "VEC3");
  const Result<Scene> scene = importPrimitive(
      b, {{"attributes", {{"POSITION", position}, {"NORMAL", normal}}}, {"indices", b.indices({0, 1, 2, 0, 2, 3})}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->meshes[0].normal[0], glm::vec3(0, 0, 1));
  EXPECT_EQ(scene->meshes[0].normal[1], glm::vec3(0, 0, 1));
  EXPECT_EQ(scene->meshes[0].normal[2], glm::vec3(0, 1, 0));  // normalised
  ASSERT_EQ(b.messages.size(), 1u);
  EXPECT_NE(b.messages[0].find("2 normals"), std::string::npos);
}

TEST(ImportMeshes, brokenTextureCoordinatesAreZeroWithAWarning) {
  GltfBuilder b;
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const int position = b.floats(kSquare, "VEC3");
  const int uv = b.floats({nan, 1, 0, inf, 0.5, 0.5, 1, 1}, "VEC2");
  const Result<Scene> scene = importPrimitive(
      b, {{"attributes", {{"POSITION", position}, {"TEXCOORD_0", uv}}}, {"indices", b.indices({0, 1, 2, 0, 2, 3})}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->meshes[0].uv[0][0], glm::vec2(0, 0));
  EXPECT_EQ(scene->meshes[0].uv[0][1], glm::vec2(0, 0));
  EXPECT_EQ(scene->meshes[0].uv[0][2], glm::vec2(0.5f, 0.5f));
  ASSERT_EQ(b.messages.size(), 1u);
  EXPECT_NE(b.messages[0].find("2 texture coordinates"), std::string::npos);
}

TEST(ImportMeshes, verticesNobodyUsesAreDropped) {
  GltfBuilder b;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const int position = b.floats({nan, nan, nan, 0, 0, 0, 9, 9, 9, 1, 0, 0, 1, 1, 0}, "VEC3");
  const Result<Scene> scene =
      importPrimitive(b, {{"attributes", {{"POSITION", position}}}, {"indices", b.indices({1, 3, 4})}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->meshes[0].position.size(), 3u);
  EXPECT_EQ(scene->meshes[0].triangle[0], glm::uvec3(0, 1, 2));
}

TEST(ImportMeshes, degenerateTrianglesAreKept) {
  GltfBuilder b;
  const Result<Scene> scene = importPrimitive(b, {{"attributes", {{"POSITION", b.floats(kSquare, "VEC3")}}},
                                                  {"indices", b.indices({0, 0, 0, 0, 1, 1, 0, 1, 2})}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->triangleCount(), 3u);
  EXPECT_EQ(geometricNormal(*scene, {0, 1, {0.3f, 0.3f}}), glm::vec3(0.0f));
}

TEST(ImportMeshes, eachPrimitiveIsAMeshWithItsNumber) {
  GltfBuilder b;
  b.quad();
  b.root["meshes"][0]["name"] = "wall";
  b.root["meshes"][0]["primitives"].push_back(b.root["meshes"][0]["primitives"][0]);
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 2u);
  EXPECT_EQ(scene->meshes[0].name, "wall#0");
  EXPECT_EQ(scene->meshes[1].name, "wall#1");
  EXPECT_EQ(scene->instances[1].primitive, 1u);
}

TEST(ImportMeshes, skinnedMeshesAreDynamicUnlessSaidOtherwise) {
  GltfBuilder b;
  const int quad = b.quad();
  b.root["nodes"][quad]["skin"] = 0;
  b.root["skins"] = json::array({{{"joints", {0}}}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->instances.at(0).mode, BakeMode::dynamic);
}

TEST(ImportMeshes, theSameFileGivesTheSameSceneAtAnyThreadCount) {
  GltfBuilder b;
  for (int i = 0; i < 6; ++i) {
    const int texture = b.texture(png(4, 2, std::vector<std::uint8_t>(32, static_cast<std::uint8_t>(40 * i))));
    b.quad({{"material", b.material({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}})}});
  }
  b.threads = 1;
  const Result<Scene> one = b.import();
  b.threads = 3;
  const Result<Scene> three = b.import();
  ASSERT_TRUE(one && three);
  ASSERT_EQ(one->images.size(), 6u);
  for (std::size_t i = 0; i < 6; ++i) {
    ASSERT_EQ(one->images[i].levels.size(), three->images[i].levels.size());
    for (std::size_t l = 0; l < one->images[i].levels.size(); ++l)
      EXPECT_EQ(one->images[i].levels[l].rgba, three->images[i].levels[l].rgba);
    EXPECT_EQ(one->materials[i].albedoTexture.image, three->materials[i].albedoTexture.image);
  }
}

}  // namespace
}  // namespace relume
