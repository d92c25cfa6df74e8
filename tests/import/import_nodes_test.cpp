// SPDX-License-Identifier: MIT
// The node graph: transforms, scenes, cameras, lights, play volumes, bake modes, visibility.
#include "tests/import/expect_near.h"
#include "tests/import/gltf_builder.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

using namespace relume::testing;

constexpr float kSqrtHalf = 0.70710678f;

glm::vec3 origin(const glm::mat4& m) { return glm::vec3(m[3]); }

TEST(ImportNodes, childrenInheritTheirParentsTransforms) {
  GltfBuilder b;
  const int quad = b.quad();
  b.root["nodes"][quad]["translation"] = {1, 0, 0};
  b.root["scenes"][0]["nodes"] = json::array();
  b.node({{"children", {quad}}, {"translation", {0, 10, 0}}, {"scale", {2, 2, 2}}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 1u);
  expectNear(origin(scene->instances[0].toWorld), {2, 10, 0});
  expectNear(scene->corners(scene->instances[0], 0)[1], {4, 10, 0});
}

TEST(ImportNodes, matrixAndTranslationRotationScaleAgree) {
  GltfBuilder b;
  const int quad = b.quad();
  b.root["nodes"][quad]["translation"] = {1, 2, 3};
  b.root["nodes"][quad]["rotation"] = {0, kSqrtHalf, 0, kSqrtHalf};  // a quarter turn about Y: X to -Z
  b.root["nodes"][quad]["scale"] = {2, 3, 4};
  b.node({{"mesh", 0}, {"matrix", {0, 0, -2, 0, 0, 3, 0, 0, 4, 0, 0, 0, 1, 2, 3, 1}}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  for (int c = 0; c < 4; ++c)
    expectNear(glm::vec3(scene->instances[0].toWorld[c]), glm::vec3(scene->instances[1].toWorld[c]));
}

TEST(ImportNodes, mirroredNodesKeepTheirFrontsOutside) {
  GltfBuilder b;
  const int quad = b.quad();
  b.root["nodes"][quad]["scale"] = {-1, 1, 1};
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_TRUE(scene->instances[0].flipped);
  expectNear(geometricNormal(*scene, {0, 0, {0.2f, 0.2f}}), {0, 0, 1});
  const auto c = scene->corners(scene->instances[0], 0);
  expectNear(glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0])), {0, 0, 1});
}

TEST(ImportNodes, defaultSceneIsTheOneNamed) {
  GltfBuilder b;
  b.quad();
  const int second = b.quad();
  b.root["scenes"] = json::array({{{"nodes", {0}}}, {{"nodes", {second}}}});
  b.root["scene"] = 1;
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 1u);
  EXPECT_EQ(scene->instances[0].nodeIndex, static_cast<std::uint32_t>(second));
  EXPECT_EQ(scene->instances[0].node, "unnamed node 0");
  EXPECT_EQ(b.messages, (std::vector<std::string>{"test.glb: scenes[1] is read, and the others are left out: 1; the "
                                                  "file's \"scene\" says which it is"}));
}

TEST(ImportNodes, firstSceneIsTakenWhenNoneIsNamed) {
  GltfBuilder b;
  b.quad();
  b.quad();
  b.root["scenes"] = json::array({{{"nodes", {1}}}, {{"nodes", {0}}}});
  b.root.erase("scene");
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->instances.at(0).nodeIndex, 1u);
}

TEST(ImportNodes, withoutScenesEveryRootIsTaken) {
  GltfBuilder b;
  const int child = b.quad();
  b.quad();
  b.node({{"children", {child}}});
  b.root.erase("scene");
  b.root.erase("scenes");
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 2u);
  EXPECT_EQ(scene->instances[0].nodeIndex, 1u);  // roots in order: node 1, then node 2 with its child
  EXPECT_EQ(scene->instances[1].nodeIndex, 0u);
}

