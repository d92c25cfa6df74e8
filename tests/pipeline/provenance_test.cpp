// SPDX-License-Identifier: MIT
// What status says against what a bake gives: some twenty levels, each field of each file changed in turn. Where status
// calls a bake up to date with the changed level, baking that level gives the same bytes. Also: exporters' noise is
// forgiven and changes light by no more than noise, and every real change is not.
#include "relume/bake/provenance.h"
#include "bake/shape_sums.h"
#include "relume/bake/bake.h"
#include "relume/bake_file.h"
#include "tests/import/gltf_builder.h"
#include "tests/long_tests.h"
#include "tools/compare/staleness.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace relume {
namespace {

using relume::testing::GltfBuilder;
using relume::testing::png;
using Json = nlohmann::json;

BakeOptions tinyOptions() {
  BakeOptions options = presetOptions(Preset::draft);
  options.playSpace.walks = 1000;
  options.surfels.count = 64;
  options.caches.gridCaches = 8;
  options.caches.lightmapCaches = 32;
  options.links.raysPerCache = 32;
  return options;
}

// A grid of quads over [0,1]² at y = 0, facing up, with every attribute the baker reads.
Json sheet(GltfBuilder& b, int side) {
  std::vector<float> position, normal, uv, uv1, color;
  std::vector<std::uint16_t> index;
  for (int z = 0; z <= side; ++z) {
    for (int x = 0; x <= side; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(side),
                  v = static_cast<float>(z) / static_cast<float>(side);
      position.insert(position.end(), {u, 0.05f * std::sin(7.0f * u), v});
      normal.insert(normal.end(), {-0.1f, 0.99f, 0.05f * v});
      uv.insert(uv.end(), {u, v});
      uv1.insert(uv1.end(), {v, u});
      color.insert(color.end(), {1.0f - 0.5f * u, 1.0f, 0.5f + 0.5f * v});
    }
  }
  const int row = side + 1;
  for (int z = 0; z < side; ++z) {
    for (int x = 0; x < side; ++x) {
      const int a = z * row + x;
      for (const int i : {a, a + row, a + 1, a + 1, a + row, a + row + 1})
        index.push_back(static_cast<std::uint16_t>(i));
    }
  }
  return {{"attributes",
           {{"POSITION", b.floats(position, "VEC3")},
            {"NORMAL", b.floats(normal, "VEC3")},
            {"TEXCOORD_0", b.floats(uv, "VEC2")},
            {"TEXCOORD_1", b.floats(uv1, "VEC2")},
            {"COLOR_0", b.floats(color, "VEC3")}}},
          {"indices", b.indices(index)}};
}

// A floor and a screen above it, a camera, a lamp, one texture with holes, and materials nobody uses.
GltfBuilder makeBase() {
  GltfBuilder b;
  std::vector<std::uint8_t> rgba;
  for (int i = 0; i < 64; ++i)
    rgba.insert(rgba.end(), {static_cast<std::uint8_t>(3 * i), static_cast<std::uint8_t>(200 - i), 90,
                             static_cast<std::uint8_t>(i % 3 == 0 ? 0 : 255)});
  const int texture = b.texture(png(8, 8, rgba), {{"wrapS", 10497}, {"wrapT", 33071}, {"magFilter", 9729}});
  b.root["extensionsUsed"] = {"KHR_lights_punctual", "KHR_texture_transform", "KHR_materials_emissive_strength",
                              "EXT_mesh_gpu_instancing"};
  const Json colour = {
      {"index", texture},
      {"extensions", {{"KHR_texture_transform", {{"offset", {0.1, 0.2}}, {"scale", {2, 3}}, {"rotation", 0.3}}}}}};
  const int floor =
      b.material({{"name", "floor"},
                  {"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.7, 0.6, 1.0}}, {"baseColorTexture", colour}}}});
  const int screen =
      b.material({{"name", "screen"},
                  {"alphaMode", "MASK"},
                  {"alphaCutoff", 0.4},
                  {"doubleSided", true},
                  {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}, {"texCoord", 1}}}}},
                  {"emissiveFactor", {0.5, 0.4, 0.3}},
                  {"emissiveTexture", {{"index", texture}}},
                  {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 3.0}}}}}});
  b.material({{"name", "unused"},
              {"alphaMode", "MASK"},
              {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}});
  Json one = sheet(b, 3), two = sheet(b, 2);
  one["material"] = floor;
  two["material"] = screen;
  b.node({{"name", "Floor"},
          {"mesh", b.mesh(one)},
          {"scale", {4, 1, 4}},
          {"extras", {{"relume", {{"texelDensity", 1.5}}}}}});
  b.node({{"name", "Screen"},
          {"mesh", b.mesh(two)},
          {"translation", {1, 1, 1}},
          {"rotation", {0.6, 0, 0, 0.8}},
          {"scale", {2, 1, 2}}});
  b.root["cameras"] = {
      {{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"znear", 0.1}, {"aspectRatio", 1.5}}}}};
  b.node({{"name", "Eye"}, {"camera", 0}, {"translation", {2, 1.5, 3.5}}});
  b.root["extensions"] = {{"KHR_lights_punctual",
                           {{"lights",
                             {{{"type", "spot"},
                               {"intensity", 5.0},
                               {"color", {1, 0.9, 0.8}},
                               {"range", 20.0},
                               {"spot", {{"innerConeAngle", 0.2}, {"outerConeAngle", 0.6}}}}}}}}};
  b.node({{"name", "Lamp"}, {"translation", {2, 2, 2}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  return b;
}

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

// A level and what its bake is.
struct Baked {
  Bake bake;
  std::vector<std::byte> bytes;
};

std::optional<Baked> bakeLevel(const Scene& scene) {
  Context context;
  Result<Bake> baked = bake(scene, tinyOptions(), context);
  if (!baked) {
    ADD_FAILURE() << baked.error().message;
    return std::nullopt;
  }
  Result<std::vector<std::byte>> bytes = serializeBake(*baked);
  EXPECT_TRUE(bytes) << bytes.error().message;
  return Baked{std::move(*baked), std::move(*bytes)};
}

// The chunks that hold light. The archive of the provenance has the hash of cameras that decide nothing.
bool sameButCameras(Bake a, const Baked& b) {
  a.provenance.cameraHash = b.bake.provenance.cameraHash;
  const Result<std::vector<std::byte>> bytes = serializeBake(a);
  return bytes && *bytes == b.bytes;
}

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

TEST(Provenance, materialsThatNobodyUsesChangeNothing) {
  GltfBuilder base = makeBase();
  const std::optional<Baked> before = bakeLevel(*base.import());
  ASSERT_TRUE(before);
  base.root["materials"][2]["alphaMode"] = "OPAQUE";
  const std::optional<Baked> now = bakeLevel(*base.import());
  EXPECT_TRUE(now && now->bytes == before->bytes);
}

TEST(Provenance, optionsSeedVersionAndRayTracerCount) {
  const GltfBuilder base = makeBase();
  const Result<Scene> scene = base.import();
  ASSERT_TRUE(scene);
  const std::optional<Baked> baked = bakeLevel(*scene);
  ASSERT_TRUE(baked);
  const BakeOptions options = tinyOptions();
  EXPECT_TRUE(findStaleness(*scene, &options, baked->bake).upToDate());
  EXPECT_TRUE(findStaleness(*scene, nullptr, baked->bake).upToDate());

  BakeOptions seeded = options;
  ++seeded.seed;
  EXPECT_FALSE(findStaleness(*scene, &seeded, baked->bake).upToDate());
  Bake other = baked->bake;
  ++other.provenance.algorithmVersion;
  EXPECT_FALSE(findStaleness(*scene, nullptr, other).upToDate());
  other = baked->bake;
  other.provenance.rayTracer = "embree 1.0.0 isa=avx2";
  const Staleness traced = findStaleness(*scene, nullptr, other);
  ASSERT_EQ(traced.others.size(), 1u);
  EXPECT_NE(traced.others[0].find("the ray tracer was embree 1.0.0"), std::string::npos);

  // Each option by itself, where another value can be had.
  int changed = 0;
  for (const OptionInfo& info : listOptions(options)) {
    for (const char* value : {"1", "2", "3", "0.25", "false", "true", "sse4.2"}) {
      BakeOptions tuned = options;
      if (!setOption(tuned, info.name, value) || !checkOptions(tuned) || optionsToJson(tuned) == optionsToJson(options))
        continue;
      EXPECT_FALSE(findStaleness(*scene, &tuned, baked->bake).upToDate()) << info.name << " = " << value;
      ++changed;
      break;
    }
  }
  EXPECT_GT(changed, 10);
}

// A smooth mesh of many vertices, with and without what exporters add.
Mesh bumpyMesh(int side, float size) {
  Mesh mesh;
  for (int z = 0; z <= side; ++z) {
    for (int x = 0; x <= side; ++x) {
      const float u = size * static_cast<float>(x) / static_cast<float>(side),
                  v = size * static_cast<float>(z) / static_cast<float>(side);
      mesh.position.emplace_back(u, 0.1f * size * std::sin(5.0f * u) * std::cos(3.0f * v), v);
      mesh.normal.push_back(glm::normalize(glm::vec3(-std::cos(5.0f * u), 1.0f, std::sin(3.0f * v))));
    }
  }
  return mesh;
}

Mesh withNoise(Mesh mesh, double metres, double ofNormal, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      mesh.position[i][k] = static_cast<float>(mesh.position[i][k] + metres * unit(random));
      mesh.normal[i][k] = static_cast<float>(mesh.normal[i][k] + ofNormal * unit(random));
    }
  }
  return mesh;
}

