// SPDX-License-Identifier: MIT
// Cameras and lights by name: that of the node, which editors show, before that of the camera or light itself.
#include "tools/render/view_options.h"

#include "relume/bake/context.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace relume {
namespace {

template <class Item>
Item withNames(const std::string& name, const std::string& node) {
  Item item;
  item.name = name;
  item.node = node;
  return item;
}

// As Blender has them whose objects are "A" and "B", and whose data have each other's names.
Scene swapped() {
  Scene scene;
  scene.cameras = {withNames<Camera>("B", "A"), withNames<Camera>("A", "B")};
  scene.lights = {withNames<SceneLight>("B", "A"), withNames<SceneLight>("A", "B")};
  return scene;
}

// What a view of the options has, and the warnings that came with it.
View viewOf(const Scene& scene, const ViewOptions& options, std::vector<std::string>& warnings) {
  Context context;
  context.onMessage = [&warnings](Severity severity, std::string_view text) {
    if (severity == Severity::warning) warnings.emplace_back(text);
  };
  View view;
  const Status status = completeView(options, scene, context, view);
  EXPECT_TRUE(status) << status.error().message;
  return view;
}

std::vector<std::string> nodesOf(const std::vector<SceneLight>& lights) {
  std::vector<std::string> nodes;
  for (const SceneLight& light : lights) nodes.push_back(light.node);
  return nodes;
}

using Texts = std::vector<std::string>;

TEST(NamedViews, aNodesNameIsMeantBeforeThatOfACameraOrLight) {
  const Scene scene = swapped();
  for (const char* const name : {"A", "B"}) {
    ViewOptions options;
    options.camera = name;
    options.lights = {name};
    Texts warnings;
    const View view = viewOf(scene, options, warnings);
    EXPECT_EQ(view.camera.node, name);
    EXPECT_EQ(nodesOf(view.lights), Texts{name});
    EXPECT_EQ(warnings, Texts());
  }
}

TEST(NamedViews, aNameOfItsOwnIsMeantWhereNoNodeHasIt) {
  Scene scene = swapped();
  scene.cameras[0].name = scene.lights[0].name = scene.lights[1].name = "data";
  ViewOptions options;
  options.camera = "data";
  options.lights = {"data"};
  Texts warnings;
  const View view = viewOf(scene, options, warnings);
  EXPECT_EQ(view.camera.node, "A");
  EXPECT_EQ(nodesOf(view.lights), (Texts{"A", "B"}));  // one light on two nodes
  options.camera.clear();
  options.lights = {"all"};
  EXPECT_EQ(nodesOf(viewOf(scene, options, warnings).lights), (Texts{"A", "B"}));
  EXPECT_EQ(warnings, Texts());
}

TEST(NamedViews, aNameOfSeveralCamerasIsWarnedOf) {
  Scene scene = swapped();
  scene.cameras.push_back(withNames<Camera>("C", "D"));
  ViewOptions options;
  options.camera = "data";
  scene.cameras[0].name = scene.cameras[1].name = "data";
  Texts warnings;
  EXPECT_EQ(viewOf(scene, options, warnings).camera.node, "A");
  ASSERT_EQ(warnings.size(), 1u);
  for (const char* const words :
       {"--camera: \"data\"", "several cameras", "\"data\" (node \"A\"), \"data\" (node \"B\")"})
    EXPECT_NE(warnings[0].find(words), std::string::npos) << warnings[0];
  EXPECT_EQ(warnings[0].find("\"D\""), std::string::npos) << warnings[0];
}

}  // namespace
}  // namespace relume