TEST(ImportNodes, aChainOfAHundredThousandNodesIsWalked) {
  GltfBuilder b;
  b.quad();
  b.root["scenes"][0]["nodes"] = {1};
  const int depth = 100000;
  for (int i = 1; i <= depth; ++i)
    b.root["nodes"].push_back({{"children", {i == depth ? 0 : i + 1}}, {"translation", {0.5, 0, 0}}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_FLOAT_EQ(origin(scene->instances.at(0).toWorld).x, 0.5f * depth);
}

TEST(ImportNodes, trianglesAreNumberedThroughAllInstances) {
  GltfBuilder b;
  b.quad();
  b.quad();
  b.node({{"mesh", 0}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->triangleCount(), 6u);
  EXPECT_EQ(scene->meshes.size(), 2u);  // a mesh on two nodes is stored once
  for (std::uint32_t t = 0; t < 6; ++t) EXPECT_EQ(scene->instanceOf(t), t / 2);
}

TEST(ImportNodes, perspectiveAndOrthographicCamerasComeWithTheirNodes) {
  GltfBuilder b;
  b.root["cameras"] = json::array(
      {{{"name", "eye"},
        {"type", "perspective"},
        {"perspective", {{"yfov", 0.8}, {"znear", 0.05}, {"aspectRatio", 1.5}}}},
       {{"type", "orthographic"}, {"orthographic", {{"xmag", 4}, {"ymag", 2}, {"znear", 0}, {"zfar", 9}}}}});
  b.node({{"camera", 0}, {"name", "tripod"}, {"translation", {1, 2, 3}}, {"scale", {-2, 3, 5}}});
  b.node({{"camera", 1}, {"name", "plan"}, {"rotation", {-kSqrtHalf, 0, 0, kSqrtHalf}}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->cameras.size(), 2u);
  const Camera& eye = scene->cameras[0];
  EXPECT_EQ(eye.name, "eye");
  EXPECT_TRUE(isCalled(eye, "eye") && isCalled(eye, "tripod"));
  EXPECT_FALSE(isCalled(eye, "plan") || isCalled(eye, ""));
  EXPECT_FLOAT_EQ(eye.yfovRad, 0.8f);
  EXPECT_FLOAT_EQ(eye.aspect, 1.5f);
  expectNear(origin(eye.toWorld), {1, 2, 3});
  expectNear(glm::vec3(eye.toWorld[2]), {0, 0, 1});  // scale and mirroring do not reach the view
  expectNear(glm::cross(glm::vec3(eye.toWorld[0]), glm::vec3(eye.toWorld[1])), glm::vec3(eye.toWorld[2]));
  const Camera& plan = scene->cameras[1];
  EXPECT_EQ(plan.name, "plan");
  EXPECT_TRUE(plan.orthographic);
  EXPECT_FLOAT_EQ(plan.yMag, 2.0f);
  EXPECT_FLOAT_EQ(plan.aspect, 2.0f);
  expectNear(-glm::vec3(plan.toWorld[2]), {0, -1, 0});
}

json withLight(GltfBuilder& b, const json& light) {
  b.root["extensionsUsed"] = {"KHR_lights_punctual"};
  b.root["extensions"]["KHR_lights_punctual"]["lights"].push_back(light);
  const std::size_t index = b.root["extensions"]["KHR_lights_punctual"]["lights"].size() - 1;
  return {{"extensions", {{"KHR_lights_punctual", {{"light", index}}}}}};
}

TEST(ImportNodes, lightsHaveTheExtensionsDefaults) {
  GltfBuilder b;
  json node = withLight(b, {{"type", "spot"}, {"spot", json::object()}});
  node["name"] = "lamp";
  b.node(node);
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  const SceneLight& light = scene->lights.at(0);
  EXPECT_EQ(light.name, "lamp");
  EXPECT_EQ(light.kind, LightKind::spot);
  expectNear(light.intensity, {1, 1, 1});
  expectNear(light.direction, {0, 0, -1});
  EXPECT_EQ(light.range, 0.0f);
  EXPECT_EQ(light.innerConeRad, 0.0f);
  EXPECT_FLOAT_EQ(light.outerConeRad, 0.785398163f);
}

TEST(ImportNodes, intensityIsColourTimesIntensityAndEqualConesAreTolerated) {
  GltfBuilder b;
  json node = withLight(b, {{"type", "spot"},
                            {"name", "s"},
                            {"color", {1, 0.5, 0.25}},
                            {"intensity", 8},
                            {"range", 3},
                            {"spot", {{"innerConeAngle", 0.4}, {"outerConeAngle", 0.4}}}});
  node["translation"] = {5, 6, 7};
  b.node(node);
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  expectNear(scene->lights.at(0).intensity, {8, 4, 2});
  expectNear(scene->lights.at(0).positionWorld, {5, 6, 7});
  EXPECT_FLOAT_EQ(scene->lights.at(0).range, 3.0f);
  EXPECT_EQ(scene->lights.at(0).innerConeRad, scene->lights.at(0).outerConeRad);
}

TEST(ImportNodes, aLightsOwnScaleDoesNotTurnItButAMirroredParentMirrorsIt) {
  GltfBuilder b;
  json node = withLight(b, {{"type", "directional"}});
  node["rotation"] = {0, kSqrtHalf, 0, kSqrtHalf};  // -Z turns to -X
  node["scale"] = {3, 3, -2};
  b.node(node);
  json inside = node;
  inside.erase("scale");
  b.root["nodes"].push_back(inside);
  b.node({{"children", {1}}, {"scale", {-1, 1, 1}}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  expectNear(scene->lights.at(0).direction, {-1, 0, 0});
  expectNear(scene->lights.at(1).direction, {1, 0, 0});
}

std::size_t countMessages(const GltfBuilder& b, const char* text) {
  return static_cast<std::size_t>(std::count_if(
      b.messages.begin(), b.messages.end(), [&](const std::string& m) { return m.find(text) != std::string::npos; }));
}

TEST(ImportNodes, hiddenNodesAndThoseBelowHaveNoMeshesAndLights) {
  GltfBuilder b;
  b.root["extensionsRequired"] = {"KHR_node_visibility"};
  b.root["cameras"] = json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 0.05}}}}});
  const int shown = b.quad(), saysNothing = b.quad(), below = b.quad(), instanced = b.quad(), skinned = b.quad();
  const json lamp = withLight(b, {{"type", "point"}}), hiddenLamp = withLight(b, {{"type", "point"}});
  b.node(lamp);
  const int lampBelow = b.node(hiddenLamp);
  const int camera = b.node({{"camera", 0}, {"extras", {{"relume", {{"volume", {1, 1, 1}}}}}}});
  json& nodes = b.root["nodes"];
  nodes[shown]["extensions"]["KHR_node_visibility"]["visible"] = true;
  nodes[saysNothing]["extensions"]["KHR_node_visibility"] = json::object();
  nodes[below]["extensions"]["KHR_node_visibility"]["visible"] = true;  // the node above has the last word
  nodes[instanced]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]["TRANSLATION"] =
      b.floats({1, 0, 0, 0, 2, 0}, "VEC3");
  nodes[skinned]["skin"] = 0;
  b.root["scenes"][0]["nodes"] = {shown, saysNothing, lampBelow - 1};
  b.node({{"children", {below, instanced, skinned, lampBelow, camera}},
          {"extensions", {{"KHR_node_visibility", {{"visible", false}}}}}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 2u);
  EXPECT_EQ(scene->instances[0].nodeIndex, static_cast<std::uint32_t>(shown));
  EXPECT_EQ(scene->instances[1].nodeIndex, static_cast<std::uint32_t>(saysNothing));
  EXPECT_EQ(scene->lights.size(), 1u);
  EXPECT_EQ(scene->cameras.size(), 1u);
  EXPECT_EQ(scene->volumes.size(), 1u);
  EXPECT_EQ(countMessages(b, "that KHR_node_visibility hides: 4, the first nodes[2] 'node2'"), 1u);
  EXPECT_EQ(b.messages.size(), 1u);
}

