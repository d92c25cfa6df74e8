// SPDX-License-Identifier: MIT
// The loader of levels that samples share, on levels of one triangle that faces +Z: what nodes do to triangles, cameras
// and lights, which camera is taken, what is hidden, what is refused.
#include "samples/read_level/level.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>

namespace {

namespace fs = std::filesystem;

constexpr const char* kDrawn = R"({"mesh":0})";
constexpr int kOrthographic = 0, kPerspective = 1;

// Positions as floats, and those of mesh 1 as 16 bits with a sign; normals; places on the light map.
std::string buffer() {
  const float position[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, normal[9] = {0, 0, 1, 0, 0, 1, 0, 0, 1};
  const std::int16_t small[12] = {0, 0, 0, 0, 32767, -16384, 0, 0, -32768, 32767, 0, 0};
  const std::uint16_t place[6] = {0, 0, 100, 0, 0, 200};
  std::string bytes(sizeof position + sizeof normal + sizeof small + sizeof place, '\0');
  std::memcpy(bytes.data(), position, sizeof position);
  std::memcpy(bytes.data() + 36, normal, sizeof normal);
  std::memcpy(bytes.data() + 72, small, sizeof small);
  std::memcpy(bytes.data() + 96, place, sizeof place);
  return bytes;
}

std::string json(const std::string& nodes, const std::string& extensions) {
  return R"({"asset":{"version":"2.0","extras":{"relume":{"lightmap":{"texcoord":1,"sceneHash":"00000000000000ab"}}}},)" +
         extensions + R"("scene":0,"scenes":[{"nodes":[0]}],"nodes":[)" + nodes + R"(],"cameras":[
    {"type":"orthographic","orthographic":{"xmag":1,"ymag":1,"znear":0,"zfar":9}},
    {"type":"perspective","perspective":{"yfov":0.7,"znear":0.1}}],
  "meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":1,"TEXCOORD_1":3}}]},
    {"primitives":[{"attributes":{"POSITION":2,"NORMAL":1,"TEXCOORD_1":3}}]}],
  "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"},
    {"bufferView":1,"componentType":5126,"count":3,"type":"VEC3"},
    {"bufferView":2,"componentType":5122,"normalized":true,"count":3,"type":"VEC3"},
    {"bufferView":3,"componentType":5123,"normalized":true,"count":3,"type":"VEC2"}],
  "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":36},
    {"buffer":0,"byteOffset":72,"byteLength":24,"byteStride":8},{"buffer":0,"byteOffset":96,"byteLength":12}],
  "buffers":[{"byteLength":108}]})";
}

// A level of these nodes, of which the first is the scene's; `extensions`: members of the root, with a comma behind
// each.
relume::Result<Level> load(const std::string& nodes, const std::string& extensions = "") {
  const fs::path path = fs::path(testing::TempDir()) / "relume_read_level.glb";
  std::string text = json(nodes, extensions), bytes = buffer();
  text.append((4 - text.size() % 4) % 4, ' ');
  const auto word = [](std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    std::string four(4, '\0');
    std::memcpy(four.data(), &number, 4);
    return four;
  };
  std::ofstream(path, std::ios::binary) << "glTF" << word(2) << word(28 + text.size() + bytes.size())
                                        << word(text.size()) << "JSON" << text << word(bytes.size())
                                        << std::string("BIN\0", 4) << bytes;
  relume::Result<Level> level = loadLevel(path.string());
  fs::remove(path);
  return level;
}

const Vertex& corner(const Level& level, std::size_t i) { return level.vertices[level.indices[i]]; }

// Of the first triangle, by the order of its corners.
glm::vec3 faceNormal(const Level& level) {
  const glm::vec3 a = corner(level, 0).position;
  return glm::normalize(glm::cross(corner(level, 1).position - a, corner(level, 2).position - a));
}

std::string cameraNode(int camera, float x) {
  return R"({"camera":)" + std::to_string(camera) + R"(,"translation":[)" + std::to_string(x) + ",0,0]}";
}

std::string under(const std::string& scale, const char* child) {
  return R"({"scale":)" + scale + R"(,"children":[1]},)" + child;
}

TEST(ReadLevel, mirroredTrianglesFaceWhereTheirNormalsDo) {
  for (const char* scale : {"[1,1,1]", "[-1,1,1]", "[1,-2,1]", "[1,1,-1]", "[-1,-1,1]", "[-0.01,-0.01,-0.01]"}) {
    const relume::Result<Level> level = load(under(scale, kDrawn));
    ASSERT_TRUE(level) << level.error().message;
    ASSERT_EQ(level->indices.size(), 3u);
    for (std::size_t i = 0; i < 3; ++i)
      EXPECT_GT(glm::dot(faceNormal(*level), corner(*level, i).normal), 0.999f) << scale;
  }
}

TEST(ReadLevel, mirroredCornersKeepTheirPlacesOnTheLightMap) {
  const relume::Result<Level> level = load(under("[-1,1,1]", kDrawn));
  ASSERT_TRUE(level) << level.error().message;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vertex& v = corner(*level, i);
    EXPECT_EQ(v.lightmapUv[0], v.position.x == -1.0f ? 100 : 0);
    EXPECT_EQ(v.lightmapUv[1], v.position.y == 1.0f ? 200 : 0);
  }
}

TEST(ReadLevel, camerasKeepNoScaleOfTheNodesAbove) {
  for (const char* scale : {"[1,1,1]", "[0.001,0.001,0.001]", "[1000,1000,1000]", "[-1,1,1]", "[1,2,-3]"}) {
    const relume::Result<Level> level =
        load(R"({"scale":)" + std::string(scale) + R"(,"rotation":[0,0.6,0,0.8],"children":[1]},)" +
             R"({"mesh":0,"rotation":[0.6,0,0,0.8],"children":[2]},{"camera":1,"translation":[0,0,2]})");
    ASSERT_TRUE(level) << level.error().message;
    const glm::mat3 turn(level->worldFromCamera);
    EXPECT_NEAR(glm::determinant(turn), 1.0f, 1e-5f) << scale;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(glm::dot(turn[i], turn[k]), i == k ? 1.0f : 0.0f, 1e-5f) << scale;
    }
  }
}

