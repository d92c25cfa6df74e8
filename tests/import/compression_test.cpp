// SPDX-License-Identifier: MIT
// EXT_meshopt_compression, KHR_meshopt_compression and KHR_draco_mesh_compression, encoded here by the packages that
// define them.
#include "tests/import/gltf_builder.h"

#include <meshoptimizer.h>

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>

namespace relume {
namespace {

using namespace relume::testing;
using Bytes = std::vector<std::uint8_t>;

const std::vector<std::uint32_t> kIndices = {0, 1, 2, 0, 2, 3};
constexpr const char* kMeshopt = "EXT_meshopt_compression";
constexpr const char* kSuccessor = "KHR_meshopt_compression";

Bytes encodeVertices(const void* vertices, std::size_t count, std::size_t stride) {
  Bytes out(meshopt_encodeVertexBufferBound(count, stride));
  out.resize(meshopt_encodeVertexBuffer(out.data(), out.size(), vertices, count, stride));
  return out;
}

// A buffer view that is compressed, with a fallback buffer that holds nothing.
int compressedView(GltfBuilder& b, const Bytes& data, std::size_t count, std::size_t stride, const char* mode,
                   const char* filter = "NONE", const char* extension = kMeshopt) {
  const int raw = b.view(data);
  const json source = b.root["bufferViews"][raw];
  b.root["bufferViews"][raw] = {{"buffer", 1}, {"byteLength", count * stride}};
  b.root["bufferViews"][raw]["extensions"][extension] = {{"buffer", 0},
                                                         {"byteOffset", source["byteOffset"]},
                                                         {"byteLength", data.size()},
                                                         {"byteStride", stride},
                                                         {"count", count},
                                                         {"mode", mode},
                                                         {"filter", filter}};
  b.root["extensionsRequired"] = {extension};
  return raw;
}

void addFallback(GltfBuilder& b, const char* extension = kMeshopt) {
  b.root["buffers"] = json::array(
      {{{"byteLength", b.binary.size()}}, {{"byteLength", 1000}, {"extensions", {{extension, {{"fallback", true}}}}}}});
}

TEST(Compression, meshoptVerticesAndTrianglesRoundTrip) {
  for (const auto& [triangles, extension] :
       {std::pair(true, kMeshopt), {false, kMeshopt}, {true, kSuccessor}, {false, kSuccessor}}) {
    GltfBuilder b;
    Bytes indices(1000);
    indices.resize(triangles ? meshopt_encodeIndexBuffer(indices.data(), indices.size(), kIndices.data(), 6)
                             : meshopt_encodeIndexSequence(indices.data(), indices.size(), kIndices.data(), 6));
    const int position =
        b.accessor(compressedView(b, encodeVertices(kSquare.data(), 4, 12), 4, 12, "ATTRIBUTES", "NONE", extension),
                   5126, 4, "VEC3");
    const int index = b.accessor(
        compressedView(b, indices, 6, 2, triangles ? "TRIANGLES" : "INDICES", "NONE", extension), 5123, 6, "SCALAR");
    b.node({{"mesh", b.mesh({{"attributes", {{"POSITION", position}}}, {"indices", index}})}});
    addFallback(b, extension);
    const Result<Scene> scene = b.import();
    ASSERT_TRUE(scene) << scene.error().message;
    ASSERT_EQ(scene->triangleCount(), 2u);
    double area = 0.0;
    for (std::uint32_t t = 0; t < 2; ++t) {
      const auto c = scene->corners(scene->instances[0], t);
      area += 0.5 * glm::cross(c[1] - c[0], c[2] - c[0]).z;
    }
    EXPECT_DOUBLE_EQ(area, 1.0);
  }
}

TEST(Compression, meshoptFiltersAreUndone) {
  GltfBuilder b;
  const std::vector<float> normals = {0, 0, 1, 0, 0, 1, 0, 0, 0.6f, 0, 0.8f, 0, 0, 1, 0, 0};
  Bytes octahedral(16);
  meshopt_encodeFilterOct(octahedral.data(), 4, 4, 8, normals.data());
  std::vector<float> exponential(12);
  meshopt_encodeFilterExp(exponential.data(), 4, 12, 20, kSquare.data());
  const int position =
      b.accessor(compressedView(b, encodeVertices(exponential.data(), 4, 12), 4, 12, "ATTRIBUTES", "EXPONENTIAL"), 5126,
                 4, "VEC3");
  const int normal =
      b.accessor(compressedView(b, encodeVertices(octahedral.data(), 4, 4), 4, 4, "ATTRIBUTES", "OCTAHEDRAL"), 5120, 4,
                 "VEC3", true);
  b.node({{"mesh", b.mesh({{"attributes", {{"POSITION", position}, {"NORMAL", normal}}},
                           {"indices", b.indices({0, 1, 2, 0, 2, 3})}})}});
  addFallback(b);
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  for (std::size_t v = 0; v < 4; ++v) {
    const glm::vec3 position3(kSquare[3 * v], kSquare[3 * v + 1], kSquare[3 * v + 2]);
    const glm::vec3 normal3(normals[4 * v], normals[4 * v + 1], normals[4 * v + 2]);
    EXPECT_LT(glm::length(scene->meshes[0].position[v] - position3), 1e-4f);
    EXPECT_LT(glm::length(scene->meshes[0].normal[v] - normal3), 0.02f) << v;
  }
}

TEST(Compression, meshoptClaimsAreBoundedByTheirBytes) {
  GltfBuilder b;
  const int view = compressedView(b, encodeVertices(kSquare.data(), 4, 12), 4, 12, "ATTRIBUTES");
  b.root["bufferViews"][view]["extensions"]["EXT_meshopt_compression"]["count"] = 2147483646;
  addFallback(b);
  const Result<Scene> scene = b.import();
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, ErrorCode::invalidFile);
  EXPECT_NE(scene.error().message.find("bufferViews[0].extensions.EXT_meshopt_compression: claims 2147483646"),
            std::string::npos)
      << scene.error().message;
}

// Found by fuzzing: 4294967295 became -1 on its way through tinygltf.
TEST(Compression, meshoptNumbersBeyond31BitsAreRefused) {
  for (const char* name : {"byteStride", "byteOffset", "byteLength", "count"}) {
    GltfBuilder b;
    const int view = compressedView(b, encodeVertices(kSquare.data(), 4, 12), 4, 12, "ATTRIBUTES");
    b.root["bufferViews"][view]["extensions"]["EXT_meshopt_compression"][name] = 4294967295u;
    addFallback(b);
    const Result<Scene> scene = b.import();
    ASSERT_FALSE(scene);
    EXPECT_NE(scene.error().message.find("EXT_meshopt_compression." + std::string(name) + ": expected a whole number"),
              std::string::npos)
        << scene.error().message;
  }
}

TEST(Compression, brokenMeshoptDataIsNamed) {
  GltfBuilder b;
  Bytes data = encodeVertices(kSquare.data(), 4, 12);
  data[0] ^= 0xFF;
  compressedView(b, data, 4, 12, "ATTRIBUTES");
  addFallback(b);
  const Result<Scene> scene = b.import();
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().message.find("broken compressed data"), std::string::npos) << scene.error().message;
}

