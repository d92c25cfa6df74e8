// SPDX-License-Identifier: MIT
// Levels in EXT_meshopt_compression and KHR_draco_mesh_compression: what gets coordinates comes out decoded.
#include "tests/export/shared_levels.h"
#include "tests/pipeline/tiny_bake.h"

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

#include <algorithm>

namespace relume {
namespace {

using nlohmann::json;
using test::Exported;
using testing::GltfBuilder;
using Bytes = std::vector<std::uint8_t>;

// A roof of two squares that share an edge of welded vertices, so that charts may part there.
const std::vector<float> kRoof = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 1, -1, 1, 1, -1};
const std::vector<std::uint32_t> kIndices = {0, 1, 2, 0, 2, 3, 3, 2, 5, 3, 5, 4};

void addEye(GltfBuilder& b) {
  b.root["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"znear", 0.1}}}}};
  b.node({{"camera", 0}, {"translation", {0.5, 2.0, 2.0}}});
}

int compressedView(GltfBuilder& b, const Bytes& data, std::size_t count, std::size_t stride, const char* mode) {
  const int raw = b.view(data);
  const json source = b.root["bufferViews"][raw];
  b.root["bufferViews"][raw] = {{"buffer", 1}, {"byteLength", count * stride}};
  b.root["bufferViews"][raw]["extensions"]["EXT_meshopt_compression"] = {{"buffer", 0},
                                                                         {"byteOffset", source["byteOffset"]},
                                                                         {"byteLength", data.size()},
                                                                         {"byteStride", stride},
                                                                         {"count", count},
                                                                         {"mode", mode}};
  return raw;
}

// Bounds that are not those of the decoded positions, as encoders that quantise leave them.
void loosenBounds(json& accessor) { accessor["min"] = {-0.01, 0, -1}, accessor["max"] = {1, 1.01, 0.01}; }

// Positions that were decoded have their own bounds.
void expectBounds(const Exported& e) {
  Context context;
  const auto document = loadGltfDocument(e.path, context);
  ASSERT_TRUE(document) << document.error().message;
  AccessorReader reader(*document);
  std::size_t decoded = 0;
  for (std::size_t i = e.before["accessors"].size(); i < e.after["accessors"].size(); ++i) {
    const json& accessor = e.after["accessors"][i];
    if (!accessor.contains("min")) continue;
    const auto values = reader.floats(static_cast<int>(i), 3, 3, "test");
    ASSERT_TRUE(values) << values.error().message;
    for (std::size_t c = 0; c < 3; ++c) {
      std::vector<float> axis;
      for (std::size_t v = 0; v < (*values)->count; ++v) axis.push_back((*values)->values[3 * v + c]);
      EXPECT_EQ(accessor["min"][c], *std::min_element(axis.begin(), axis.end())) << "accessor " << i;
      EXPECT_EQ(accessor["max"][c], *std::max_element(axis.begin(), axis.end())) << "accessor " << i;
    }
    ++decoded;
  }
  EXPECT_GT(decoded, 0u);
}

TEST(ExportCompressed, meshoptViewsStayAndSplitVerticesAreDecoded) {
  GltfBuilder b;
  Bytes vertices(meshopt_encodeVertexBufferBound(6, 12)), indices(1000);
  vertices.resize(meshopt_encodeVertexBuffer(vertices.data(), vertices.size(), kRoof.data(), 6, 12));
  indices.resize(meshopt_encodeIndexBuffer(indices.data(), indices.size(), kIndices.data(), kIndices.size()));
  const int position = b.accessor(compressedView(b, vertices, 6, 12, "ATTRIBUTES"), 5126, 6, "VEC3");
  loosenBounds(b.root["accessors"][static_cast<std::size_t>(position)]);
  const int index = b.accessor(compressedView(b, indices, 12, 2, "TRIANGLES"), 5123, 12, "SCALAR");
  const int mesh = b.mesh({{"attributes", {{"POSITION", position}}}, {"indices", index}});
  b.node({{"mesh", mesh}});
  b.node({{"mesh", mesh}, {"translation", {0, 0, -5}}, {"extras", {{"relume", {{"bake", "dynamic"}}}}}});
  b.root["extensionsRequired"] = b.root["extensionsUsed"] = {"EXT_meshopt_compression"};
  b.root["buffers"] =
      json::array({{{"byteLength", b.binary.size()}},
                   {{"byteLength", 1000}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}});
  addEye(b);
  const Exported e = test::exportOf(b.write(), test::tinyBakeOptions());
  expectCoordinates(e);
  expectBounds(e);
  test::expectSameSurfaces(e.scene, e.again);
  EXPECT_EQ(e.after["extensionsRequired"], json({"EXT_meshopt_compression"}));
  EXPECT_EQ(e.after["buffers"][1], e.before["buffers"][1]);
  EXPECT_EQ(e.after["meshes"][0], e.before["meshes"][0]);  // the dynamic node's
}

// Numbers of the extension are no accessors: what is split and no longer referred to is cut.
TEST(ExportCompressed, numbersOfMeshoptViewsKeepNothing) {
  for (const char* name : kMeshoptExtensions) {
    GltfBuilder b;
    const int roof = b.mesh({{"attributes", {{"POSITION", b.floats(kRoof, "VEC3")}}},
                             {"indices", b.indices({kIndices.begin(), kIndices.end()})}});
    b.node({{"mesh", roof}});
    Bytes vertices(meshopt_encodeVertexBufferBound(6, 12));
    vertices.resize(meshopt_encodeVertexBuffer(vertices.data(), vertices.size(), kRoof.data(), 6, 12));
    const int view = compressedView(b, vertices, 6, 12, "ATTRIBUTES");
    json& extensions = b.root["bufferViews"][view]["extensions"];
    const json compression = extensions["EXT_meshopt_compression"];
    extensions = {{name, compression}};
    const int mesh =
        b.mesh({{"attributes", {{"POSITION", b.accessor(view, 5126, 6, "VEC3")}}}, {"indices", b.indices({0, 1, 2})}});
    b.node({{"mesh", mesh}, {"translation", {0, 0, -5}}, {"extras", {{"relume", {{"bake", "dynamic"}}}}}});
    b.root["extensionsRequired"] = b.root["extensionsUsed"] = {name};
    b.root["buffers"] = json::array(
        {{{"byteLength", b.binary.size()}}, {{"byteLength", 1000}, {"extensions", {{name, {{"fallback", true}}}}}}});
    addEye(b);
    const Exported e = test::exportOf(b.write(), test::tinyBakeOptions());
    EXPECT_TRUE(test::isHusk(e.after["accessors"][0])) << name << e.after["accessors"][0];
    EXPECT_TRUE(e.after["bufferViews"][view]["extensions"].contains(name));
    test::expectSameSurfaces(e.scene, e.again);
  }
}

TEST(ExportCompressed, dracoPrimitivesAreDecoded) {
  draco::TriangleSoupMeshBuilder builder;
  const auto faces = static_cast<std::uint32_t>(kIndices.size() / 3);
  builder.Start(static_cast<int>(faces));
  const int at = builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  const int tint = builder.AddAttribute(draco::GeometryAttribute::COLOR, 4, draco::DT_UINT8);
  for (std::uint32_t f = 0; f < faces; ++f) {
    const std::uint32_t* v = &kIndices[3 * f];
    builder.SetAttributeValuesForFace(at, draco::FaceIndex(f), &kRoof[3 * v[0]], &kRoof[3 * v[1]], &kRoof[3 * v[2]]);
    std::array<std::array<std::uint8_t, 4>, 3> color{};
    for (std::size_t k = 0; k < 3; ++k)
      color[k] = {static_cast<std::uint8_t>(37 * v[k]), 100, static_cast<std::uint8_t>(255 - v[k]), 255};
    builder.SetAttributeValuesForFace(tint, draco::FaceIndex(f), color[0].data(), color[1].data(), color[2].data());
  }
  const std::unique_ptr<draco::Mesh> mesh = builder.Finalize();
  draco::Encoder encoder;
  draco::EncoderBuffer buffer;
  ASSERT_TRUE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());

  GltfBuilder b;
  const int view = b.view(Bytes(buffer.data(), buffer.data() + buffer.size()));
  b.root["accessors"] = json::array({{{"componentType", 5126}, {"count", 6}, {"type", "VEC3"}},
                                     {{"componentType", 5121}, {"normalized", true}, {"count", 6}, {"type", "VEC4"}},
                                     {{"componentType", 5125}, {"count", 12}, {"type", "SCALAR"}}});
  loosenBounds(b.root["accessors"][0]);
  const json ids = {{"POSITION", 0}, {"COLOR_0", 1}};
  const json primitive = {
      {"attributes", ids},
      {"indices", 2},
      {"extensions", {{"KHR_draco_mesh_compression", {{"bufferView", view}, {"attributes", ids}}}}}};
  const int shared = b.mesh(primitive);
  b.node({{"mesh", shared}});
  // Off the map: the same mesh, one of its own, and one that nobody draws.
  const json dynamic = {{"relume", {{"bake", "dynamic"}}}};
  b.node({{"mesh", shared}, {"translation", {0, 0, -5}}, {"extras", dynamic}});
  b.node({{"mesh", b.mesh(primitive)}, {"translation", {0, 0, -9}}, {"extras", dynamic}});
  b.mesh(primitive);
  b.root["extensionsRequired"] = b.root["extensionsUsed"] = {"KHR_draco_mesh_compression"};
  addEye(b);
  const Exported e = test::exportOf(b.write(), test::tinyBakeOptions());
  expectCoordinates(e);
  expectBounds(e);
  test::expectSameSurfaces(e.scene, e.again);
  EXPECT_FALSE(e.after.contains("extensionsRequired"));
  EXPECT_FALSE(e.after.contains("extensionsUsed"));
  ASSERT_EQ(e.after["meshes"].size(), 4u);
  for (const json& drawn : e.after["meshes"]) {
    const json& decoded = drawn["primitives"][0];
    EXPECT_FALSE(decoded.contains("extensions"));
    const json& color = e.after["accessors"][decoded["attributes"]["COLOR_0"].get<std::size_t>()];
    EXPECT_EQ(color["componentType"], 5121);
    EXPECT_EQ(color["normalized"], true);
  }
  EXPECT_TRUE(test::isHusk(e.after["bufferViews"][static_cast<std::size_t>(view)]));
}

}  // namespace
}  // namespace relume
