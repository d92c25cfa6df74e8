// SPDX-License-Identifier: MIT
// Morph targets (shape keys of editors): nodes are baked in the shape that their weights give them.
#include "relume/bake/provenance.h"
#include "tests/import/expect_near.h"
#include "tests/import/gltf_builder.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>

namespace relume {
namespace {

using namespace relume::testing;

constexpr float kInfinity = std::numeric_limits<float>::infinity();

// What a target adds to the quad's vertices: the first lifts its far edge, the second pushes it along X.
const std::vector<float> kLift = {0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 1}, kPush = {2, 0, 0, 2, 0, 0, 2, 0, 0, 2, 0, 0};

// A quad with both targets and normals; returns its node.
int bendableQuad(GltfBuilder& b, const json& extraOfPrimitive = json::object()) {
  json extra = extraOfPrimitive;
  extra["targets"] = {{{"POSITION", b.floats(kLift, "VEC3")}}, {{"POSITION", b.floats(kPush, "VEC3")}}};
  return b.quad(extra);
}

json& primitiveOf(GltfBuilder& b) { return b.root["meshes"][0]["primitives"][0]; }

long told(const GltfBuilder& b, const std::string& what) {
  return std::count_if(b.messages.begin(), b.messages.end(),
                       [&](const std::string& message) { return message.find(what) != std::string::npos; });
}

std::vector<glm::vec3> positionsOf(const Scene& scene, std::size_t instance = 0) {
  return scene.meshes[scene.instances.at(instance).mesh].position;
}

std::string errorOf(const GltfBuilder& b) {
  const Result<Scene> scene = b.import();
  EXPECT_FALSE(scene);
  return scene ? "" : scene.error().message;
}

TEST(ImportMorph, positionsAreTheBasesWithEachTargetByItsWeight) {
  GltfBuilder b;
  const int quad = bendableQuad(b);
  b.root["meshes"][0]["weights"] = {0.5, -1.0};
  const Result<Scene> ofMesh = b.import();
  ASSERT_TRUE(ofMesh) << ofMesh.error().message;
  EXPECT_EQ(positionsOf(*ofMesh), (std::vector<glm::vec3>{{-2, 0, 0}, {-1, 0, 0}, {-1, 1, 0.5f}, {-2, 1, 0.5f}}));
  EXPECT_TRUE(b.messages.empty()) << b.messages.front();
  // A node's weights stand in for its mesh's.
  b.root["nodes"][quad]["weights"] = {0.0, 1.0};
  const Result<Scene> ofNode = b.import();
  ASSERT_TRUE(ofNode) << ofNode.error().message;
  EXPECT_EQ(positionsOf(*ofNode), (std::vector<glm::vec3>{{2, 0, 0}, {3, 0, 0}, {3, 1, 0}, {2, 1, 0}}));
}

TEST(ImportMorph, weightsOfNoughtLeaveTheSceneAsItWas) {
  const auto hashWith = [](const json& weights, bool targets) {
    GltfBuilder b;
    const int quad = targets ? bendableQuad(b) : b.quad();
    if (!weights.is_null()) b.root["nodes"][quad]["weights"] = weights;
    const Result<Scene> scene = b.import();
    EXPECT_TRUE(scene) << scene.error().message;
    EXPECT_TRUE(b.messages.empty());
    return describeInstances(*scene)[0].contentHash;
  };
  const std::uint64_t plain = hashWith(nullptr, false);
  EXPECT_EQ(hashWith(nullptr, true), plain);
  EXPECT_EQ(hashWith({0.0, -0.0}, true), plain);
  EXPECT_NE(hashWith({0.0, 0.5}, true), plain);
  EXPECT_NE(hashWith({0.0, 0.5}, true), hashWith({0.0, 0.25}, true));
}

TEST(ImportMorph, normalsAreBentAndHaveUnitLength) {
  GltfBuilder b;
  const int quad = bendableQuad(b);
  primitiveOf(b)["attributes"]["NORMAL"] = b.floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  primitiveOf(b)["targets"][0]["NORMAL"] = b.floats({0, -3, 0, 0, -3, 0, 0, 0, -1, 0, 0, 0}, "VEC3");
  b.root["nodes"][quad]["weights"] = {1.0, 0.0};
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  const std::vector<glm::vec3>& normal = scene->meshes[0].normal;
  expectNear(normal[0], glm::normalize(glm::vec3(0, -3, 1)));
  expectNear(normal[3], {0, 0, 1});
  // One that the target takes to nought follows the bent triangles.
  expectNear(normal[2], glm::normalize(glm::vec3(0, -1, 1)));
  EXPECT_EQ(told(b, "1 normals are zero"), 1);
}

TEST(ImportMorph, tangentsOfNormalMapsAreBent) {
  GltfBuilder b;
  const int texture = b.texture(png(1, 1, {128, 128, 255, 255}));
  const int quad = bendableQuad(b, {{"material", b.material({{"normalTexture", {{"index", texture}}}})}});
  primitiveOf(b)["attributes"]["NORMAL"] = b.floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
  primitiveOf(b)["attributes"]["TANGENT"] = b.floats({1, 0, 0, -1, 1, 0, 0, -1, 1, 0, 0, -1, 1, 0, 0, -1}, "VEC4");
  primitiveOf(b)["targets"][0]["TANGENT"] = b.floats({-1, 2, 0, -1, 2, 0, -1, 2, 0, -1, 2, 0}, "VEC3");
  b.root["nodes"][quad]["weights"] = {1.0, 0.0};
  Context context;
  ImportOptions options;
  options.gloss = true;
  const Result<Scene> scene = importGltf(b.write(), context, options);
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->meshes[0].cornerTangent.size(), 6u);
  for (const glm::vec4& tangent : scene->meshes[0].cornerTangent) {
    expectNear(glm::vec3(tangent), {0, 1, 0});
    EXPECT_EQ(tangent.w, -1.0f);
  }
}

// Instancing is kept where shapes are equal, and only there.
TEST(ImportMorph, nodesShareAGeometryWhereTheirWeightsAreEqual) {
  GltfBuilder b;
  const int first = bendableQuad(b);
  b.root["meshes"][0]["primitives"].push_back(primitiveOf(b));
  b.root["meshes"][0]["primitives"][1]["targets"].erase(1);
  const auto meshOf = [&](const Scene& scene, int node, std::uint32_t primitive) {
    const auto found = std::find_if(scene.instances.begin(), scene.instances.end(), [&](const Instance& instance) {
      return instance.nodeIndex == static_cast<std::uint32_t>(node) && instance.primitive == primitive;
    });
    return found == scene.instances.end() ? kNone : found->mesh;
  };
  const int same = b.node({{"mesh", 0}, {"weights", {0.5, 0.0}}}),
            other = b.node({{"mesh", 0}, {"weights", {0.5, 1.0}}}), flat = b.node({{"mesh", 0}});
  b.root["nodes"][first]["weights"] = {0.5, 0.0};
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->meshes.size(), 5u);  // flat, lifted, and the first primitive pushed as well; the second has no push
  for (const std::uint32_t p : {0u, 1u}) {
    EXPECT_EQ(meshOf(*scene, first, p), meshOf(*scene, same, p));
    EXPECT_NE(meshOf(*scene, first, p), meshOf(*scene, flat, p));
  }
  EXPECT_NE(meshOf(*scene, first, 0), meshOf(*scene, other, 0));
  EXPECT_EQ(meshOf(*scene, first, 1), meshOf(*scene, other, 1));
}