// A square whose positions are of a version that the library does not decode.
GltfBuilder newerLevel() {
  constexpr std::uint8_t kNewer = MESHOPTIMIZER_VERSION < 230 ? 0xa1 : 0xa2;
  GltfBuilder b;
  Bytes data = encodeVertices(kSquare.data(), 4, 12);
  data[0] = kNewer;
  const int view = compressedView(b, data, 4, 12, "ATTRIBUTES", "NONE", kSuccessor);
  b.node({{"mesh", b.mesh({{"attributes", {{"POSITION", b.accessor(view, 5126, 4, "VEC3")}}},
                           {"indices", b.indices({0, 1, 2, 0, 2, 3})}})}});
  addFallback(b, kSuccessor);
  return b;
}

TEST(Compression, streamsThatTheLibraryCannotDecodeAreReadFromTheirFallback) {
  GltfBuilder b = newerLevel();
  const Result<Scene> refused = b.import();
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::unsupported);
  for (const char* part : {"test.glb: bufferViews[0].extensions.KHR_meshopt_compression: version ",
                           " of the vertex codec is not in meshoptimizer ", "gltfpack -ce ext"})
    EXPECT_NE(refused.error().message.find(part), std::string::npos) << refused.error().message;

  Bytes plain(48);
  std::memcpy(plain.data(), kSquare.data(), plain.size());
  b.root["buffers"][1]["byteLength"] = plain.size();
  b.root["buffers"][1]["uri"] = "data:application/octet-stream;base64," + base64(plain);
  b.root.erase("extensionsRequired");
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->meshes.at(0).position.at(2), glm::vec3(1, 1, 0));

  // A view that lies where its own compressed data does has no fallback.
  b.root["bufferViews"][0]["buffer"] = 0;
  EXPECT_FALSE(b.import());
}

