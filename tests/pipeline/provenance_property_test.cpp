// SPDX-License-Identifier: MIT
// What status says against what a bake gives: some twenty levels, each field of each file changed in turn. Where status
// calls a bake up to date with the changed level, baking that level gives the same bytes.
#include "relume/bake/provenance.h"
#include "tests/long_tests.h"
#include "tests/pipeline/provenance_level.h"
#include "tools/compare/staleness.h"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace relume {
namespace {

using relume::testing::GltfBuilder;
using test::Baked;
using test::bakeLevel;
using test::makeBase;
using test::sameButCameras;
using test::tinyOptions;
using Json = nlohmann::json;

struct Level {
  const char* name;
  void (*make)(GltfBuilder&);
  friend std::ostream& operator<<(std::ostream& out, const Level& level) { return out << level.name; }
};

Json& nodeOf(GltfBuilder& b, std::size_t i) { return b.root["nodes"][i]; }

const Level kLevels[] = {
    {"base", [](GltfBuilder&) {}},
    {"plain", [](GltfBuilder& b) { b.root["materials"][0].erase("pbrMetallicRoughness"); }},
    {"masked", [](GltfBuilder& b) { b.root["materials"][0]["alphaMode"] = "MASK"; }},
    {"blended", [](GltfBuilder& b) { b.root["materials"][1]["alphaMode"] = "BLEND"; }},
    {"glossiness",
     [](GltfBuilder& b) {
       b.root["materials"][0]["extensions"] = {
           {"KHR_materials_pbrSpecularGlossiness",
            {{"diffuseFactor", {0.5, 0.6, 0.7, 1.0}}, {"diffuseTexture", {{"index", 0}}}}}};
     }},
    {"unnamed",
     [](GltfBuilder& b) {
       for (const char* list : {"nodes", "materials"}) {
         for (Json& item : b.root[list]) item.erase("name");
       }
     }},
    {"sameNames", [](GltfBuilder& b) { nodeOf(b, 1)["name"] = "Floor"; }},
    {"nested",
     [](GltfBuilder& b) {
       nodeOf(b, 0)["children"] = {1};
       b.root["scenes"][0]["nodes"] = {0, 2, 3};
     }},
    {"matrix",
     [](GltfBuilder& b) {
       for (const char* key : {"translation", "rotation", "scale"}) nodeOf(b, 1).erase(key);
       nodeOf(b, 1)["matrix"] = {2, 0, 0, 0, 0, 0, 1, 0, 0, -2, 0, 0, 1, 2, 1, 1};
     }},
    {"mirrored",
     [](GltfBuilder& b) {
       nodeOf(b, 1)["scale"] = {-2, 1, 2};
     }},
    {"dynamic",
     [](GltfBuilder& b) {
       nodeOf(b, 1)["extras"] = {{"relume", {{"bake", "dynamic"}}}};
     }},
    {"ignored",
     [](GltfBuilder& b) {
       nodeOf(b, 1)["extras"] = {{"relume", {{"bake", "ignore"}}}};
     }},
    {"volume",
     [](GltfBuilder& b) {
       b.node({{"name", "Play"}, {"translation", {2, 1, 2}}, {"extras", {{"relume", {{"volume", {2, 1, 2}}}}}}});
     }},
    {"orthographic",
     [](GltfBuilder& b) {
       b.root["cameras"][0] = {{"type", "orthographic"},
                               {"orthographic", {{"xmag", 2.0}, {"ymag", 1.0}, {"zfar", 50.0}, {"znear", 0.1}}}};
     }},
    {"noCamera",
     [](GltfBuilder& b) {
       nodeOf(b, 2).erase("camera");
       b.root.erase("cameras");
     }},
    {"watched",
     [](GltfBuilder& b) {
       b.node({{"name", "Eye 2"}, {"camera", 0}, {"extras", {{"relume", {{"playSpace", false}}}}}});
     }},
    {"twoCameras",
     [](GltfBuilder& b) {
       b.node({{"name", "Eye 2"}, {"camera", 0}, {"translation", {1, 2, 3}}});
     }},
    {"twoPrimitives",
     [](GltfBuilder& b) { b.root["meshes"][0]["primitives"].push_back(b.root["meshes"][1]["primitives"][0]); }},
    {"sharedMesh",
     [](GltfBuilder& b) {
       b.node({{"name", "Screen 2"}, {"mesh", 1}, {"translation", {0, 2, 0}}});
     }},
    {"instanced",
     [](GltfBuilder& b) {
       const int places = b.floats({0, 0, 0, 0.5f, 0.5f, 0.5f, 1, 1, 0}, "VEC3");
       nodeOf(b, 1)["extensions"] = {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", places}}}}}};
     }},
    {"twoScenes",
     [](GltfBuilder& b) {
       b.root["scenes"].push_back({{"nodes", {0, 2}}});
       b.root["scene"] = 1;
     }},
    {"flat",
     [](GltfBuilder& b) {
       for (Json& mesh : b.root["meshes"]) mesh["primitives"][0]["attributes"].erase("NORMAL");
     }},
};

// Every way to change one place of a JSON document a little: other values, keys and elements taken out or swapped.
void collectEdits(const Json& at, const Json::json_pointer& path, std::vector<std::pair<std::string, Json>>& edits) {
  const auto edit = [&](const Json& patch) { edits.emplace_back(patch.dump(), patch); };
  const auto replace = [&](const Json& value) {
    edit({{{"op", "replace"}, {"path", path.to_string()}, {"value", value}}});
  };
  if (at.is_object() || at.is_array()) {
    if (at.is_array() && at.size() > 1 && !at[0].is_number()) {
      Json swapped = at;
      std::swap(swapped[0], swapped[1]);
      replace(swapped);
    }
    for (const auto& [key, value] : at.items()) {
      const Json::json_pointer below = at.is_array() ? path / static_cast<std::size_t>(std::stoul(key)) : path / key;
      if (at.is_object()) edit({{{"op", "remove"}, {"path", below.to_string()}}});
      collectEdits(value, below, edits);
    }
  } else if (at.is_boolean()) {
    replace(!at.get<bool>());
  } else if (at.is_number_integer()) {
    for (const int step : {-1, 1}) replace(at.get<int>() + step);
  } else if (at.is_number()) {
    replace(at.get<double>() + 0.125);
    replace(-at.get<double>());
  } else if (at.is_string()) {
    replace(at.get<std::string>() + "x");
    if (at == "MASK" || at == "BLEND") replace("OPAQUE");
    if (at == "dynamic" || at == "ignore") replace("static");
  }
}

// Put an item before all others of a list and let every reference to the list follow.
Json withItemFirst(Json root, const char* list, const Json& item) {
  static const std::map<std::string, std::set<std::string>> kReferences = {
      {"nodes", {"nodes", "children"}}, {"meshes", {"mesh"}}, {"materials", {"material"}}};
  const std::set<std::string>& keys = kReferences.at(list);
  const std::function<void(Json&)> shift = [&](Json& at) {
    if (!at.is_structured()) return;
    for (const auto& [key, value] : at.items()) {
      if (at.is_object() && keys.contains(key) && value.is_number_integer()) {
        value = value.get<int>() + 1;
      } else if (at.is_object() && keys.contains(key) && value.is_array() && !value.empty() &&
                 value[0].is_number_integer()) {
        for (Json& index : value) index = index.get<int>() + 1;
      } else {
        shift(value);
      }
    }
  };
  shift(root);
  root[list].insert(root[list].begin(), item);
  return root;
}

class ProvenanceProperty : public ::testing::TestWithParam<Level> {
 protected:
  void SetUp() override {
    base_ = makeBase();
    GetParam().make(base_);
    const Result<Scene> scene = base_.import();
    ASSERT_TRUE(scene) << scene.error().message;
    baked_ = bakeLevel(*scene);
    ASSERT_TRUE(baked_);
  }

  // Whether status calls the bake up to date with a changed level; when it does, the level must bake to the same bytes.
  bool upToDate(const GltfBuilder& level, const std::string& what) {
    const Result<Scene> scene = level.import();
    if (!scene) return false;
    ++read_;
    const BakeOptions options = tinyOptions();
    const Staleness stale = findStaleness(*scene, &options, baked_->bake);
    if (!stale.upToDate()) return false;
    // Noise that is forgiven: the exact hash tells it from nothing at all.
    if (hashScene(*scene, describeInstances(*scene)) != baked_->bake.provenance.sceneHash) return ++forgiven_, true;
    const std::optional<Baked> again = bakeLevel(*scene);
    EXPECT_TRUE(again && (stale.notes.empty() ? again->bytes == baked_->bytes : sameButCameras(baked_->bake, *again)))
        << "status says up to date, the bytes are others: " << what;
    return true;
  }

  GltfBuilder base_;
  std::optional<Baked> baked_;
  int read_ = 0, forgiven_ = 0;
};

TEST_P(ProvenanceProperty, upToDateMeansTheSameBytes) {
  const bool all = test::longTests();
  std::vector<std::pair<std::string, Json>> edits;
  for (const char* list :
       {"nodes", "meshes", "materials", "textures", "samplers", "cameras", "scenes", "extensions", "scene", "images"}) {
    if (base_.root.contains(list)) collectEdits(base_.root[list], Json::json_pointer("/" + std::string(list)), edits);
  }
  // Without the long tests every seventh edit, others for each level.
  const std::size_t stride = all ? 1 : 7, first = all ? 0 : std::hash<std::string>{}(GetParam().name) % stride;
  int same = 0;
  for (std::size_t i = first; i < edits.size(); i += stride) {
    GltfBuilder changed = base_;
    changed.root = base_.root.patch(edits[i].second);
    same += upToDate(changed, edits[i].first);
  }
  EXPECT_EQ(forgiven_, 0) << "no edit of the document is noise";
  EXPECT_GT(read_, 0);
  EXPECT_LT(same, read_) << "nothing at all was noticed";
}

TEST_P(ProvenanceProperty, bytesOfEveryAttributeCount) {
  // One byte in every so many of the buffer, its high bits changed.
  const std::size_t stride = test::longTests() ? 13 : 131;
  for (std::size_t i = 3; i < base_.binary.size(); i += stride) {
    GltfBuilder changed = base_;
    changed.binary[i] ^= 0x11;
    upToDate(changed, "byte " + std::to_string(i));
  }
  EXPECT_GT(read_, 0);
  EXPECT_LT(2 * forgiven_, read_) << "only the lowest bytes of positions and normals may count as noise";
}

TEST_P(ProvenanceProperty, emptyNodesInFrontChangeNothing) {
  for (const Json& node : {Json{{"name", "Empty"}}, Json::object()}) {
    GltfBuilder changed = base_;
    changed.root = withItemFirst(base_.root, "nodes", node);
    EXPECT_TRUE(upToDate(changed, "an empty node in front"));
    changed.root["scenes"][0]["nodes"].insert(changed.root["scenes"][0]["nodes"].begin(), 0);
    EXPECT_TRUE(upToDate(changed, "an empty node in front, in the scene"));
  }
  for (const char* list : {"meshes", "materials"}) {
    GltfBuilder changed = base_;
    changed.root = withItemFirst(base_.root, list, base_.root[list][0]);
    upToDate(changed, std::string("an unused item in front of ") + list);
  }
}

INSTANTIATE_TEST_SUITE_P(, ProvenanceProperty, ::testing::ValuesIn(kLevels),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace relume