TEST(ImportMorph, gpuInstancesShareTheShapeOfTheirNode) {
  GltfBuilder b;
  const int quad = bendableQuad(b);
  b.root["nodes"][quad]["weights"] = {1.0, 0.0};
  b.root["nodes"][quad]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
      b.floats({0, 0, 0, 5, 0, 0, 9, 0, 0}, "VEC3");
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 3u);
  EXPECT_EQ(scene->meshes.size(), 1u);
  expectNear(scene->corners(scene->instances[2], 0)[2], {10, 1, 1});
}

TEST(ImportMorph, sparseAndQuantisedTargetsMeanTheSame) {
  const std::vector<glm::vec3> lifted = {{0, 0, 0}, {1, 0, 0}, {1, 1, 1}, {0, 1, 1}};
  for (const bool sparse : {true, false}) {
    GltfBuilder b;
    const int quad = b.quad();
    int target = 0;
    if (sparse) {
      b.root["accessors"].push_back({{"componentType", 5126}, {"count", 4}, {"type", "VEC3"}});
      target = static_cast<int>(b.root["accessors"].size()) - 1;
      const int at = b.view(std::vector<std::uint16_t>{2, 3}), values = b.view(std::vector<float>{0, 0, 1, 0, 0, 1});
      b.root["accessors"][target]["sparse"] = {{"count", 2},
                                               {"indices", {{"bufferView", at}, {"componentType", 5123}}},
                                               {"values", {{"bufferView", values}}}};
    } else {
      const std::vector<std::int8_t> bytes = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 127, 0, 0, 0, 127, 0};
      target = b.accessor(b.view(bytes, 4), 5120, 4, "VEC3", true);
      b.root["extensionsRequired"] = {"KHR_mesh_quantization"};
    }
    primitiveOf(b)["targets"] = {{{"POSITION", target}}};
    b.root["nodes"][quad]["weights"] = {1.0};
    const Result<Scene> scene = b.import();
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(positionsOf(*scene), lifted) << sparse;
  }
}