TEST(Compression, filtersThatTheLibraryLacksAreNamed) {
  GltfBuilder b;
  const std::vector<std::uint8_t> colors(16, 255);
  compressedView(b, encodeVertices(colors.data(), 4, 4), 4, 4, "ATTRIBUTES", "COLOR", kSuccessor);
  addFallback(b, kSuccessor);
  const Result<Scene> scene = b.import();
  ASSERT_EQ(static_cast<bool>(scene), MESHOPTIMIZER_VERSION >= 250);
  if (!scene) {
    EXPECT_NE(scene.error().message.find("KHR_meshopt_compression: filter COLOR is not in meshoptimizer "),
              std::string::npos)
        << scene.error().message;
  }
}

Bytes encodeDraco(int method = draco::MESH_EDGEBREAKER_ENCODING) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(2);
  const int position = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int uv = builder.AddAttribute(draco::GeometryAttribute::TEX_COORD, 2, draco::DT_FLOAT32);
  const float uvs[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  for (int f = 0; f < 2; ++f) {
    const std::uint32_t* v = &kIndices[3 * static_cast<std::size_t>(f)];
    builder.SetAttributeValuesForFace(position, draco::FaceIndex(static_cast<std::uint32_t>(f)), &kSquare[3 * v[0]],
                                      &kSquare[3 * v[1]], &kSquare[3 * v[2]]);
    builder.SetAttributeValuesForFace(uv, draco::FaceIndex(static_cast<std::uint32_t>(f)), uvs[v[0]], uvs[v[1]],
                                      uvs[v[2]]);
  }
  const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
  draco::Encoder encoder;
  encoder.SetEncodingMethod(method);
  encoder.SetAttributeQuantization(draco::GeometryAttribute::POSITION, 14);
  encoder.SetAttributeQuantization(draco::GeometryAttribute::TEX_COORD, 12);
  draco::EncoderBuffer buffer;
  EXPECT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
  return Bytes(buffer.data(), buffer.data() + buffer.size());
}