TEST(ShapeSums, noiseOfExportersIsForgiven) {
  for (const float size : {0.02f, 0.3f, 1.0f, 4.0f, 60.0f}) {
    const Mesh mesh = bumpyMesh(test::longTests() ? 316 : 100, size);  // 100,489 vertices in the long test
    const std::vector<std::uint32_t> sums = shapeSums(mesh);
    EXPECT_TRUE(sameShape(mesh, sums, 1.0f));
    for (std::uint32_t seed = 0; seed < 20; ++seed)
      EXPECT_TRUE(sameShape(withNoise(mesh, 1e-8, 1e-7, seed), sums, 1.0f)) << size << " m, seed " << seed;
  }
}

// How often a level's status would flip: over all its meshes, for many exports. docs/notes/compare.md has the figure.
TEST(ShapeSums, noiseOfExportersIsForgivenOnLevels) {
  std::vector<std::string> levels = {RELUME_SOURCE_DIR "/samples/level/two_rooms.glb"};
  const std::string sponza = RELUME_SHARED_DIR "/scenes/sponza/sponza.glb";
  if (test::longTests() && std::filesystem::exists(sponza)) levels.push_back(sponza);
  for (const std::string& level : levels) {
    Context context;
    const Result<Scene> scene = importGltf(level, context);
    ASSERT_TRUE(scene) << scene.error().message;
    std::size_t vertices = 0, flipped = 0, exports = 0;
    for (const Mesh& mesh : scene->meshes) {
      if (mesh.normal.empty()) continue;
      vertices += mesh.position.size();
      const std::vector<std::uint32_t> sums = shapeSums(mesh);
      for (std::uint32_t seed = 0; seed < 50; ++seed, ++exports)
        flipped += !sameShape(withNoise(mesh, 1e-8, 1e-7, seed), sums, 1.0f);
    }
    std::printf("%s: %zu vertices, %zu of %zu noisy exports of a mesh noticed\n", level.c_str(), vertices, flipped,
                exports);
    EXPECT_EQ(flipped, 0u) << level;
    EXPECT_GT(vertices, 0u) << level;
  }
}