// Weights that are not one for each target: the file is wrong, but tells enough.
TEST(ImportMorph, weightsOfAnotherCountAreToldOf) {
  const auto importWith = [](const GltfBuilder& b) {
    const Result<Scene> scene = b.import();
    EXPECT_TRUE(scene) << scene.error().message;
    return positionsOf(*scene)[2];
  };
  GltfBuilder b;
  const int quad = bendableQuad(b);
  b.root["nodes"][quad]["weights"] = {1.0};
  EXPECT_EQ(importWith(b), glm::vec3(1, 1, 1));
  EXPECT_EQ(told(b, "1 weights for 2 morph targets of meshes[0].primitives[0]; targets without one do not bend it"), 1);
  b.root["nodes"][quad]["weights"] = {0.0, 1.0, 7.0};
  EXPECT_EQ(importWith(b), glm::vec3(3, 1, 0));
  EXPECT_EQ(told(b, "3 weights for 2 morph targets of meshes[0].primitives[0]; those beyond are left out"), 1);
  // Of a mesh it is told once, and not where nothing bends.
  b.root["nodes"][quad].erase("weights");
  b.root["meshes"][0]["weights"] = {1.0};
  b.node({{"mesh", 0}});
  importWith(b);
  EXPECT_EQ(told(b, "meshes[0]: 1 weights for 2 morph targets"), 1);
  b.root["meshes"][0]["weights"] = {0.0};
  importWith(b);
  EXPECT_TRUE(b.messages.empty());
}