GltfBuilder dracoQuad(const Bytes& data) {
  GltfBuilder b;
  const int view = b.view(data);
  b.root["accessors"] = json::array({{{"componentType", 5126}, {"count", 4}, {"type", "VEC3"}},
                                     {{"componentType", 5126}, {"count", 4}, {"type", "VEC2"}},
                                     {{"componentType", 5125}, {"count", 6}, {"type", "SCALAR"}}});
  json primitive = {{"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}}, {"indices", 2}};
  primitive["extensions"]["KHR_draco_mesh_compression"] = {{"bufferView", view},
                                                           {"attributes", {{"POSITION", 0}, {"TEXCOORD_0", 1}}}};
  b.node({{"mesh", b.mesh(primitive)}});
  b.root["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  return b;
}

TEST(Compression, dracoMeshesRoundTrip) {
  const GltfBuilder b = dracoQuad(encodeDraco());
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->triangleCount(), 2u);
  const Mesh& mesh = scene->meshes[0];
  EXPECT_EQ(mesh.position.size(), 4u);
  for (std::size_t v = 0; v < mesh.position.size(); ++v) {
    EXPECT_NEAR(mesh.uv[0][v].x, mesh.position[v].x, 1e-3f);  // uv was (x, y)
    EXPECT_NEAR(mesh.uv[0][v].y, mesh.position[v].y, 1e-3f);
  }
  const auto c = scene->corners(scene->instances[0], 0);
  EXPECT_NEAR(glm::cross(c[1] - c[0], c[2] - c[0]).z, 1.0f, 1e-3f);
}

// Morph targets of Draco's vertices are plain accessors in their order; views of EXT_meshopt_compression are as any.
TEST(Compression, compressedMeshesAreBent) {
  GltfBuilder draco = dracoQuad(encodeDraco());
  const Result<Scene> straight = draco.import();
  ASSERT_TRUE(straight) << straight.error().message;
  std::vector<float> deltas;
  for (const glm::vec3& p : straight->meshes[0].position) deltas.insert(deltas.end(), {0.0f, 0.0f, 2.0f * p.x});
  draco.root["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", draco.floats(deltas, "VEC3")}}};
  draco.root["nodes"][0]["weights"] = {0.5};
  const Result<Scene> bent = draco.import();
  ASSERT_TRUE(bent) << bent.error().message;
  for (const glm::vec3& p : bent->meshes[0].position) EXPECT_EQ(p.z, p.x);
  draco.root["meshes"][0]["primitives"][0]["targets"] = {
      {{"POSITION", draco.floats({0, 0, 0, 0, 0, 0, 0, 0, 0}, "VEC3")}}};
  const Result<Scene> few = draco.import();
  ASSERT_FALSE(few);
  EXPECT_NE(few.error().message.find("3 values, the mesh's POSITION has 4"), std::string::npos) << few.error().message;

  GltfBuilder meshopt;
  const int quad = meshopt.quad();
  const int view = compressedView(meshopt, encodeVertices(kSquare.data(), 4, 12), 4, 12, "ATTRIBUTES");
  addFallback(meshopt);
  meshopt.root["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", meshopt.accessor(view, 5126, 4, "VEC3")}}};
  meshopt.root["nodes"][quad]["weights"] = {1.0};
  const Result<Scene> doubled = meshopt.import();
  ASSERT_TRUE(doubled) << doubled.error().message;
  EXPECT_EQ(doubled->meshes[0].position[2], glm::vec3(2, 2, 0));
}

// Draco has triangles, whether the primitive's own indices are a list of them or a strip.
TEST(Compression, dracoIsReadForListsAndStripsOnly) {
  GltfBuilder b = dracoQuad(encodeDraco());
  json& primitive = b.root["meshes"][0]["primitives"][0];
  primitive["mode"] = 5;
  b.root["accessors"][2]["count"] = 4;
  const Result<Scene> strip = b.import();
  ASSERT_TRUE(strip) << strip.error().message;
  EXPECT_EQ(strip->triangleCount(), 2u);
  primitive["mode"] = 6;
  const Result<Scene> fan = b.import();
  ASSERT_FALSE(fan);
  EXPECT_EQ(fan.error().code, ErrorCode::invalidFile);
  EXPECT_NE(
      fan.error().message.find("meshes[0].primitives[0]: mode 6 with KHR_draco_mesh_compression; expected 4 or 5"),
      std::string::npos)
      << fan.error().message;
}

TEST(Compression, whatDracoLeavesOutNeedsDataOfItsOwn) {
  for (const char* left : {"POSITION", "TEXCOORD_0"}) {
    GltfBuilder b = dracoQuad(encodeDraco());
    json& primitive = b.root["meshes"][0]["primitives"][0];
    primitive["extensions"]["KHR_draco_mesh_compression"]["attributes"].erase(left);
    const Result<Scene> scene = b.import();
    ASSERT_FALSE(scene) << left;
    EXPECT_EQ(scene.error().code, ErrorCode::invalidFile);
    EXPECT_NE(scene.error().message.find("meshes[0].primitives[0].attributes." + std::string(left) + ": accessors["),
              std::string::npos)
        << scene.error().message;
    const bool isPosition = left == std::string_view("POSITION");
    const std::vector<float> values = isPosition ? kSquare : std::vector<float>{0, 0, 1, 0, 1, 1, 0, 1};
    primitive["attributes"][left] = b.floats(values, isPosition ? "VEC3" : "VEC2");
    const Result<Scene> mended = b.import();
    EXPECT_TRUE(mended) << mended.error().message;
  }
}