TEST(ShapeSums, theSmallestChangeOfOneVertexIsNot) {
  const float size = 0.3f;
  const Mesh mesh = bumpyMesh(40, size);
  const std::vector<std::uint32_t> sums = shapeSums(mesh);
  for (std::size_t i = 0; i < mesh.position.size(); i += 7) {
    for (int k = 0; k < 3; ++k) {
      Mesh moved = mesh;
      moved.position[i][k] += 1e-6f;
      EXPECT_FALSE(sameShape(moved, sums, 1.0f)) << i;
      Mesh turned = mesh;
      turned.normal[i][k] += 1e-5f;
      EXPECT_FALSE(sameShape(turned, sums, 1.0f)) << i;
    }
  }
  Mesh swapped = mesh;
  std::swap(swapped.position[3], swapped.position[4]);
  EXPECT_FALSE(sameShape(swapped, sums, 1.0f));
  Mesh shifted = mesh;
  for (glm::vec3& p : shifted.position) p.x += 1e-6f;
  EXPECT_FALSE(sameShape(shifted, sums, 1.0f));
  Mesh shorter = mesh;
  shorter.position.resize(10);
  EXPECT_FALSE(sameShape(shorter, sums, 1.0f));
}

// A level exported twice: up to date, and the same light but for noise.
TEST(Provenance, noiseOfAnExporterIsNoChange) {
  const GltfBuilder base = makeBase();
  Result<Scene> scene = base.import();
  ASSERT_TRUE(scene);
  const std::optional<Baked> baked = bakeLevel(*scene);
  ASSERT_TRUE(baked);
  for (Mesh& mesh : scene->meshes) mesh = withNoise(mesh, 1e-8, 1e-7, 5);
  EXPECT_NE(hashScene(*scene, describeInstances(*scene)), baked->bake.provenance.sceneHash);
  EXPECT_TRUE(findStaleness(*scene, nullptr, baked->bake).upToDate());
  EXPECT_TRUE(checkSameScene(*scene, baked->bake, "bake", "level"));
  scene->meshes[0].normal[2].x += 1e-3f;
  const Staleness stale = findStaleness(*scene, nullptr, baked->bake);
  ASSERT_EQ(stale.parts.size(), 1u);
  EXPECT_EQ(stale.parts[0].kind, PartChange::Kind::reshaped);
  EXPECT_EQ(stale.parts[0].node, "Floor");
}

