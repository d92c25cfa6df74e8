// SPDX-License-Identifier: MIT
// Malformed documents: each is refused with a code and a message that names the place.
#include "bake/base/memory_budget.h"
#include "tests/import/gltf_builder.h"

#include <gtest/gtest.h>

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <limits>

namespace relume {
namespace {

using namespace relume::testing;

struct Case {
  const char* name;
  void (*breakIt)(GltfBuilder&);
  ErrorCode code;
  const char* message;
};

class Malformed : public ::testing::TestWithParam<Case> {};

// A quad with texture, camera and light, to be broken in one place.
GltfBuilder wholeFile() {
  GltfBuilder b;
  const int texture = b.texture(png(1, 1, {1, 2, 3, 255}), {{"wrapS", 10497}});
  b.quad({{"material", b.material({{"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}})}});
  b.root["cameras"] = json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}}});
  b.root["extensions"]["KHR_lights_punctual"]["lights"] = json::array({{{"type", "point"}}});
  b.node({{"name", "eye"}, {"camera", 0}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  return b;
}

json& accessor(GltfBuilder& b, int i) { return b.root["accessors"][static_cast<std::size_t>(i)]; }
json& bufferView(GltfBuilder& b, int i) { return b.root["bufferViews"][static_cast<std::size_t>(i)]; }
json& node(GltfBuilder& b, int i) { return b.root["nodes"][static_cast<std::size_t>(i)]; }
json& primitive(GltfBuilder& b) { return b.root["meshes"][0]["primitives"][0]; }

// Accessor 0 holds positions (view 1), 1 texture coordinates (view 2), 2 indices (view 3); view 0 the image.
const Case kCases[] = {
    {"accessorCountOfTwoToThe31", [](GltfBuilder& b) { accessor(b, 0)["count"] = 2147483648u; }, ErrorCode::invalidFile,
     "accessors[0]: 2147483648 elements"},
    {"accessorCountBeyondAllRange", [](GltfBuilder& b) { accessor(b, 0)["count"] = 1e18; }, ErrorCode::invalidFile,
     "accessors[0].count: expected a whole number"},
    {"accessorCountNegative", [](GltfBuilder& b) { accessor(b, 0)["count"] = -1; }, ErrorCode::invalidFile,
     "accessors[0].count: expected a whole number"},
    {"zerosOfTwoToThe31",
     [](GltfBuilder& b) {
       accessor(b, 0).erase("bufferView");
       accessor(b, 0)["count"] = 2147483647;
     },
     ErrorCode::invalidFile, "accessors[0]: claims 2147483647 elements without data"},
    {"accessorOffsetOut", [](GltfBuilder& b) { accessor(b, 0)["byteOffset"] = 4; }, ErrorCode::invalidFile,
     "accessors[0]: 4 elements of 12 bytes"},
    {"accessorOffsetHuge", [](GltfBuilder& b) { accessor(b, 0)["byteOffset"] = 281474976710000ull; },
     ErrorCode::invalidFile, "accessors[0]"},
    {"accessorViewMissing", [](GltfBuilder& b) { accessor(b, 0)["bufferView"] = 4; }, ErrorCode::invalidFile,
     "bufferViews[4] does not exist"},
    {"accessorType", [](GltfBuilder& b) { accessor(b, 0)["type"] = "VEC5"; }, ErrorCode::invalidFile, "VEC5"},
    {"accessorComponentType", [](GltfBuilder& b) { accessor(b, 0)["componentType"] = 5127; }, ErrorCode::invalidFile,
     "omponentType"},
    {"positionsOfTwoComponents", [](GltfBuilder& b) { primitive(b)["attributes"]["POSITION"] = 1; },
     ErrorCode::invalidFile, "POSITION: accessors[1] has 2 components"},
    {"attributeCountsDiffer", [](GltfBuilder& b) { accessor(b, 1)["count"] = 3; }, ErrorCode::invalidFile,
     "TEXCOORD_0: 3 values, POSITION has 4"},
    {"attributeAccessorMissing", [](GltfBuilder& b) { primitive(b)["attributes"]["POSITION"] = 77; },
     ErrorCode::invalidFile, "accessors[77] does not exist, there are 3"},
    {"indexOutOfRange", [](GltfBuilder& b) { b.binary[bufferView(b, 3)["byteOffset"].get<std::size_t>() + 4] = 9; },
     ErrorCode::invalidFile, "meshes[0].primitives[0]: triangle 0 uses vertex 9 of 4"},
    {"indicesAreFloats", [](GltfBuilder& b) { primitive(b)["indices"] = 1; }, ErrorCode::invalidFile,
     "accessors[1] is not a scalar of 8, 16 or 32-bit unsigned integers"},
    {"indicesNotWholeTriangles", [](GltfBuilder& b) { accessor(b, 2)["count"] = 5; }, ErrorCode::invalidFile,
     "5 vertices are not whole triangles"},
    {"positionNotFinite",
     [](GltfBuilder& b) {
       const float inf = std::numeric_limits<float>::infinity();
       std::memcpy(&b.binary[bufferView(b, 1)["byteOffset"].get<std::size_t>()], &inf, 4);
     },
     ErrorCode::invalidFile, "meshes[0].primitives[0]: POSITION of vertex 0 is not finite"},
    {"positionNaN",
     [](GltfBuilder& b) {
       const float nan = std::numeric_limits<float>::quiet_NaN();
       std::memcpy(&b.binary[bufferView(b, 1)["byteOffset"].get<std::size_t>() + 16], &nan, 4);
     },
     ErrorCode::invalidFile, "POSITION of vertex 1 is not finite"},
    {"strideBelowElement", [](GltfBuilder& b) { bufferView(b, 1)["byteStride"] = 8; }, ErrorCode::invalidFile,
     "byteStride 8 is less than the 12 bytes"},
    {"strideOdd", [](GltfBuilder& b) { bufferView(b, 1)["byteStride"] = 13; }, ErrorCode::invalidFile, "13"},
    {"viewBeyondBuffer", [](GltfBuilder& b) { bufferView(b, 3)["byteLength"] = 1 << 30; }, ErrorCode::invalidFile,
     "bufferViews[3]: bytes"},
    {"viewOffsetOverflows", [](GltfBuilder& b) { bufferView(b, 3)["byteOffset"] = 281474976710650ull; },
     ErrorCode::invalidFile, "bufferViews[3]: bytes"},
    {"viewOfMissingBuffer", [](GltfBuilder& b) { bufferView(b, 3)["buffer"] = 5; }, ErrorCode::invalidFile,
     "bufferViews[3]: buffers[5] does not exist, there are 1"},
    {"bufferLongerThanData",
     [](GltfBuilder& b) {
       b.root["buffers"] = json::array({{{"byteLength", 4000000000u}}});
     },
     ErrorCode::invalidFile, "buffers[0]: byteLength is 4000000000, its data has"},
    {"bufferWithoutData",
     [](GltfBuilder& b) {
       b.root["buffers"] = json::array({{{"byteLength", b.binary.size()}}, {{"byteLength", 400}}});
       bufferView(b, 1)["buffer"] = 1;
     },
     ErrorCode::invalidFile, "buffers[1], which has 0"},
    {"sparseIndexOut",
     [](GltfBuilder& b) {
       const std::vector<std::uint8_t> at = {4};
       const std::vector<float> values = {1, 2, 3};
       const int indices = b.view(at), v = b.view(values);
       accessor(b, 0)["sparse"] = {{"count", 1},
                                   {"indices", {{"bufferView", indices}, {"componentType", 5121}}},
                                   {"values", {{"bufferView", v}}}};
     },
     ErrorCode::invalidFile, "accessors[0].sparse.indices: element 4 of 4"},
    {"sparseValuesOut",
     [](GltfBuilder& b) {
       accessor(b, 0)["sparse"] = {{"count", 2000000000},
                                   {"indices", {{"bufferView", 3}, {"componentType", 5121}}},
                                   {"values", {{"bufferView", 1}}}};
     },
     ErrorCode::invalidFile, "accessors[0].sparse.indices: 2000000000 elements"},
    {"meshMissing", [](GltfBuilder& b) { node(b, 0)["mesh"] = 3; }, ErrorCode::invalidFile, "meshes[3] does not exist"},
    {"materialMissing", [](GltfBuilder& b) { primitive(b)["material"] = 2; }, ErrorCode::invalidFile,
     "materials[2] does not exist, there are 1"},
    {"modeUnknown", [](GltfBuilder& b) { primitive(b)["mode"] = 666; }, ErrorCode::invalidFile, "mode 666"},
    {"textureMissing",
     [](GltfBuilder& b) { b.root["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = 9; },
     ErrorCode::invalidFile, "textures[9] does not exist"},
    {"imageMissingInTexture", [](GltfBuilder& b) { b.root["textures"][0]["source"] = 9; }, ErrorCode::invalidFile,
     "textures[0]: images[9] does not exist"},
    {"samplerMissing", [](GltfBuilder& b) { b.root["textures"][0]["sampler"] = 9; }, ErrorCode::invalidFile,
     "textures[0]: samplers[9] does not exist"},
    {"textureOfAnotherFormat",
     [](GltfBuilder& b) {
       b.root["textures"][0] = {{"extensions", {{"KHR_texture_basisu", {{"source", 0}}}}}};
     },
     ErrorCode::unsupported,
     "only one for KHR_texture_basisu; convert its images by gltf-transform ktxdecompress IN OUT"},
    {"imagesOfAnotherFormatRequired", [](GltfBuilder& b) { b.root["extensionsRequired"] = {"EXT_texture_webp"}; },
     ErrorCode::unsupported,
     "requires the extension EXT_texture_webp, which is not supported; convert its images by gltf-transform png"},
    {"imagesOfGamesRequired", [](GltfBuilder& b) { b.root["extensionsRequired"] = {"MSFT_texture_dds"}; },
     ErrorCode::unsupported, "which is not supported; export the level with PNG or JPEG images"},
    {"visibilityIsANumber", [](GltfBuilder& b) { node(b, 0)["extensions"]["KHR_node_visibility"]["visible"] = 0; },
     ErrorCode::invalidFile, "nodes[0].extensions.KHR_node_visibility.visible: expected true or false, found 0"},
    {"cycle",
     [](GltfBuilder& b) {
       node(b, 0)["children"] = {1};
       node(b, 1)["children"] = {0};
     },
     ErrorCode::invalidFile, "is its own ancestor"},
    {"selfCycle", [](GltfBuilder& b) { node(b, 1)["children"] = {1}; }, ErrorCode::invalidFile,
     "nodes[1] 'eye': is its own ancestor"},
    {"twoParents",
     [](GltfBuilder& b) {
       b.node({{"children", {1}}});
       b.node({{"children", {1}}});
     },
     ErrorCode::invalidFile, "nodes[1] 'eye': has two parents"},
    {"childMissing", [](GltfBuilder& b) { node(b, 1)["children"] = {44}; }, ErrorCode::invalidFile,
     "child nodes[44] does not exist"},
    {"sceneListsANodeTwice",
     [](GltfBuilder& b) {
       b.root["scenes"][0]["nodes"] = {0, 0};
     },
     ErrorCode::invalidFile, "scenes[0]: nodes[0] 'node0' is listed twice"},
    {"sceneListsANodeBesideItsParent", [](GltfBuilder& b) { node(b, 1)["children"] = {0}; }, ErrorCode::invalidFile,
     "scenes[0]: nodes[0] 'node0' is listed, and a node above it is, too"},
    {"sceneMissing", [](GltfBuilder& b) { b.root["scene"] = 1; }, ErrorCode::invalidFile, "scenes[1] does not exist"},
    {"transformOverflows",
     [](GltfBuilder& b) {
       node(b, 0)["scale"] = {1e300, 1, 1};
     },
     ErrorCode::invalidFile, "nodes[0] 'node0': its transform to the world is not finite"},
    {"cameraMissing", [](GltfBuilder& b) { node(b, 1)["camera"] = 6; }, ErrorCode::invalidFile,
     "cameras[6] does not exist"},
    {"cameraOutOfRange", [](GltfBuilder& b) { b.root["cameras"][0]["perspective"]["yfov"] = -1; },
     ErrorCode::invalidFile, "cameras[0]: its lens"},
    {"lightMissing", [](GltfBuilder& b) { node(b, 1)["extensions"]["KHR_lights_punctual"]["light"] = 8; },
     ErrorCode::invalidFile, "lights[8] does not exist"},
    {"lightTypeUnknown",
     [](GltfBuilder& b) { b.root["extensions"]["KHR_lights_punctual"]["lights"][0]["type"] = "area"; },
     ErrorCode::invalidFile, "type 'area'"},
    {"lightNegative",
     [](GltfBuilder& b) { b.root["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = -2; },
     ErrorCode::invalidFile, "lights[0]: intensity"},
    {"coneInsideOut",
     [](GltfBuilder& b) {
       b.root["extensions"]["KHR_lights_punctual"]["lights"][0] = {
           {"type", "spot"}, {"spot", {{"innerConeAngle", 0.5}, {"outerConeAngle", 0.4}}}};
     },
     ErrorCode::invalidFile, "cone angles"},
    {"spotWithoutCone",
     [](GltfBuilder& b) {
       b.root["extensions"]["KHR_lights_punctual"]["lights"] = json::array({{{"type", "point"}}, {{"type", "spot"}}});
     },
     ErrorCode::invalidFile, "lights[1]: a spot light without \"spot\""},
    {"instancingCountsDiffer",
     [](GltfBuilder& b) {
       node(b, 0)["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
           {"TRANSLATION", b.floats({1, 2, 3}, "VEC3")}, {"SCALE", b.floats({1, 2, 3, 4, 5, 6}, "VEC3")}};
     },
     ErrorCode::invalidFile, "EXT_mesh_gpu_instancing: SCALE has 2 values"},
    {"extrasBakeUnknown", [](GltfBuilder& b) { node(b, 0)["extras"]["relume"]["bake"] = "maybe"; },
     ErrorCode::invalidFile, "nodes[0] 'node0'.extras.relume.bake: 'maybe'"},
    {"extrasVolumeFlat",
     [](GltfBuilder& b) {
       node(b, 0)["extras"]["relume"]["volume"] = {1, 0, 1};
     },
     ErrorCode::invalidFile, "extras.relume.volume"},
    {"extrasDensity", [](GltfBuilder& b) { node(b, 0)["extras"]["relume"]["texelDensity"] = 1000; },
     ErrorCode::invalidFile, "extras.relume.texelDensity"},
    {"extensionRequired", [](GltfBuilder& b) { b.root["extensionsRequired"] = {"VENDOR_thing"}; },
     ErrorCode::unsupported, "requires the extension VENDOR_thing"},
    {"versionOne", [](GltfBuilder& b) { b.root["asset"]["version"] = "1.0"; }, ErrorCode::unsupported,
     "glTF version 1.0"},
    {"versionNeeded", [](GltfBuilder& b) { b.root["asset"]["minVersion"] = "2.1"; }, ErrorCode::unsupported, "2.1"},
    {"assetMissing", [](GltfBuilder& b) { b.root.erase("asset"); }, ErrorCode::invalidFile, "asset: missing"},
    {"wrongTypeDeepInside",
     [](GltfBuilder& b) {
       node(b, 0)["translation"] = {1, "2", 3};
     },
     ErrorCode::invalidFile, "nodes[0].translation[1]: expected a number, found \"2\""},
    {"wrongLength",
     [](GltfBuilder& b) {
       node(b, 0)["matrix"] = {1, 2, 3};
     },
     ErrorCode::invalidFile, "nodes[0].matrix: expected 16 numbers"},
    {"wrongKind", [](GltfBuilder& b) { b.root["nodes"] = "none"; }, ErrorCode::invalidFile,
     "nodes: expected an array, found \"none\""},
};

TEST_P(Malformed, isRefusedByName) {
  GltfBuilder b = wholeFile();
  GetParam().breakIt(b);
  const Result<Scene> scene = b.import();
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, GetParam().code) << scene.error().message;
  EXPECT_NE(scene.error().message.find(GetParam().message), std::string::npos) << scene.error().message;
  EXPECT_EQ(scene.error().message.find("test.glb"), 0u) << scene.error().message;
}

INSTANTIATE_TEST_SUITE_P(Document, Malformed, ::testing::ValuesIn(kCases),
                         [](const auto& tested) { return std::string(tested.param.name); });

// Bytes of address space that this process has.
rlim_t addressSpace() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

// Import every case with hardly more memory than there is already: a case that takes its claims for true ends as "out
// of memory" in place of its own message.
[[noreturn]] void importAllWithin(std::uint64_t bytes) {
  ::mallopt(M_ARENA_MAX, 1);
  (void)wholeFile().import();  // what is set up once
  const rlimit limit{addressSpace() + bytes, addressSpace() + bytes};
  ::setrlimit(RLIMIT_AS, &limit);
  int failed = 0;
  for (const Case& tested : kCases) {
    GltfBuilder b = wholeFile();
    b.threads = 1;
    tested.breakIt(b);
    const Result<Scene> scene = b.import();
    if (scene || scene.error().message.find(tested.message) == std::string::npos) {
      std::fprintf(stderr, "%s: %s\n", tested.name, scene ? "imported" : scene.error().message.c_str());
      ++failed;
    }
  }
  std::_Exit(failed == 0 ? 0 : 1);
}

TEST(Malformed, claimsAllocateNothing) {
  if (std::string(RELUME_SANITIZE) != "")
    GTEST_SKIP() << "built with " RELUME_SANITIZE ", which needs terabytes of addresses";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(importAllWithin(16u << 20), ::testing::ExitedWithCode(0), "");
}

TEST(Malformed, theWholeFileIsGood) {
  const Result<Scene> scene = wholeFile().import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->triangleCount(), 2u);
  EXPECT_EQ(scene->cameras.size(), 1u);
  EXPECT_EQ(scene->lights.size(), 1u);
}

TEST(Malformed, sharedIndicesDoNotMultiplyWithoutBound) {
  GltfBuilder b;
  std::vector<std::uint16_t> indices(60000, 0);
  const int position = b.floats({0, 0, 0, 1, 0, 0, 1, 1, 0}, "VEC3");
  const json p = {{"attributes", {{"POSITION", position}}}, {"indices", b.indices(indices)}};
  const int mesh = b.mesh(p);
  for (int i = 0; i < 2000; ++i) b.root["meshes"][static_cast<std::size_t>(mesh)]["primitives"].push_back(p);
  b.node({{"mesh", mesh}});
  const Result<Scene> scene = b.import();
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().message.find("triangles in"), std::string::npos) << scene.error().message;
}

// A mesh whose primitives each have positions of their own over the same bytes.
GltfBuilder overlappingPositions(std::size_t vertices, std::size_t primitives, bool distinct) {
  GltfBuilder b;
  std::vector<float> positions(3 * vertices, 0.0f);
  positions[3] = positions[7] = 1.0f;
  const int view = b.view(positions), indices = b.indices({0, 1, 2});
  json list = json::array();
  for (std::size_t i = 0; i < primitives; ++i) {
    const int position = b.accessor(view, 5126, vertices - (distinct ? i : 0), "VEC3");
    list.push_back({{"attributes", {{"POSITION", position}}}, {"indices", indices}});
  }
  b.root["meshes"].push_back({{"primitives", list}});
  b.node({{"mesh", 0}});
  return b;
}

TEST(Malformed, overlappingAccessorsDoNotMultiplyWithoutBound) {
  const Result<Scene> scene = overlappingPositions(100000, 200, true).import();
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().message.find("numbers in"), std::string::npos) << scene.error().message;
}

TEST(Malformed, equalAccessorsAreReadOnce) {
  const Result<Scene> scene = overlappingPositions(100000, 200, false).import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->triangleCount(), 200u);
}

TEST(Malformed, sharedGpuInstancesDoNotMultiplyWithoutBound) {
  GltfBuilder b;
  b.root["nodes"][static_cast<std::size_t>(b.quad())].erase("mesh");
  b.root["accessors"].push_back({{"componentType", 5126}, {"count", 65536}, {"type", "VEC3"}});
  const auto zeros = b.root["accessors"].size() - 1;
  for (int i = 0; i < 20; ++i)
    b.node({{"mesh", 0}, {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", zeros}}}}}}}});
  const Result<Scene> scene = b.import();
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().message.find("instances in"), std::string::npos) << scene.error().message;
}

// Primitives without indices may share all their vertices: each is a mesh of its own.
TEST(Malformed, meshesAskTheMemoryBudget) {
  GltfBuilder b;
  const int position = b.floats(std::vector<float>(9u * 100000u, 0.0f), "VEC3");
  json list = json::array();
  for (int i = 0; i < 60; ++i) list.push_back({{"attributes", {{"POSITION", position}}}});
  b.root["meshes"].push_back({{"primitives", list}});
  b.node({{"mesh", 0}});
  const std::filesystem::path path = b.write();
  Context context;
  context.maxMemory = heldMemory() + (std::uint64_t{128} << 20);
  const Result<Scene> scene = importGltf(path, context);
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, ErrorCode::failed);
  EXPECT_NE(scene.error().message.find("for a mesh of 100000 triangles"), std::string::npos) << scene.error().message;
}

// The tree of 20,000 nodes takes tens of mebibytes; long strings take little more than their text.
TEST(Malformed, jsonAsksTheMemoryBudget) {
  for (const bool nodes : {true, false}) {
    GltfBuilder b;
    b.quad();
    for (int i = 0; nodes && i < 20'000; ++i) b.node({{"name", "part"}, {"translation", {0.5, 0.25, i}}});
    if (!nodes) b.root["extras"]["note"] = std::string(std::size_t{4} << 20, 'x');
    const std::filesystem::path path = b.write();
    Context context;
    context.maxMemory = heldMemory() + ((nodes ? std::uint64_t{12} : std::uint64_t{48}) << 20);
    const Result<Scene> scene = importGltf(path, context);
    ASSERT_EQ(static_cast<bool>(scene), !nodes);
    if (scene) continue;
    EXPECT_EQ(scene.error().code, ErrorCode::failed);
    for (const char* words : {"test.glb: import needs about", "bytes of JSON;", "--max-memory"})
      EXPECT_NE(scene.error().message.find(words), std::string::npos) << scene.error().message;
  }
}

}  // namespace
}  // namespace relume
