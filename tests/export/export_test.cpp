// SPDX-License-Identifier: MIT
// What a game reads from an exported level: coordinates, light, and everything else as it was.
#include "tests/export/shared_levels.h"
#include "tools/render/render_cpu.h"

#include <fstream>
#include <set>

namespace relume {
namespace {

using nlohmann::json;
using test::Exported;
using test::isHusk;
using test::kLevel;
using test::madeLevel;
using test::nodeNamed;
using test::someOptions;
using test::twoRooms;
using testing::GltfBuilder;

// JSON without what an export may change.
json unchanging(json root) {
  for (const char* name : {"meshes", "accessors", "bufferViews", "buffers"}) root.erase(name);
  for (json& node : root["nodes"]) node.erase("mesh");
  root["asset"].erase("extras");
  return root;
}

TEST(ExportLevel, everyCornerOfTheSampleLevelHasTheBakesCoordinate) {
  expectCoordinates(twoRooms());
  test::expectSameSurfaces(twoRooms().scene, twoRooms().again);
}

TEST(ExportLevel, nothingElseOfTheSampleLevelChanges) {
  const Exported& e = twoRooms();
  EXPECT_EQ(unchanging(e.before), unchanging(e.after));
  // What was there stays where it was; what is new follows it.
  for (const char* name : {"accessors", "bufferViews", "meshes"}) {
    ASSERT_GE(e.after[name].size(), e.before[name].size());
    if (std::string(name) == "meshes") continue;
    for (std::size_t i = 0; i < e.before[name].size(); ++i) {
      json was = e.before[name][i], is = e.after[name][i];
      if (isHusk(is)) continue;
      for (json* element : {&was, &is}) element->erase("byteOffset");  // bytes that nobody reads are gone
      EXPECT_EQ(is, was) << name << " " << i;
    }
  }
  EXPECT_EQ(e.level.verticesAdded > 0, true);
  EXPECT_LT(e.level.verticesAdded, e.level.vertices);
}

TEST(ExportLevel, theBakeIsNamed) {
  const Exported& e = twoRooms();
  const json& named = e.after["asset"]["extras"]["relume"]["lightmap"];
  EXPECT_EQ(named["bake"], "0123456789abcdef");
  EXPECT_EQ(std::stoull(named["sceneHash"].get<std::string>(), nullptr, 16), e.bake.provenance.sceneHash);
  EXPECT_EQ(named["texcoord"], 1);
  EXPECT_EQ(named["width"], e.bake.caches.lightmap.width);
  const auto setIn = [](const json& element, const char* name) {
    return element.value(json::json_pointer(std::string("/extras/relume/") + name), 0);
  };
  for (const json& mesh : e.after["meshes"]) {
    int front = 0, back = 0;
    for (const json& p : mesh["primitives"]) {
      front |= setIn(p, "lightmapTexcoord");
      back |= setIn(p, "backLightmapTexcoord");
      EXPECT_EQ(setIn(p, "lightmapTexcoord"), p["attributes"].contains("TEXCOORD_1") ? 1 : 0);
      EXPECT_EQ(setIn(p, "backLightmapTexcoord"), p["attributes"].contains("TEXCOORD_2") ? 2 : 0);
    }
    EXPECT_EQ(setIn(mesh, "lightmapTexcoord"), front);
    EXPECT_EQ(setIn(mesh, "backLightmapTexcoord"), back);
  }
}

// Normals that the importer takes from a vertex's triangles: a copy of the vertex has fewer of them.
TEST(ExportLevel, surfacesWithoutNormalsAreTheSameWhereVerticesAreSplit) {
  GltfBuilder level = madeLevel();
  for (json& mesh : level.root["meshes"]) {
    for (json& primitive : mesh["primitives"]) {
      const std::size_t count =
          level.root["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()]["count"];
      primitive["attributes"]["NORMAL"] = level.floats(std::vector<float>(3 * count, 0.0f), "VEC3");
    }
  }
  const Exported e = test::exportOf(level.write("zero_normals.gltf"), someOptions());
  EXPECT_GT(e.level.verticesAdded, 0u);
  std::size_t repaired = 0;
  for (std::size_t i = 0; i < e.scene.instances.size(); ++i) {
    const Mesh &before = e.scene.meshes[e.scene.instances[i].mesh], &after = e.again.meshes[e.again.instances[i].mesh];
    EXPECT_EQ(hashSurface(before), hashSurface(after)) << e.scene.instances[i].node;
    repaired += before.normalsRepaired;
  }
  EXPECT_GT(repaired, 0u);
}

// Vertices are as many as there are pairs of a vertex and what its corners have on the map, and those nobody uses.
TEST(ExportLevel, verticesAreSplitWhereChartsNeedItAlone) {
  const Exported& e = twoRooms();
  Context context;
  const auto document = loadGltfDocument(e.path, context), source = loadGltfDocument(kLevel, context);
  ASSERT_TRUE(document && source);
  const Lightmap& map = e.bake.caches.lightmap;
  for (std::uint32_t i = 0; i < e.scene.instances.size(); ++i) {
    const auto primitiveOf = [](const GltfDocument& d, const Instance& instance) -> const tinygltf::Primitive& {
      return d.model.meshes[static_cast<std::size_t>(d.model.nodes[instance.nodeIndex].mesh)]
          .primitives[instance.primitive];
    };
    const auto countOf = [](const GltfDocument& d, const tinygltf::Primitive& p) {
      return d.model.accessors[static_cast<std::size_t>(p.attributes.at("POSITION"))].count;
    };
    const tinygltf::Primitive &before = primitiveOf(*source, e.scene.instances[i]),
                              &after = primitiveOf(*document, e.again.instances[i]);
    AccessorReader reader(*source);
    const auto corner = unrollTriangles(*reader.indices(before.indices, "test"), before.mode);
    std::set<std::array<std::uint32_t, 3>> different;
    std::set<std::uint32_t> used;
    for (std::size_t c = 0; c < corner.size(); ++c) {
      const std::uint64_t at = map.parts[i].firstCorner + c;
      used.insert(corner[c]);
      different.insert({corner[c], map.cornerUv[at], map.backCornerUv.empty() ? kGridLit : map.backCornerUv[at]});
    }
    const bool charted = after.attributes.contains("TEXCOORD_1");
    EXPECT_EQ(countOf(*document, after), countOf(*source, before) + (charted ? different.size() - used.size() : 0));
  }
}

// The coordinate a game reads at a pixel gives what `relume render` draws there.
TEST(ExportLevel, aPixelLooksUpWhatIsRendered) {
  const Exported& e = twoRooms();
  Context context;
  RenderRequest request;
  request.bake = &e.bake;
  request.camera = e.scene.cameras.front();
  request.lights = e.scene.lights;
  request.emissive = true;
  request.width = 64;
  request.height = 36;
  request.samples = 1;
  request.bounces = 3;
  const auto tracer = RayTracer::create(e.scene, "avx2", context, RayStructure::thorough, RayGeometry::drawn);
  ASSERT_TRUE(tracer) << tracer.error().message;
  const auto frame = renderCpu(*tracer, request, context);
  ASSERT_TRUE(frame) << frame.error().message;
  const std::vector<glm::vec3> drawn = composeAov(*frame, Aov::indirect);

  // The game's side: its own rays at the exported level, its own coordinates.
  RelightOptions options;
  const auto visible = [&](std::uint32_t l, const glm::vec3& position, const glm::vec3& normal) {
    const SceneLight& light = request.lights[l];
    Ray ray;
    ray.origin = position + normal * tracer->epsilonAt(position);
    ray.direction = -light.direction;
    if (light.kind != LightKind::directional) {
      ray.tMax = glm::length(light.positionWorld - ray.origin);
      if (!(ray.tMax > 0.0f)) return 1.0f;
      ray.direction = (light.positionWorld - ray.origin) / ray.tMax;
    }
    return tracer->occluded(ray) ? 0.0f : 1.0f;
  };
  const auto relit = relightRequest(request, options, visible, {});
  ASSERT_TRUE(relit) << relit.error().message;
  const auto game = RayTracer::create(e.again, "avx2", context, RayStructure::thorough, RayGeometry::drawn);
  ASSERT_TRUE(game) << game.error().message;
  const auto document = loadGltfDocument(e.path, context);
  ASSERT_TRUE(document) << document.error().message;
  const CameraRays rays(request.camera, request.width, request.height);
  std::size_t compared = 0;
  for (std::uint32_t y = 0; y < request.height; ++y) {
    for (std::uint32_t x = 0; x < request.width; ++x) {
      Ray ray;
      rays.at(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, ray.origin, ray.direction);
      const Hit hit = game->trace(ray);
      if (!hit) continue;
      const Instance& instance = e.again.instances[hit.instance];
      const int set = hit.back ? e.level.backTexcoord : e.level.texcoord;
      const auto uv = set < 0 ? std::nullopt : test::cornerSet(*document, instance, set);
      if (!uv || uv->at(3 * hit.triangle) == glm::vec2(1.0f)) continue;  // reads the grid
      const glm::vec2 a = (*uv)[3 * hit.triangle], b = (*uv)[3 * hit.triangle + (instance.flipped ? 2 : 1)],
                      c = (*uv)[3 * hit.triangle + (instance.flipped ? 1 : 2)];
      const float side = hit.back ? -1.0f : 1.0f;
      const glm::vec3 irradiance = relit->all->irradianceOnLightmap(
          a + (b - a) * hit.barycentric.x + (c - a) * hit.barycentric.y, side * shadingNormal(e.again, hit.point()),
          side * geometricNormal(e.again, hit.point()));
      const glm::vec3 albedo = albedoAt(e.again, hit.point());
      const glm::vec3 expected = drawn[y * request.width + x];
      for (int k = 0; k < 3; ++k) {
        if (albedo[k] <= 0.0f) continue;
        EXPECT_NEAR(irradiance[k] / 3.14159265f, expected[k], 1e-4f * (1.0f + expected[k])) << x << ", " << y;
      }
      ++compared;
    }
  }
  EXPECT_GT(compared, request.width * request.height / 3);
}

TEST(ExportLevel, everythingOfAMadeLevelIsCarried) {
  for (const char* name : {"level.glb", "level.gltf"}) {
    const Exported e = test::exportOf(madeLevel().write(name), someOptions());
    expectCoordinates(e);
    test::expectSameSurfaces(e.scene, e.again);

    // Outside of meshes, their data and the rows of crates nothing changes.
    json before = unchanging(e.before), after = unchanging(e.after);
    for (json* root : {&before, &after}) {
      root->erase("animations");
      root->erase("extensionsUsed");
      json& nodes = (*root)["nodes"];
      while (nodes.size() > e.before["nodes"].size()) nodes.erase(nodes.size() - 1);
      for (json& node : nodes) {
        if (node.value("name", "") == "rows") node = nullptr;
      }
    }
    EXPECT_EQ(before, after);
    EXPECT_EQ(e.after["extensionsUsed"], json({"VENDOR_weather", "KHR_lights_punctual"}));
    EXPECT_EQ(e.after["asset"]["extras"]["author"], "someone");
    EXPECT_EQ(e.after["asset"]["extras"]["relume"]["lightUnit"], "radiometric");
    EXPECT_EQ(e.after["buffers"].size(), 1u);
    EXPECT_FALSE(e.after["buffers"][0].contains("uri"));
  }
}

// A flap that lies on another, so that one of the two is taken out, and opens where a node's morph weight says so. The
// level as it is exported keeps the target and both weights.
TEST(ExportLevel, nodesThatMorphWeightsBendHaveTheirOwnCoordinates) {
  for (const bool openFirst : {false, true}) {
    GltfBuilder b = madeLevel();
    const std::vector<float> flaps = {0, 0, 0, 1, 0, 0, 1, 0, -1, 0, 0, -1, 0, 0, 0, 1, 0, 0, 1, 0, -1, 0, 0, -1};
    const std::vector<float> opens = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 0, 1, 1};
    const json target = {{"POSITION", b.floats(opens, "VEC3")}};
    const int mesh = b.mesh({{"attributes", {{"POSITION", b.floats(flaps, "VEC3")}}},
                             {"targets", json::array({target})},
                             {"indices", b.indices({0, 1, 2, 0, 2, 3, 4, 5, 6, 4, 6, 7})}});
    for (const bool open : {openFirst, !openFirst}) {
      b.node({{"name", open ? "open" : "shut"},
              {"mesh", mesh},
              {"weights", {open ? 1.0 : 0.0}},
              {"translation", {open ? 0.5 : 2.5, 1.5, 3.5}}});
    }
    const Exported e = test::exportOf(b.write(), someOptions());
    expectCoordinates(e);
    test::expectSameSurfaces(e.scene, e.again);
    for (const char* name : {"open", "shut"}) {
      const json& node = nodeNamed(e.after, name);
      EXPECT_EQ(node["weights"], nodeNamed(e.before, name)["weights"]);
      EXPECT_EQ(e.after["meshes"][node["mesh"].get<std::size_t>()]["primitives"][0]["targets"].size(), 1u);
    }
  }
}

TEST(ExportLevel, meshesOfSeveralNodesBecomeOneEach) {
  const Exported e = test::exportOf(madeLevel().write(), someOptions());
  const int a = nodeNamed(e.after, "crate_a")["mesh"], b = nodeNamed(e.after, "crate_b")["mesh"];
  // The skinned node draws the mesh as it was.
  EXPECT_EQ(nodeNamed(e.after, "walker")["mesh"], 1);
  EXPECT_EQ(e.after["meshes"][1], e.before["meshes"][1]);
  EXPECT_NE(a, 1);
  EXPECT_NE(b, 1);
  EXPECT_NE(a, b);
  EXPECT_EQ(nodeNamed(e.after, "room")["mesh"], 0);
  for (const int mesh : {a, b}) {
    const json& made = e.after["meshes"][static_cast<std::size_t>(mesh)];
    EXPECT_EQ(made["name"], "crate");
    EXPECT_EQ(made["weights"], json({0.0}));
    EXPECT_EQ(made["extras"]["breakable"], true);
    const json& primitive = made["primitives"][0];
    EXPECT_EQ(primitive["extensions"], e.before["meshes"][1]["primitives"][0]["extensions"]);
    EXPECT_EQ(primitive["material"], 0);
  }
}

// Bytes of the vertices of a split primitive, attribute by attribute.
TEST(ExportLevel, splitVerticesKeepAllTheirAttributes) {
  const Exported e = test::exportOf(madeLevel().write(), someOptions());
  Context context;
  auto before = LevelDocument::read(testing::testFolder() / "test.glb", context);
  auto after = LevelDocument::read(e.path, context);
  ASSERT_TRUE(before && after);
  const json& source = before->root["meshes"][1]["primitives"][0];
  const json& made =
      after->root["meshes"][nodeNamed(after->root, "crate_a")["mesh"].get<std::size_t>()]["primitives"][0];
  const auto count = [&](const json& accessor) {
    return after->root["accessors"][accessor.get<std::size_t>()]["count"].get<std::size_t>();
  };
  const std::size_t vertices = count(made["attributes"]["POSITION"]);
  EXPECT_GT(vertices, 8u);   // welded over edges where charts end
  EXPECT_LE(vertices, 24u);  // four a side at most
  const auto check = [&](const json& from, const json& to, const std::string& name) {
    AccessorReader readerOf(before->source()), readerTo(after->source());
    const auto a = readerOf.floats(from.get<int>(), 1, 4, name), b = readerTo.floats(to.get<int>(), 1, 4, name);
    ASSERT_TRUE(a && b) << name;
    ASSERT_EQ((*b)->count, vertices) << name;
    const json &p = before->root["accessors"][from.get<std::size_t>()],
               &q = after->root["accessors"][to.get<std::size_t>()];
    for (const char* same : {"componentType", "type", "normalized"})
      EXPECT_EQ(p.value(same, json()), q.value(same, json()));
    const auto n = static_cast<std::size_t>((*a)->components);
    // The first eight are the old ones; each further is one of them.
    EXPECT_TRUE(std::equal((*a)->values.begin(), (*a)->values.end(), (*b)->values.begin())) << name;
    const auto positionOf = [](AccessorReader& reader, const json& primitive) {
      return *reader.floats(primitive["attributes"]["POSITION"].get<int>(), 3, 3, "test");
    };
    const AccessorValues &pa = *positionOf(readerOf, source), &pb = *positionOf(readerTo, made);
    for (std::size_t v = 8; v < vertices; ++v) {
      std::size_t original = 8;
      for (std::size_t o = 0; o < 8; ++o) {
        if (std::equal(&pa.values[3 * o], &pa.values[3 * o] + 3, &pb.values[3 * v])) original = o;
      }
      ASSERT_LT(original, 8u);
      EXPECT_TRUE(std::equal(&(*a)->values[n * original], &(*a)->values[n * original] + n, &(*b)->values[n * v]))
          << name;
    }
  };
  for (const auto& [name, accessor] : source["attributes"].items()) check(accessor, made["attributes"][name], name);
  check(source["targets"][0]["POSITION"], made["targets"][0]["POSITION"], "target");
}

// KHR_animation_pointer names a mesh of which there are several now, and GPU instances that are nodes now.
TEST(ExportLevel, pointersOfAnimationsMoveEveryCopy) {
  GltfBuilder b = madeLevel();
  const auto pointing = [](const std::string& pointer) {
    return json{{"sampler", 1},
                {"target", {{"path", "pointer"}, {"extensions", {{"KHR_animation_pointer", {{"pointer", pointer}}}}}}}};
  };
  int rows = 0;
  while (b.root["nodes"][static_cast<std::size_t>(rows)]["name"] != "rows") ++rows;
  b.root["animations"][0]["channels"] = {pointing("/meshes/1/weights"), pointing("/meshes/10/weights"),
                                         pointing("/nodes/" + std::to_string(rows) + "/weights"),
                                         pointing("/materials/0/alphaCutoff")};
  const Exported e = test::exportOf(b.write(), someOptions());
  std::multiset<std::string> expected{"/meshes/1/weights", "/meshes/10/weights", "/materials/0/alphaCutoff"}, found;
  for (std::size_t mesh = e.before["meshes"].size(); mesh < e.after["meshes"].size(); ++mesh) {
    EXPECT_EQ(e.after["meshes"][mesh]["name"], "crate");
    expected.insert("/meshes/" + std::to_string(mesh) + "/weights");
  }
  for (std::size_t i = 0; i < 3; ++i)
    expected.insert("/nodes/" + nodeNamed(e.after, "rows")["children"][i].dump() + "/weights");
  for (const json& channel : e.after["animations"][0]["channels"]) {
    EXPECT_EQ(channel["sampler"], 1);
    found.insert(channel["target"]["extensions"]["KHR_animation_pointer"]["pointer"].get<std::string>());
  }
  EXPECT_EQ(found, expected);
  EXPECT_GE(e.after["meshes"].size(), e.before["meshes"].size() + 4);
}

TEST(ExportLevel, gpuInstancesBecomeNodes) {
  const Exported e = test::exportOf(madeLevel().write(), someOptions());
  EXPECT_EQ(e.level.nodesAdded, 3u);
  const json& rows = nodeNamed(e.after, "rows");
  EXPECT_FALSE(rows.contains("mesh"));
  EXPECT_FALSE(rows.contains("extensions"));
  EXPECT_FALSE(rows.contains("weights"));
  ASSERT_EQ(rows["children"].size(), 4u);
  EXPECT_EQ(e.after["nodes"][rows["children"][3].get<std::size_t>()]["name"], "rows_child");
  std::set<int> meshes;
  const json ages = {0.0f, 0.2f, 1.0f};
  for (std::size_t i = 0; i < 3; ++i) {
    const json& node = e.after["nodes"][rows["children"][i].get<std::size_t>()];
    EXPECT_EQ(node["name"], "rows#" + std::to_string(i));
    EXPECT_EQ(node["weights"], json({0.25}));
    const json said = {{"_ID", 4000000001 + i}, {"_WIND", {1.0 + static_cast<double>(i), 0.5}}, {"_AGE", ages[i]}};
    EXPECT_EQ(node["extras"]["relume"]["gpuInstance"], said);
    meshes.insert(node["mesh"].get<int>());
  }
  EXPECT_EQ(meshes.size(), 3u);
  // The importer knows what the export wrote.
  for (const std::string& message : e.messages) EXPECT_EQ(message.find("gpuInstance"), std::string::npos) << message;
  // The weights' animation moves each of them.
  const json& channels = e.after["animations"][0]["channels"];
  ASSERT_EQ(channels.size(), 4u);
  EXPECT_EQ(channels[0], e.before["animations"][0]["channels"][0]);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(channels[1 + i]["target"]["node"], rows["children"][i]);
    EXPECT_EQ(channels[1 + i]["sampler"], 1);
  }
}

TEST(ExportLevel, primitivesWithoutTextureCoordinatesGetZerosBelowTheMaps) {
  GltfBuilder b = madeLevel();
  b.quad({{"attributes", {{"TEXCOORD_1", b.floats({0, 0, 1, 0, 1, 1, 0, 1}, "VEC2")}}}});
  const Exported e = test::exportOf(b.write(), someOptions());
  EXPECT_EQ(e.level.texcoord, 2);
  expectCoordinates(e);
  for (const json& mesh : e.after["meshes"]) {
    for (const json& primitive : mesh["primitives"]) {
      const json& attributes = primitive["attributes"];
      if (!attributes.contains("TEXCOORD_2")) continue;
      EXPECT_TRUE(attributes.contains("TEXCOORD_0") && attributes.contains("TEXCOORD_1"));
    }
  }
}

// Sets that do not count on from 0, as glTF asks for, are no reason to write over one.
TEST(ExportLevel, setsBeyondAGapStay) {
  GltfBuilder b = madeLevel();
  const std::vector<float> texels = {0.5f, 0.25f, 0.125f, 0.5f, 0.25f, 0.75f, 1.0f, 0.0f};
  b.quad({{"attributes", {{"TEXCOORD_2", b.floats(texels, "VEC2")}}},
          {"material", b.material({{"doubleSided", true}})},
          {"extras", {{"paint", "oil"}}}});
  const Exported e = test::exportOf(b.write(), someOptions());
  EXPECT_EQ(e.level.texcoord, 3);
  expectCoordinates(e);
  EXPECT_EQ(e.after["meshes"][e.before["meshes"].size() - 1]["primitives"][0]["extras"]["paint"], "oil");
  Context context;
  const auto document = loadGltfDocument(e.path, context);
  ASSERT_TRUE(document);
  const auto kept = test::cornerSet(*document, e.again.instances.back(), 2);
  ASSERT_TRUE(kept);
  const Mesh& mesh = e.scene.meshes[e.scene.instances.back().mesh];
  for (std::size_t c = 0; c < kept->size(); ++c) {
    const std::uint32_t v = mesh.triangle[c / 3][static_cast<int>(c % 3)];
    EXPECT_EQ((*kept)[c], glm::vec2(texels[2 * v], texels[2 * v + 1]));
  }
}

// JSON knows no whole numbers: some writers say 3.0.
TEST(ExportLevel, wholeNumbersMayBeWrittenAsFloats) {
  const auto asFloats = [](const json& value, const auto& self) -> json {
    if (value.is_number_unsigned() || value.is_number_integer()) return value.get<double>();
    json out = value;
    if (value.is_structured()) {
      for (json& member : out) member = self(member, self);
    }
    return out;
  };
  GltfBuilder b = madeLevel();
  b.root["buffers"] = json::array({{{"byteLength", b.binary.size()}}});
  const Exported plain = test::exportOf(b.write(), someOptions());
  b.root = asFloats(b.root, asFloats);
  const Exported floats = test::exportOf(b.write("floats.glb"), someOptions());
  expectCoordinates(floats);
  EXPECT_EQ(floats.level.bytesPruned, plain.level.bytesPruned);
}

TEST(ExportLevel, whatTheRepairTakesOutIsLitAsWhatItLiesOn) {
  GltfBuilder b = madeLevel();
  // A square whose first triangle is there twice, with vertices of its own and turned.
  b.node({{"mesh",
           b.mesh({{"attributes",
                    {{"POSITION", b.floats({1, 1, 1, 2, 1, 1, 2, 2, 1, 1, 2, 1, 2, 1, 1, 2, 2, 1, 1, 1, 1}, "VEC3")}}},
                   {"indices", b.indices({0, 1, 2, 0, 2, 3, 4, 5, 6})}})}});
  const Exported e = test::exportOf(b.write(), someOptions());
  expectCoordinates(e);
  Context context;
  const auto document = loadGltfDocument(e.path, context);
  ASSERT_TRUE(document);
  const auto uv = test::cornerSet(*document, e.again.instances.back(), e.level.texcoord);
  ASSERT_TRUE(uv);
  EXPECT_EQ((*uv)[6], (*uv)[1]);
  EXPECT_EQ((*uv)[7], (*uv)[2]);
  EXPECT_EQ((*uv)[8], (*uv)[0]);
  EXPECT_NE((*uv)[6], glm::vec2(1.0f));
}

TEST(ExportLevel, imagesBesideTheLevelAreEmbedded) {
  GltfBuilder b = madeLevel();
  const auto png = testing::png(2, 1, {1, 2, 3, 255, 4, 5, 6, 255});
  testing::writeFile("paint.png", png);
  b.root["images"] = {{{"uri", "paint.png"}, {"name", "paint"}}, {{"uri", "lost.png"}}};
  b.root["textures"] = {{{"source", 0}}};
  const Exported e = test::exportOf(b.write("level.gltf"), someOptions());
  const json& image = e.after["images"][0];
  EXPECT_EQ(image["mimeType"], "image/png");
  EXPECT_EQ(image["name"], "paint");
  Context context;
  const auto document = loadGltfDocument(e.path, context);
  const auto bytes = document->viewBytes(image["bufferView"].get<int>(), "test");
  ASSERT_TRUE(bytes);
  EXPECT_EQ(std::vector<std::uint8_t>(bytes->begin(), bytes->end()), png);
  // What is not there keeps its name, with a word.
  EXPECT_EQ(e.after["images"][1], json({{"uri", "lost.png"}}));
  const auto told = [](const std::string& m) { return m.find("lost.png") != std::string::npos; };
  EXPECT_TRUE(std::any_of(e.messages.begin(), e.messages.end(), told));
}

TEST(ExportLevel, whatCannotBeExportedIsRefused) {
  Context context;
  const Exported e = test::exportOf(madeLevel().write(), someOptions());
  const auto refusal = [&](const std::filesystem::path& path, const Scene& scene) {
    const auto made = exportLevel(path, scene, e.bake, 1, context);
    return made ? Error{} : made.error();
  };
  // Twice.
  const Error twice = refusal(e.path, e.again);
  EXPECT_EQ(twice.code, ErrorCode::usage);
  EXPECT_NE(twice.message.find("already"), std::string::npos) << twice.message;
  // Another file than the scene's.
  GltfBuilder other = madeLevel();
  other.root["meshes"][0]["primitives"][0]["indices"] = other.indices({0, 1, 2});
  const Error changed = refusal(other.write("other.glb"), e.scene);
  EXPECT_EQ(changed.code, ErrorCode::failed);
  EXPECT_NE(changed.message.find("changed"), std::string::npos) << changed.message;
  // No room for the bake's name.
  GltfBuilder taken = madeLevel();
  taken.root["asset"]["extras"] = "mine";
  EXPECT_EQ(refusal(taken.write("taken.glb"), e.scene).code, ErrorCode::unsupported);
}

}  // namespace
}  // namespace relume