// Encoders merge vertices, and some keep the counts of before.
TEST(Compression, dracoMayHaveLessThanItsAccessorsClaim) {
  GltfBuilder b = dracoQuad(encodeDraco());
  b.root["accessors"][0]["count"] = b.root["accessors"][1]["count"] = 6;
  b.root["accessors"][2]["count"] = 9;
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->meshes[0].position.size(), 4u);
  EXPECT_EQ(scene->triangleCount(), 2u);
}

TEST(Compression, brokenDracoDataIsNamedWhereverItBreaks) {
  const Bytes good = encodeDraco();
  for (std::size_t i = 0; i < good.size(); ++i) {
    Bytes cut(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(i));
    cut.resize(std::max<std::size_t>(cut.size(), 1));
    const Result<Scene> scene = dracoQuad(cut).import();
    ASSERT_FALSE(scene) << i;
    EXPECT_EQ(scene.error().code, ErrorCode::invalidFile);
    EXPECT_NE(scene.error().message.find("meshes[0].primitives[0]: broken Draco data"), std::string::npos)
        << scene.error().message;
  }
}

// Byte of the count of triangles: after "DRACO", version, encoder, method and flags come, for edgebreaker, the
// traversal and the vertices, for sequential the triangles themselves.
TEST(Compression, dracoClaimsAreBoundedBeforeAnythingIsDecoded) {
  for (const bool sequential : {false, true}) {
    const Bytes good = encodeDraco(sequential ? draco::MESH_SEQUENTIAL_ENCODING : draco::MESH_EDGEBREAKER_ENCODING);
    ASSERT_TRUE(dracoQuad(good).import());
    const std::ptrdiff_t triangles = sequential ? 11 : 13, points = 12;
    ASSERT_EQ(good[static_cast<std::size_t>(triangles)], 2);
    ASSERT_EQ(good[static_cast<std::size_t>(points)], 4);
    for (const auto& [at, message] : {std::pair(triangles, "claims 2147483647 triangles, expected at most 2"),
                                      std::pair(points, "claims 2147483647 points, expected at most 4")}) {
      Bytes bomb = good;
      bomb[static_cast<std::size_t>(at)] = 0xFF;
      bomb.insert(bomb.begin() + at + 1, {0xFF, 0xFF, 0xFF, 0x07});
      const Result<Scene> scene = dracoQuad(bomb).import();
      ASSERT_FALSE(scene);
      EXPECT_NE(scene.error().message.find(message), std::string::npos) << scene.error().message;

      // Accessors that claim as much do not help: the stream is too small for that.
      GltfBuilder b = dracoQuad(bomb);
      b.root["accessors"][0]["count"] = b.root["accessors"][1]["count"] = b.root["accessors"][2]["count"] = 4294967292u;
      const Result<Scene> claimed = b.import();
      ASSERT_FALSE(claimed);
      EXPECT_NE(claimed.error().message.find("claims 2147483647 "), std::string::npos) << claimed.error().message;
    }
  }
}

TEST(Compression, dracoAttributesOfManyComponentsAreRefused) {
  Bytes bomb = encodeDraco(draco::MESH_SEQUENTIAL_ENCODING);
  // After the indices (method, six bytes): one decoder of two attributes, each type, data type, components, normalized,
  // id.
  const std::uint8_t attributes[] = {2, 0, 9, 3, 0, 0};
  const auto at = std::search(bomb.begin(), bomb.end(), std::begin(attributes), std::end(attributes));
  ASSERT_NE(at, bomb.end());
  at[3] = 255;
  const Result<Scene> scene = dracoQuad(bomb).import();
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().message.find("claims 1028 bytes a point, expected at most 512"), std::string::npos)
      << scene.error().message;
}

}  // namespace
}  // namespace relume