TEST(ImportNodes, whatAnAnimationShowsAndHidesIsTakenAsTheFileHasIt) {
  GltfBuilder b;
  const int door = b.quad(), fog = b.quad(), moved = b.quad();
  json& nodes = b.root["nodes"];
  nodes[fog]["extensions"]["KHR_node_visibility"]["visible"] = false;
  nodes[moved]["extras"]["relume"]["bake"] = "dynamic";
  b.root["animations"][0]["channels"] = json::array();
  for (const int node : {door, fog, moved}) {
    json target = {{"path", "pointer"}};
    target["extensions"]["KHR_animation_pointer"]["pointer"] =
        "/nodes/" + std::to_string(node) + "/extensions/KHR_node_visibility/visible";
    b.root["animations"][0]["channels"].push_back({{"sampler", 0}, {"target", target}});
  }
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->instances.size(), 2u);
  EXPECT_EQ(countMessages(b, "an animation shows and hides"), 2u);
  EXPECT_EQ(countMessages(b,
                          "nodes[0] 'node0': an animation shows and hides it and what is below, which bakes do not "
                          "know: as the file shows it, it is baked; mark the node"),
            1u);
  EXPECT_EQ(countMessages(b,
                          "nodes[1] 'node1': an animation shows and hides it and what is below, which bakes do not "
                          "know: as the file hides it, it is left out; mark the node"),
            1u);
}

json moving(int node, const char* path) { return {{"sampler", 0}, {"target", {{"node", node}, {"path", path}}}}; }