TEST(Provenance, aBakeOfAnotherLevelIsOneSentence) {
  const std::optional<Baked> baked = bakeLevel(*makeBase().import());
  ASSERT_TRUE(baked);
  GltfBuilder other = makeBase();
  for (Json& node : other.root["nodes"]) node["name"] = node["name"].get<std::string>() + " of another level";
  const Result<Scene> scene = other.import();
  ASSERT_TRUE(scene);
  const Staleness stale = findStaleness(*scene, nullptr, baked->bake);
  EXPECT_EQ(stale.sentences().size(), 1u);
  EXPECT_NE(stale.sentences()[0].find("another level"), std::string::npos) << stale.sentences()[0];
  const Status same = checkSameScene(*scene, baked->bake, "old.relume", "new.glb");
  ASSERT_FALSE(same);
  for (const char* word : {"new.glb", "old.relume", "another level", "--allow-stale"})
    EXPECT_NE(same.error().message.find(word), std::string::npos) << same.error().message;
}

TEST(Provenance, camerasThatOnlyLookAreNotedAndNeedNoBake) {
  GltfBuilder base = makeBase();
  const std::optional<Baked> baked = bakeLevel(*base.import());
  ASSERT_TRUE(baked);
  base.node({{"name", "Photographer"},
             {"camera", 0},
             {"translation", {1, 2, 3}},
             {"extras", {{"relume", {{"playSpace", false}}}}}});
  const Result<Scene> scene = base.import();
  ASSERT_TRUE(scene);
  const Staleness stale = findStaleness(*scene, nullptr, baked->bake);
  EXPECT_TRUE(stale.upToDate());
  EXPECT_EQ(stale.notes, std::vector<std::string>{"cameras changed; light did not need a rebake"});
  const std::optional<Baked> again = bakeLevel(*scene);
  EXPECT_TRUE(again && sameButCameras(baked->bake, *again)) << "its light is the same, byte by byte";

  // One that counts as play space does need one.
  base.root["nodes"].back().erase("extras");
  EXPECT_FALSE(findStaleness(*base.import(), nullptr, baked->bake).upToDate());
}

// --allow-stale: parts find their place by name, and what the bake does not know reads the grid.
TEST(Provenance, aStaleBakeIsFittedToItsScene) {
  GltfBuilder base = makeBase();
  const std::optional<Baked> baked = bakeLevel(*base.import());
  ASSERT_TRUE(baked);
  std::swap(base.root["scenes"][0]["nodes"][0], base.root["scenes"][0]["nodes"][1]);
  base.node({{"name", "New"}, {"mesh", 1}});
  const Result<Scene> scene = base.import();
  ASSERT_TRUE(scene);
  Bake fitted = baked->bake;
  EXPECT_EQ(fitToScene(*scene, fitted), 2u);
  const Array<LightmapPart>&before = baked->bake.caches.lightmap.parts, &now = fitted.caches.lightmap.parts;
  ASSERT_EQ(fitted.instances.size(), 5u);
  EXPECT_EQ(now[0].firstCorner, before[1].firstCorner);
  EXPECT_EQ(now[1].firstCorner, before[0].firstCorner);
  EXPECT_EQ(now[2].triangleCount, 0u);
  for (std::uint32_t i = 0; i < fitted.surfels.count(); ++i)
    EXPECT_EQ(fitted.instances[fitted.surfels.instance[i]].node,
              baked->bake.instances[baked->bake.surfels.instance[i]].node);
  EXPECT_TRUE(serializeBake(fitted)) << "still a bake";
}

}  // namespace
}  // namespace relume
