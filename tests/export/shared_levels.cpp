// SPDX-License-Identifier: MIT
// See shared_levels.h.
#include "tests/export/shared_levels.h"

#include "tests/pipeline/tiny_bake.h"

#include <gtest/gtest.h>

#include <utility>

namespace relume::test {

using nlohmann::json;
using testing::GltfBuilder;

BakeOptions someOptions() {
  BakeOptions options = tinyBakeOptions();
  options.caches.lightmapCaches = 400;
  return options;
}

const Exported& twoRooms() {
  static const Exported made = [] {
    BakeOptions options = presetOptions(Preset::draft);
    options.surfels.count = 2000;
    return exportOf(kLevel, options);
  }();
  return made;
}

Box weldedBox(float size, bool inward) {
  Box box;
  for (int v = 0; v < 8; ++v) {
    for (int axis = 0; axis < 3; ++axis) box.position.push_back((v >> axis & 1) ? size : 0.0f);
  }
  const std::uint16_t quads[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4},
                                     {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
  for (const auto& q : quads) {
    const std::uint16_t a = q[0], b = inward ? q[3] : q[1], c = q[2], d = inward ? q[1] : q[3];
    box.index.insert(box.index.end(), {a, b, c, a, c, d});
  }
  return box;
}

GltfBuilder madeLevel() {
  GltfBuilder b;
  b.root["extensionsUsed"] = {"EXT_mesh_gpu_instancing", "VENDOR_weather", "KHR_lights_punctual"};
  b.root["extensions"]["VENDOR_weather"] = {{"rain", 0.1}, {"accessor", 0}};
  b.root["extensions"]["KHR_lights_punctual"]["lights"] = {{{"type", "point"}, {"intensity", 3.25}}};
  b.root["asset"]["extras"] = {{"author", "someone"}, {"relume", {{"lightUnit", "radiometric"}}}};
  b.root["extras"] = {1, "two", nullptr};
  b.material({{"name", "plaster"}, {"doubleSided", true}, {"extras", {{"wet", 0.30000000000000004}}}});

  const Box room = weldedBox(4.0f, true), crate = weldedBox(0.5f, false);
  b.root["meshes"].push_back(
      {{"name", "room"},
       {"primitives",
        {{{"attributes", {{"POSITION", b.floats(room.position, "VEC3")}}}, {"indices", b.indices(room.index)}}}}});
  // A crate with 8-bit colours, joints, an attribute of its own, sparse, and a sparse morph target.
  std::vector<std::uint8_t> colors, joints(32, 0);
  std::vector<float> weights, foo(8, 0.5f), normals;
  for (std::uint8_t v = 0; v < 8; ++v) {
    colors.insert(colors.end(), {static_cast<std::uint8_t>(10 * v), 200, 30, 0});  // three of four bytes are read
    weights.insert(weights.end(), {1, 0, 0, 0});
    for (int axis = 0; axis < 3; ++axis) normals.push_back((v >> axis & 1) ? 0.57735026f : -0.57735026f);
  }
  const int fooAccessor = b.floats(foo, "SCALAR");
  b.root["accessors"][static_cast<std::size_t>(fooAccessor)]["sparse"] = {
      {"count", 2},
      {"indices", {{"bufferView", b.view(std::vector<std::uint8_t>{1, 6})}, {"componentType", 5121}}},
      {"values", {{"bufferView", b.view(std::vector<float>{7.0f, 8.0f})}}}};
  b.root["accessors"].push_back(
      {{"componentType", 5126},
       {"count", 8},
       {"type", "VEC3"},
       {"sparse",
        {{"count", 1},
         {"indices", {{"bufferView", b.view(std::vector<std::uint16_t>{7})}, {"componentType", 5123}}},
         {"values", {{"bufferView", b.view(std::vector<float>{0.1f, 0.2f, 0.3f})}}}}}});
  const int target = static_cast<int>(b.root["accessors"].size()) - 1;
  b.root["meshes"].push_back({{"name", "crate"},
                              {"weights", {0.0}},
                              {"extras", {{"breakable", true}}},
                              {"primitives",
                               {{{"attributes",
                                  {{"POSITION", b.floats(crate.position, "VEC3")},
                                   {"NORMAL", b.floats(normals, "VEC3")},
                                   {"COLOR_0", b.accessor(b.view(colors, 4), 5121, 8, "VEC3", true)},
                                   {"JOINTS_0", b.accessor(b.view(joints), 5121, 8, "VEC4")},
                                   {"WEIGHTS_0", b.floats(weights, "VEC4")},
                                   {"_FOO", fooAccessor}}},
                                 {"targets", {{{"POSITION", target}}}},
                                 {"material", 0},
                                 {"indices", b.indices(crate.index)},
                                 {"extensions", {{"VENDOR_paint", {{"layers", 3}}}}}}}}});
  // A step as a strip, welded over its edge, one of its triangles without area.
  b.root["meshes"].push_back(
      {{"name", "step"},
       {"primitives",
        {{{"mode", 5},
          {"attributes", {{"POSITION", b.floats({1, 0, 0, 2, 0, 0, 1, 1, 0, 2, 1, 0, 1, 1, -1, 2, 1, -1}, "VEC3")}}},
          {"indices", b.indices({0, 1, 2, 3, 3, 4, 5})}}}}});
  const auto node = [&](const char* name, int mesh, json translation) {
    return b.node({{"name", name}, {"mesh", mesh}, {"translation", std::move(translation)}});
  };
  node("room", 0, {0, 0, 0});
  node("crate_a", 1, {0.5, 0.0, 0.5});
  const int mirrored = node("crate_b", 1, {3.0, 0.0, 0.5});
  b.root["nodes"][static_cast<std::size_t>(mirrored)]["scale"] = {-1, 1, 1};
  node("step", 2, {0, 0, 2});
  const int rows = node("rows", 1, {0.25, 0, 2.5});
  json& instanced = b.root["nodes"][static_cast<std::size_t>(rows)];
  instanced["weights"] = {0.25};
  instanced["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", b.floats({0, 0, 0, 1, 0.1f, 0, 2.3f, 0, 0}, "VEC3")},
      {"ROTATION",
       b.accessor(b.view(std::vector<std::int8_t>{0, 0, 0, 127, 0, 90, 0, 90, 0, 0, 0, 127}), 5120, 3, "VEC4", true)},
      {"_ID", b.accessor(b.view(std::vector<std::uint32_t>{4000000001, 4000000002, 4000000003}), 5125, 3, "SCALAR")},
      {"_WIND", b.floats({1, 0.5f, 2, 0.5f, 3, 0.5f}, "VEC2")},
      {"_AGE", b.accessor(b.view(std::vector<std::uint8_t>{0, 0, 0, 0, 51, 0, 0, 0, 255, 0, 0, 0}, 4), 5121, 3,
                          "SCALAR", true)}};
  const int lamp =
      b.node({{"name", "lamp"}, {"translation", {2, 3, 2}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  b.root["nodes"].push_back({{"name", "rows_child"}, {"translation", {0, 1, 0}}});
  instanced["children"] = {lamp + 1};
  b.root["cameras"] = {{{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"znear", 0.1}}}}};
  b.node({{"name", "eye"}, {"camera", 0}, {"translation", {2, 2, 3.5}}});
  // What moves: the crate with a skin, and the weights of the rows.
  const int joint = b.node({{"name", "joint"}});
  b.root["skins"] = {{{"joints", {joint}}}};
  const int walker = b.node({{"name", "walker"}, {"mesh", 1}, {"skin", 0}});
  const int times = b.floats({0, 1}, "SCALAR"), places = b.floats({0, 0, 0, 1, 0, 0}, "VEC3"),
            morph = b.floats({0, 1}, "SCALAR");
  b.root["animations"] = {
      {{"samplers", {{{"input", times}, {"output", places}}, {{"input", times}, {"output", morph}}}},
       {"channels",
        {{{"sampler", 0}, {"target", {{"node", walker}, {"path", "translation"}}}},
         {{"sampler", 1}, {"target", {{"node", rows}, {"path", "weights"}}}}}}}};
  return b;
}

const json& nodeNamed(const json& root, const std::string& name) {
  for (const json& node : root["nodes"]) {
    if (node.value("name", "") == name) return node;
  }
  ADD_FAILURE() << "no node " << name;
  return root["nodes"][0];
}

bool isHusk(const json& element) {
  return element.contains("componentType") ? element["count"] == 1 && !element.contains("bufferView")
                                           : element["byteLength"] == 4 && !element.contains("byteOffset");
}

}  // namespace relume::test