TEST(ReadLevel, scaleMovesACamera) {
  const relume::Result<Level> level =
      load(R"({"scale":[-3,-3,-3],"children":[1]},{"mesh":0,"children":[2]},{"camera":1,"translation":[0,0,2]})");
  ASSERT_TRUE(level) << level.error().message;
  EXPECT_EQ(level->worldFromCamera[3], glm::vec4(0, 0, -6, 1));
  EXPECT_EQ(level->worldFromCamera[2], glm::vec4(0, 0, -1, 0));  // it looked along -Z
}

TEST(ReadLevel, theFirstPerspectiveCameraIsTaken) {
  const relume::Result<Level> level = load(R"({"mesh":0,"children":[1,2,3]},)" + cameraNode(kOrthographic, 1) + "," +
                                           cameraNode(kPerspective, 2) + "," + cameraNode(kPerspective, 3));
  ASSERT_TRUE(level) << level.error().message;
  EXPECT_FLOAT_EQ(level->worldFromCamera[3].x, 2.0f);
  EXPECT_FLOAT_EQ(level->fovYRad, 0.7f);
}

TEST(ReadLevel, withoutAPerspectiveCameraTheFirstStandsForIt) {
  const relume::Result<Level> level =
      load(R"({"mesh":0,"children":[1,2]},)" + cameraNode(kOrthographic, 1) + "," + cameraNode(kOrthographic, 2));
  ASSERT_TRUE(level) << level.error().message;
  EXPECT_FLOAT_EQ(level->worldFromCamera[3].x, 1.0f);
  EXPECT_FLOAT_EQ(level->fovYRad, std::acos(0.5f));
}

constexpr const char* kLights =
    R"("extensions":{"KHR_lights_punctual":{"lights":[{"type":"directional"},{"type":"point"}]}},)";

// A node that shines along -Z, which its rotation turns to -X: `members` of its own, with a comma behind each.
std::string sunNode(const std::string& members) {
  return "{" + members + R"("extensions":{"KHR_lights_punctual":{"light":0}}})";
}

TEST(ReadLevel, aLightsOwnScaleDoesNotTurnItButThoseOfNodesAboveAndItsMatrixDo) {
  const std::string aside = R"("rotation":[0,0.70710678,0,0.70710678],)";
  const struct {
    std::string above, light;
    glm::vec3 direction;
  } kCases[] = {{"[1,1,1]", aside + R"("scale":[3,3,-2],)", {-1, 0, 0}},
                {"[1,1,1]", aside + R"("scale":[1,1,0],)", {-1, 0, 0}},
                {"[-2,1,1]", aside, {1, 0, 0}},
                {"[1,1,-1]", R"("scale":[1,1,-1],)", {0, 0, 1}},
                {"[1,1,1]", R"("matrix":[1,0,0,0, 0,1,0,0, 0,0,-2,0, 0,0,0,1],)", {0, 0, 1}},
                {"[0,0,0]", "", {0, 0, -1}}};
  for (const auto& [above, light, direction] : kCases) {
    const relume::Result<Level> level =
        load(R"({"mesh":0,"children":[1]},{"scale":)" + above + R"(,"children":[2]},)" + sunNode(light), kLights);
    ASSERT_TRUE(level) << level.error().message;
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(level->sun.direction[i], direction[i], 1e-6f) << above << light;
  }
}

TEST(ReadLevel, hiddenNodesAndThoseBelowHaveNoMeshesAndLights) {
  const std::string visibility = R"("extensions":{"KHR_node_visibility":{"visible":)";
  const relume::Result<Level> level =
      load(R"({"mesh":0,"children":[1,2]},{)" + visibility + R"(true}},"mesh":0},{)" + visibility +
               R"(false}},"mesh":0,"children":[3,4,5]},{"mesh":0},)" + sunNode("") + "," + cameraNode(kPerspective, 2),
           std::string(kLights) + R"("extensionsRequired":["KHR_node_visibility"],)");
  ASSERT_TRUE(level) << level.error().message;
  EXPECT_EQ(level->draws.size(), 2u);
  EXPECT_EQ(level->sun.intensity, glm::vec3(0.0f));
  EXPECT_FLOAT_EQ(level->worldFromCamera[3].x, 2.0f);  // what it sees is not hidden
}

TEST(ReadLevel, integersWithASignAreRead) {
  const relume::Result<Level> level = load(R"({"mesh":1})", R"("extensionsRequired":["KHR_mesh_quantization"],)");
  ASSERT_TRUE(level) << level.error().message;
  EXPECT_NEAR(level->vertices[1].position.x, 1.0f, 1e-6f);
  EXPECT_NEAR(level->vertices[1].position.y, -0.5f, 1e-4f);
  EXPECT_EQ(level->vertices[2].position.x, -1.0f);  // both -32768 and -32767
}

TEST(ReadLevel, extensionsThatAreRequiredAndNotReadAreNamed) {
  const relume::Result<Level> level =
      load(kDrawn, R"("extensionsRequired":["KHR_lights_punctual","KHR_draco_mesh_compression"],)");
  ASSERT_FALSE(level);
  EXPECT_EQ(level.error().code, relume::ErrorCode::unsupported);
  EXPECT_NE(level.error().message.find("KHR_draco_mesh_compression"), std::string::npos) << level.error().message;
}

}  // namespace