TEST(ImportMorph, whatCannotBeBentIsNamed) {
  GltfBuilder b;
  const int quad = bendableQuad(b);
  json& weights = b.root["nodes"][quad]["weights"];
  json& target = primitiveOf(b)["targets"][0]["POSITION"];
  const json whole = target;
  const auto expectError = [&](const std::string& what) {
    const std::string error = errorOf(b);
    EXPECT_NE(error.find(what), std::string::npos) << error;
  };
  weights = {1e300, 0.0};
  expectError(".weights[0]: is not finite");
  weights = {"much"};
  expectError("nodes[0].weights[0]: expected a number");
  weights = {1.0, 0.0};
  for (const std::size_t count : {3u, 5u}) {
    target = b.floats(std::vector<float>(3 * count, 0.0f), "VEC3");
    expectError("meshes[0].primitives[0].targets[0].POSITION: " + std::to_string(count) +
                " values, the mesh's POSITION has 4");
  }
  target = 99;
  expectError("accessors[99] does not exist");
  target = b.floats(std::vector<float>(16, 0.0f), "VEC4");
  expectError("has 4 components; expected 3");
  target = "first";
  expectError("meshes[0].primitives[0].targets[0].POSITION: expected a whole number");
  target = b.floats({0, 0, 0, 0, kInfinity, 0, 0, 0, 0, 0, 0, 0}, "VEC3");
  expectError("POSITION of vertex 1, moved by its morph targets, is not finite");
  // A target that does not count is not read.
  weights = {0.0, 1.0};
  EXPECT_TRUE(b.import());
  target = whole;
  weights = {3e38, 3e38};
  primitiveOf(b)["targets"][1]["POSITION"] = whole;
  expectError("POSITION of vertex 2, moved by its morph targets, is not finite");
}

// Few bytes must not ask for much work: targets may share their values.
TEST(ImportMorph, farMoreVerticesToMoveThanBytesAreRefused) {
  GltfBuilder b;
  constexpr std::size_t kVertices = 30000, kTargets = 3000;
  const int many = b.floats(std::vector<float>(3 * kVertices, 0.0f), "VEC3");
  json primitive = {{"attributes", {{"POSITION", many}}}};
  primitive["targets"] = std::vector<json>(kTargets, {{"POSITION", many}});
  b.node({{"mesh", b.mesh(primitive)}, {"weights", std::vector<double>(kTargets, 1.0)}});
  const std::string error = errorOf(b);
  EXPECT_NE(error.find("morph targets move"), std::string::npos) << error;
}

// Animations are no part of a bake: what they bend is baked as the weights have it, which is said once for a mesh.
TEST(ImportMorph, meshesThatAnimationsBendAreToldOf) {
  const auto toldOf = [](const json& target, const json& bake = nullptr, bool targets = true) {
    GltfBuilder b;
    const int quad = targets ? bendableQuad(b) : b.quad();
    const int copy = b.node({{"mesh", 0}});
    b.root["nodes"][copy]["weights"] = {0.0, 1.0};
    for (const int node : {quad, copy}) {
      if (!bake.is_null()) b.root["nodes"][node]["extras"]["relume"]["bake"] = bake;
    }
    b.root["animations"] = {{{"channels", {{{"sampler", 0}, {"target", target}}}}, {"samplers", json::array()}}};
    const Result<Scene> scene = b.import();
    EXPECT_TRUE(scene) << scene.error().message;
    return told(b, "an animation bends its mesh by morph targets");
  };
  const auto pointer = [](const char* text) {
    return json{{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", text}}}}}};
  };
  const json ofNode = {{"node", 0}, {"path", "weights"}};
  EXPECT_EQ(toldOf(ofNode), 1);
  EXPECT_EQ(toldOf(ofNode, "gridLit"), 1);
  EXPECT_EQ(toldOf(pointer("/nodes/1/weights")), 1);
  EXPECT_EQ(toldOf(pointer("/nodes/0/weights/1")), 1);
  EXPECT_EQ(toldOf(pointer("/meshes/0/weights")), 1);
  // What is no part of the bake, is not bent, or is moved otherwise.
  EXPECT_EQ(toldOf(ofNode, "dynamic"), 0);
  EXPECT_EQ(toldOf(ofNode, "ignore"), 0);
  EXPECT_EQ(toldOf(ofNode, nullptr, false), 0);
  EXPECT_EQ(toldOf({{"node", 0}, {"path", "translation"}}), 0);
  EXPECT_EQ(toldOf(pointer("/nodes/0/translation")), 0);
  EXPECT_EQ(toldOf(pointer("/nodes/x/weights")), 0);
  // What no animation is passed over.
  EXPECT_EQ(toldOf("weights"), 0);
  EXPECT_EQ(toldOf(nullptr), 0);
}

}  // namespace
}  // namespace relume