TEST(ImportNodes, whatAnAnimationMovesIsBakedWhereTheFilePutsIt) {
  const auto told = [](const json& extrasOfDoor, const json& extrasOfLeaf) {
    GltfBuilder b;
    const int leaf = b.quad(), skinned = b.quad(), lift = b.quad(), hook = b.quad(), still = b.quad();
    json& nodes = b.root["nodes"];
    nodes[leaf]["extras"] = extrasOfLeaf;
    nodes[skinned]["skin"] = 0;
    nodes[hook]["extras"]["relume"]["bake"] = "gridLit";
    b.root["scenes"][0]["nodes"] = {skinned, lift, hook, still};
    const int door = b.node({{"name", "door"}, {"children", {leaf}}, {"extras", extrasOfDoor}});
    const int joint = b.node({{"name", "joint"}});
    json pointer = {{"path", "pointer"}};
    pointer["extensions"]["KHR_animation_pointer"]["pointer"] = "/nodes/" + std::to_string(lift) + "/translation";
    b.root["animations"][0]["channels"] = {moving(door, "rotation"),  moving(joint, "scale"),
                                           moving(skinned, "scale"),  {{"sampler", 0}, {"target", pointer}},
                                           moving(hook, "rotation"),  moving(hook, "translation"),
                                           moving(still, "weights"),  moving(-7, "translation"),
                                           moving(99, "translation"), {{"sampler", 0}, {"target", {{"node", 0}}}}};
    const Result<Scene> scene = b.import();
    EXPECT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(countMessages(b, "animations move nodes"), 1u);
    for (const std::string& message : b.messages) {
      const std::size_t at = message.find("where the file puts them: ");
      if (at != std::string::npos) return message.substr(at + 26, message.find(';') - at - 26);
    }
    return std::string();
  };
  const json plain = json::object(), dynamic = {{"relume", {{"bake", "dynamic"}}}},
             ignored = {{"relume", {{"bake", "ignore"}}}}, baked = {{"relume", {{"bake", "static"}}}};
  EXPECT_EQ(told(plain, plain), "3, the first nodes[2] 'node2'");
  EXPECT_EQ(told(dynamic, plain), "2, the first nodes[2] 'node2'");
  EXPECT_EQ(told(plain, ignored), "2, the first nodes[2] 'node2'");
  EXPECT_EQ(told(dynamic, baked), "3, the first nodes[2] 'node2'");
}

TEST(ImportNodes, whereAnAnimationFliesACameraReceiversAreNotLookedFor) {
  for (const json& extras : {json::object(), json{{"playSpace", false}}, json{{"volume", {1, 1, 1}}}}) {
    GltfBuilder b;
    b.root["cameras"] = json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 0.05}}}}});
    b.node({{"camera", 0}, {"name", "eye"}, {"extras", {{"relume", extras}}}});
    b.root["scenes"][0]["nodes"] = json::array();
    const int dolly = b.node({{"children", {0}}});
    b.root["animations"][0]["channels"] = json::array({moving(dolly, "translation")});
    ASSERT_TRUE(b.import());
    EXPECT_EQ(countMessages(b,
                            "animations move cameras, about which receivers are looked for only where the file "
                            "puts them, the first \"eye\""),
              extras.empty() ? 1u : 0u)
        << extras;
    EXPECT_EQ(countMessages(b, "animations move nodes"), 0u);
  }
}

