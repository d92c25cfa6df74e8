// SPDX-License-Identifier: MIT
// --move-node on levels of files: what is below a node goes with it, and no part goes where no file may have one.
#include "tools/render/move_nodes.h"
#include "tests/import/gltf_builder.h"

#include <gtest/gtest.h>

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include <string>
#include <vector>

namespace relume {
namespace {

using testing::GltfBuilder;
using testing::json;

// A cart without a mesh of its own, with a crate, its lid, a torch, a camera and a play volume; beside it another
// crate, a lamp and a lamp that is hidden. The cart has been moved by so much.
GltfBuilder cart(const glm::vec3& by) {
  GltfBuilder b;
  const int crate = b.quad(), lid = b.quad(), torch = 2, eye = 3, hidden = 4;
  const json light = {{"KHR_lights_punctual", {{"light", 0}}}};
  b.root["nodes"][0].update({{"name", "crate"}, {"children", {lid, torch}}, {"rotation", {0, 0.6, 0, 0.8}}});
  b.root["nodes"][1].update({{"translation", {0, 1, 0}}, {"extras", {{"relume", {{"bake", "dynamic"}}}}}});
  b.root["nodes"].push_back({{"name", "torch"}, {"translation", {0.5, 2, 0}}, {"extensions", light}});
  b.root["nodes"].push_back({{"name", "eye"},
                             {"camera", 0},
                             {"extras", {{"relume", {{"volume", {1, 2, 3}}}}}},
                             {"translation", {0, 1.5, 0}}});
  b.root["nodes"].push_back(
      {{"name", "off"},
       {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}, {"KHR_node_visibility", {{"visible", false}}}}}});
  b.root["scenes"][0]["nodes"] = {hidden};
  b.node({{"name", "lamp"}, {"translation", {0, 9, 0}}, {"extensions", light}});
  b.node({{"name", "cart"}, {"children", {crate, eye}}, {"translation", {2 + by.x, by.y, by.z}}});
  b.node({{"name", "plan"}, {"camera", 0}, {"translation", {0, 20, 0}}});
  b.node({{"name", "shelf"}, {"mesh", 0}, {"translation", {0, 0, 5}}});
  b.root["cameras"] = json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", 0.05}}}}});
  b.root["extensions"]["KHR_lights_punctual"]["lights"] = json::array({{{"type", "point"}}});
  return b;
}

Scene sceneOf(const GltfBuilder& b) {
  const Result<Scene> scene = b.import();
  EXPECT_TRUE(scene) << scene.error().message;
  return scene ? *scene : Scene{};
}

Status moved(const std::vector<std::string>& moves, Scene& scene, MovedParts parts = MovedParts::all) {
  return moveNodes(moves, parts, scene);
}

void expectRefused(const Status& refused, const std::vector<std::string>& words) {
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::usage);
  for (const std::string& word : words)
    EXPECT_NE(refused.error().message.find(word), std::string::npos) << refused.error().message;
}

void expectNear(const glm::mat4& a, const glm::mat4& b, const std::string& what) {
  for (int c = 0; c < 4; ++c) {
    for (int r = 0; r < 3; ++r) EXPECT_NEAR(a[c][r], b[c][r], 1e-6f) << what;
  }
}

TEST(MoveNodes, givesTheLevelThatAnEditorWouldHaveMadeOfIt) {
  const Scene there = sceneOf(cart({0.5f, 0.25f, -1}));
  Scene scene = sceneOf(cart({0, 0, 0}));
  ASSERT_TRUE(moved({"cart=0.5,0.25,-1"}, scene));
  ASSERT_EQ(scene.instances.size(), 3u);
  ASSERT_EQ(scene.lights.size(), 2u);
  ASSERT_EQ(scene.cameras.size(), 2u);
  ASSERT_EQ(scene.volumes.size(), 1u);
  for (std::size_t i = 0; i < 3; ++i)
    expectNear(scene.instances[i].toWorld, there.instances[i].toWorld, scene.instances[i].node);
  for (std::size_t i = 0; i < 2; ++i) {
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(scene.lights[i].positionWorld[k], there.lights[i].positionWorld[k], 1e-6f) << scene.lights[i].node;
    expectNear(scene.cameras[i].toWorld, there.cameras[i].toWorld, scene.cameras[i].node);
  }
  expectNear(scene.volumes[0].toWorld, there.volumes[0].toWorld, "volume");
}

TEST(MoveNodes, movesOnceWhereNodesOfOneNameAreNested) {
  GltfBuilder b;
  const int lid = b.quad(), crate = b.quad();
  b.root["nodes"][0]["name"] = "crate";
  b.root["nodes"][1].update({{"name", "crate"}, {"children", {lid}}});
  b.root["scenes"][0]["nodes"] = {crate};
  Scene scene = sceneOf(b);
  ASSERT_TRUE(moved({"crate=1,2,3"}, scene));
  ASSERT_EQ(scene.instances.size(), 2u);
  for (const Instance& instance : scene.instances) EXPECT_EQ(glm::vec3(instance.toWorld[3]), glm::vec3(1, 2, 3));
}

// One move after the other, as an editor would: of what is below both, both. A node without a name is moved by the one
// that the level has for it.
TEST(MoveNodes, movesANodeAndWhatItIsBelow) {
  Scene scene = sceneOf(cart({0, 0, 0}));
  const glm::vec3 before(scene.instances[1].toWorld[3]);
  ASSERT_EQ(scene.instances[1].node, "unnamed node 0");
  ASSERT_TRUE(moved({"unnamed node 0=1,0,0", "crate=0,0,4"}, scene, MovedParts::all));
  EXPECT_EQ(glm::vec3(scene.instances[1].toWorld[3]), before + glm::vec3(1, 0, 4));
}

TEST(MoveNodes, leavesWhatIsPartOfABake) {
  Scene scene = sceneOf(cart({0, 0, 0}));
  expectRefused(moved({"cart=1,0,0"}, scene, MovedParts::dynamic), {"\"crate\", below \"cart\"", "part of the bake"});
  EXPECT_TRUE(moved({"unnamed node 0=1,0,0", "torch=1,0,0", "eye=0,1,0"}, scene, MovedParts::dynamic));
}

TEST(MoveNodes, namesTheNodesThatThereAre) {
  Scene scene = sceneOf(cart({0, 0, 0}));
  expectRefused(moved({"cat=1,0,0"}, scene),
                {"no node \"cat\"", R"("cart", "crate", "eye", "lamp", "plan", "shelf", "torch", "unnamed node 0")"});
  expectRefused(moved({"off=1,0,0"}, scene), {"no node \"off\""});
}

TEST(MoveNodes, keepsALevelWithinTheBoundsOfAFile) {
  for (const std::string node : {"shelf", "cart"}) {
    Scene scene = sceneOf(cart({0, 0, 0}));
    const std::string move = node + "=1e8,0,0";
    expectRefused(moved({move, move}, scene),
                  {"--move-node: ", node == "cart" ? "'crate': its transform" : "'shelf': its transform", "2e+08",
                   "within 1e+08 m"});
  }
  Scene scene = sceneOf(cart({0, 0, 0}));
  expectRefused(moved({"torch=0,1e8,0", "torch=0,1e8,0"}, scene), {"light 'torch' is at", "within 1e+08 m"});
}

}  // namespace
}  // namespace relume