TEST(ImportNodes, extrasSetBakeModeDensityAndVolumes) {
  GltfBuilder b;
  const int quad = b.quad();
  const int dynamicQuad = b.quad();
  const int ignored = b.quad();
  const int gridLit = b.quad();
  b.root["nodes"][quad]["extras"]["relume"] = {{"bake", "static"}, {"texelDensity", 4.0}};
  b.root["nodes"][dynamicQuad]["extras"]["relume"] = {{"bake", "dynamic"}};
  b.root["nodes"][ignored]["extras"]["relume"] = {{"bake", "ignore"}};
  b.root["nodes"][gridLit]["extras"]["relume"] = {{"bake", "gridLit"}};
  b.node({{"name", "hall"}, {"translation", {1, 0, 0}}, {"extras", {{"relume", {{"volume", {2, 4, 6}}}}}}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 3u);
  EXPECT_EQ(scene->instances[2].mode, BakeMode::gridLit);
  EXPECT_EQ(scene->instances[0].mode, BakeMode::fixed);
  EXPECT_FLOAT_EQ(scene->instances[0].texelDensity, 4.0f);
  EXPECT_EQ(scene->instances[1].mode, BakeMode::dynamic);
  EXPECT_FLOAT_EQ(scene->instances[1].texelDensity, 1.0f);
  ASSERT_EQ(scene->volumes.size(), 1u);
  EXPECT_EQ(scene->volumes[0].name, "hall");
  expectNear(glm::vec3(scene->volumes[0].toWorld * glm::vec4(0.5f, 0.5f, 0.5f, 1.0f)), {2, 2, 3});
}

TEST(ImportNodes, extrasThatNobodyReadsAreWarnedOfOnce) {
  GltfBuilder b;
  for (int i = 0; i < 3; ++i)
    b.root["nodes"][b.quad()]["extras"]["relume"] = {{"bake", "dynamic"}, {"texelDensty", 4.0}};
  const int material = b.material({{"extras", {{"relume", {{"drivable", true}, {"driveable", true}}}}}});
  b.quad({{"material", material}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->instances[0].mode, BakeMode::dynamic);
  EXPECT_EQ(countMessages(b, "extras.relume.texelDensty: nothing is known by this name"), 1u);
  EXPECT_EQ(countMessages(b, "known here: bake, playSpace, texelDensity, volume"), 1u);
  EXPECT_EQ(countMessages(b, "extras.relume.driveable: nothing is known by this name"), 1u);
  EXPECT_EQ(countMessages(b, "nothing is known by this name"), 2u);
}

TEST(ImportNodes, bakeModeHoldsForWhatIsBelow) {
  GltfBuilder b;
  const int quad = b.quad();
  const int back = b.quad();
  b.root["nodes"][back]["extras"]["relume"]["bake"] = "static";
  b.root["scenes"][0]["nodes"] = json::array();
  b.node({{"children", {quad, back}}, {"extras", {{"relume", {{"bake", "dynamic"}}}}}});
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->instances.at(0).mode, BakeMode::dynamic);
  EXPECT_EQ(scene->instances.at(1).mode, BakeMode::fixed);
}

TEST(ImportNodes, gpuInstancesAreInstances) {
  GltfBuilder b;
  const int quad = b.quad();
  b.root["nodes"][quad]["translation"] = {100, 0, 0};
  b.root["nodes"][quad]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", b.floats({1, 0, 0, 0, 2, 0}, "VEC3")},
      {"ROTATION", b.floats({0, 0, 0, 1, 0, 0, kSqrtHalf, kSqrtHalf}, "VEC4")},
      {"SCALE", b.floats({1, 1, 1, 3, -3, 3}, "VEC3")}};
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 2u);
  EXPECT_EQ(scene->instances[1].gpuInstance, 1u);
  EXPECT_EQ(scene->instances[1].firstTriangle, 2u);
  expectNear(origin(scene->instances[0].toWorld), {101, 0, 0});
  expectNear(origin(scene->instances[1].toWorld), {100, 2, 0});
  expectNear(glm::vec3(scene->instances[1].toWorld * glm::vec4(1, 0, 0, 0)), {0, 3, 0});
  EXPECT_FALSE(scene->instances[0].flipped);
  EXPECT_TRUE(scene->instances[1].flipped);
}

TEST(ImportNodes, attributesOfTheGamesOwnSayHowManyGpuInstancesThereAre) {
  GltfBuilder b;
  const int quad = b.quad();
  json& attributes = b.root["nodes"][quad]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
  attributes = {{"_ID", b.floats({7, 8, 9}, "SCALAR")}};
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 3u);
  EXPECT_EQ(scene->instances[2].gpuInstance, 2u);
  EXPECT_EQ(scene->instances[2].toWorld, glm::mat4(1.0f));
  // As many as the accessor says, which must exist and be in proportion.
  const auto refused = [&](const json& broken) {
    attributes = broken;
    const Result<Scene> read = b.import();
    return read ? "" : read.error().message;
  };
  EXPECT_NE(refused({{"_ID", 99}}).find("_ID: accessors[99] does not exist"), std::string::npos);
  EXPECT_NE(refused(json::object()).find("has no attributes"), std::string::npos);
  b.root["accessors"].push_back({{"componentType", 5126}, {"count", 1 << 30}, {"type", "SCALAR"}});
  EXPECT_NE(refused({{"_ID", b.root["accessors"].size() - 1}}).find("elements without data"), std::string::npos);
}

TEST(ImportNodes, aFileWithoutMeshesIsAnEmptyScene) {
  GltfBuilder b;
  const Result<Scene> scene = b.import();
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->triangleCount(), 0u);
}

}  // namespace
}  // namespace relume
