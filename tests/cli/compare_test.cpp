// SPDX-License-Identifier: MIT
// Two bakes held against each other: what is said about scene, places and light of bakes whose difference is known.
#include "formats/chunks.h"
#include "formats/compact_links.h"
#include "formats/validate.h"
#include "relume/bake_file.h"
#include "relume/relighter.h"
#include "tests/cli/check_schema.h"
#include "tests/comma_locale.h"
#include "tests/formats/small_bake.h"
#include "tools/compare/compare_light.h"
#include "tools/compare/compare_lightings.h"
#include "tools/compare/compare_page.h"
#include "tools/compare/compare_report.h"
#include "tools/compare/compare_scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <optional>

namespace relume {
namespace {

using Json = nlohmann::json;

LightDifference difference(const Bake& a, const Bake& b, const std::vector<std::string>& ignore = {}) {
  Context context;
  context.threads = 1;
  Result<LightDifference> light = compareLight(a, b, nullptr, {ignore}, context);
  EXPECT_TRUE(light) << light.error().message;
  return light ? std::move(*light) : LightDifference{};
}

const LightingDifference& lighting(const LightDifference& light, const std::string& name) {
  for (const LightingDifference& l : light.lightings) {
    if (l.name == name) return l;
  }
  ADD_FAILURE() << "no lighting " << name;
  return light.lightings.front();
}

// The small bake with black surfaces: what arrives comes straight from emitters and sky.
Bake blackBake() {
  Bake bake = makeSmallBake();
  bake.surfels.albedo = std::vector<glm::vec3>(6, glm::vec3(0.0f));
  return bake;
}

// All transfers of a cache's links scaled; halves of 0.1 times powers of two are exact.
void scaleLinks(Bake& bake, std::uint32_t first, std::uint32_t last, float factor) {
  std::vector<ConeLink> cone = bake.links.cone.toVector();
  for (std::uint32_t i = bake.links.rowBegin[first]; i < bake.links.rowBegin[last]; ++i)
    cone[i].transfer = packHalf(unpackHalf(cone[i].transfer) * factor);
  bake.links.cone = cone;
}

BakeFile fileOf(const Bake& bake, const std::string& name) {
  const auto path = std::filesystem::path(testing::TempDir()) / ("relume_compare_" + name + ".relume");
  EXPECT_TRUE(writeBake(bake, path));
  return {name, bake, *listChunks(path)};
}

TEST(CompareParts, eachChangeIsToldApartByName) {
  const auto part = [](const char* node, const char* material, std::uint64_t transform, std::uint64_t geometry,
                       std::uint64_t surface, std::uint64_t settings = 0) {
    return BakedInstance{node,      "mesh",   material, transform * 1000 + geometry * 100 + surface * 10 + settings,
                         transform, geometry, surface};
  };
  const std::vector<BakedInstance> before = {
      part("same", "m", 1, 1, 1),    part("moved", "m", 1, 1, 1),   part("reshaped", "m", 1, 1, 1),
      part("painted", "m", 1, 1, 1), part("swapped", "m", 1, 1, 1), part("tuned", "m", 1, 1, 1),
      part("gone", "m", 1, 1, 1),    part("twin", "m", 1, 1, 1),    part("twin", "m", 2, 1, 1)};
  const std::vector<BakedInstance> now = {
      part("twin", "m", 1, 1, 1),    part("twin", "m", 3, 1, 1),     part("same", "m", 1, 1, 1),
      part("moved", "m", 2, 1, 1),   part("reshaped", "m", 1, 2, 1), part("painted", "m", 1, 1, 2),
      part("swapped", "n", 1, 1, 3), part("tuned", "m", 1, 1, 1, 1), part("new", "m", 4, 1, 1)};
  std::vector<std::string> texts;
  for (const PartChange& change : compareParts(before, now)) texts.push_back(toString(change));
  EXPECT_EQ(texts,
            (std::vector<std::string>{
                "node \"twin\" moved", "node \"moved\" moved", "node \"reshaped\": geometry of mesh \"mesh\" changed",
                "node \"painted\": material \"m\" changed", "node \"swapped\": material was \"m\", is \"n\"",
                "node \"tuned\": extras.relume (bake mode, texel density), whether it counts as solid or mirrored, or "
                "its number among the node's primitives or instances changed",
                "node \"new\" added", "node \"gone\" removed"}));
  EXPECT_TRUE(compareParts(before, before).empty());
}

// A part that has another name is found again by its mesh and place; what else changed of it is told as well.
TEST(CompareParts, whatWasRenamedIsNotAnother) {
  const std::vector<BakedInstance> before = {{"lamp", "panel", "glow", 1, 10, 20, 30},
                                             {"lamp", "panel", "glow", 2, 11, 20, 30},
                                             {"wall", "quad", "paint", 3, 12, 21, 31}};
  std::vector<BakedInstance> now = {{"light", "panel", "glow", 2, 11, 20, 30},
                                    {"light", "panel", "bright", 4, 10, 20, 32},
                                    {"wall", "plane", "paint", 3, 12, 21, 31}};
  using Answers = std::vector<std::optional<std::size_t>>;
  EXPECT_EQ(answersOf(before, now), (Answers{1, 0, 2}));
  std::vector<std::string> texts;
  for (const PartChange& change : compareParts(before, now)) texts.push_back(toString(change));
  EXPECT_EQ(texts, (std::vector<std::string>{"node \"light\" was \"lamp\"", "node \"light\" was \"lamp\"",
                                             "node \"light\": material was \"glow\", is \"bright\"",
                                             "node \"wall\": mesh was \"quad\", is \"plane\""}));
  now[0].transformHash = 99;
  EXPECT_EQ(answersOf(before, now), (Answers{std::nullopt, 0, 2}));
  // A numbered node that was put before two others of its mesh, of which the second moved.
  const std::vector<BakedInstance> two = {{"unnamed node 0", "box", "", 1, 10, 20, 30},
                                          {"unnamed node 1", "box", "", 2, 11, 20, 30}};
  const std::vector<BakedInstance> three = {{"unnamed node 0", "box", "", 5, 12, 20, 30},
                                            {"unnamed node 1", "box", "", 6, 13, 20, 30},
                                            {"unnamed node 2", "box", "", 1, 10, 20, 30}};
  EXPECT_EQ(answersOf(two, three), (Answers{std::nullopt, 1, 0}));
  // Names that changed places are no new names.
  EXPECT_EQ(answersOf(std::vector<BakedInstance>{{"a", "m", "", 1, 10, 20, 30}, {"b", "n", "", 2, 11, 21, 30}},
                      std::vector<BakedInstance>{{"b", "m", "", 1, 10, 20, 30}, {"a", "n", "", 2, 11, 21, 30}}),
            (Answers{std::nullopt, std::nullopt}));
}

TEST(CompareLight, sameTransportGivesNoDifference) {
  Bake b = makeSmallBake();
  b.provenance.toolVersion = "9.9.9";
  const LightDifference light = difference(makeSmallBake(), b);
  EXPECT_EQ(light.match.pairs.size(), 6u);
  EXPECT_EQ(light.match.onlyInA + light.match.onlyInB, 0u);
  EXPECT_EQ(light.maxRmse, 0.0);
  EXPECT_EQ(light.maxChange, 0.0);
  EXPECT_EQ(light.maxDeltaE, 0.0);
  EXPECT_TRUE(light.worst.empty());
  EXPECT_GT(lighting(light, "sky").meanA, 0.0);
  EXPECT_GT(lighting(light, "emitter lamp").meanA, 0.0);
}

TEST(CompareLight, aRenamedEmitterIsComparedWithItself) {
  Bake b = makeSmallBake();
  editInstance(b, 1, [](BakedInstance& i) { i.node = "ceiling lamp"; });
  const LightDifference light = difference(makeSmallBake(), b);
  EXPECT_EQ(lighting(light, "emitter ceiling lamp").was, "lamp");
  EXPECT_GT(lighting(light, "emitter ceiling lamp").meanA, 0.0);
  EXPECT_EQ(light.maxRmse, 0.0);
  EXPECT_EQ(light.maxReceiverChange, 0.0);
  const BakeFile fileA = fileOf(makeSmallBake(), "a"), fileB = fileOf(b, "b");
  const Json report = reportDifference(fileA, fileB, light, {}, {});
  std::ifstream schema(RELUME_SOURCE_DIR "/docs/compare.schema.json");
  EXPECT_EQ(SchemaCheck(Json::parse(schema)).check(report), std::vector<std::string>{});
  EXPECT_EQ(report["light"]["lightings"].back()["was"], "lamp");
  EXPECT_EQ(report["baked"]["sceneParts"][0]["change"], "renamed");
  EXPECT_NE(reportAsText(report).find("emitter ceiling lamp, was lamp"), std::string::npos) << reportAsText(report);
  EXPECT_NE(reportAsPage(report, fileA, fileB, &light, {}).find("emitter ceiling lamp, was lamp"), std::string::npos);
  scaleLinks(b, 0, 6, 0.5f);
  for (const char* name : {"emitter ceiling lamp", "emitter lamp"}) {
    const LightDifference ignored = difference(makeSmallBake(), b, {name});
    EXPECT_FALSE(lighting(ignored, "emitter ceiling lamp").counted) << name;
  }
}

// The small bake with its two emitting surfels as two nodes that the importer numbered, the second 8 times as strong.
Bake numberedLamps(const std::string& first, const std::string& second) {
  Bake bake = blackBake();
  std::vector<BakedInstance> parts = bake.instances.toVector();
  parts[1].node = first;
  parts.push_back(parts[1]);
  parts[2].node = second;
  parts[2].transformHash = parts[2].contentHash = 24;
  bake.instances = parts;
  std::vector<LightmapPart> onMap = bake.caches.lightmap.parts.toVector();
  onMap.push_back(onMap[1]);
  bake.caches.lightmap.parts = onMap;
  bake.surfels.instance = std::vector<std::uint32_t>{0, 0, 0, 0, 1, 2};
  bake.surfels.emission = withElement(bake.surfels.emission, 5, glm::vec3(40, 40, 32));
  return bake;
}

TEST(CompareLight, aNumberedEmitterIsFoundByWhatItIsAndWhere) {
  const Bake a = numberedLamps("unnamed node 0", "unnamed node 1"),
             b = numberedLamps("unnamed node 1", "unnamed node 2");
  const LightDifference light = difference(a, b);
  EXPECT_EQ(lighting(light, "emitter unnamed node 1").was, "unnamed node 0");
  EXPECT_EQ(lighting(light, "emitter unnamed node 2").was, "unnamed node 1");
  EXPECT_EQ(light.maxRmse, 0.0);
}

TEST(CompareLight, anEmitterElsewhereOrOfOtherPowerIsAnother) {
  Bake moved = makeSmallBake(), stronger = makeSmallBake();
  for (Bake* b : {&moved, &stronger}) editInstance(*b, 1, [](BakedInstance& i) { i.node = "other"; });
  for (const std::uint32_t i : {4u, 5u}) {
    moved.surfels.positionWorld = withElement(moved.surfels.positionWorld, i, glm::vec3(9, 2, 0.5f));
    stronger.surfels.emission = withElement(stronger.surfels.emission, i, glm::vec3(50, 50, 40));
  }
  for (const Bake& b : {moved, stronger}) {
    const LightDifference light = difference(makeSmallBake(), b);
    EXPECT_EQ(lighting(light, "emitter lamp").rmse, 1.0) << "only A has it";
    EXPECT_EQ(lighting(light, "emitter other").meanA, 0.0) << "only B has it";
    EXPECT_EQ(lighting(light, "emitter other").rmse, kBeyondBounds);
    EXPECT_EQ(lighting(light, "emitter other").was, "");
  }
}

TEST(CompareLight, halvedTransfersHalveTheLight) {
  Bake b = blackBake();
  scaleLinks(b, 0, 6, 0.5f);
  const LightDifference light = difference(blackBake(), b);
  for (const char* name : {"sky", "emitter lamp"}) {
    const LightingDifference& l = lighting(light, name);
    EXPECT_NEAR(l.rmse, 0.5, 1e-3) << name;
    EXPECT_NEAR(l.meanB, 0.5 * l.meanA, 1e-3 * l.meanA) << name;
    // L* of half the light: 116 (1 - 0.5^(1/3)) less where it was white.
    EXPECT_NEAR(l.maxDeltaE, 116.0 * (1.0 - std::cbrt(0.5)), 2.5) << name;
  }
  EXPECT_EQ(lighting(light, "sun 1").rmse, 0.0) << "black surfaces reflect nothing";
}

TEST(CompareLight, theWorstPlaceIsTheCacheThatChangedWithItsNode) {
  Bake b = blackBake();
  scaleLinks(b, 4, 5, 2.0f);
  const LightDifference light = difference(blackBake(), b);
  ASSERT_EQ(light.worst.size(), 1u);
  EXPECT_EQ(light.worst[0].positionWorld, blackBake().caches.positionWorld[4]);
  EXPECT_EQ(light.worst[0].node, "floor");
  EXPECT_NEAR(light.worst[0].change, 1.0 / 1.05, 0.03) << "twice the light, over it and a twentieth of the mean";
  EXPECT_GT(light.worst[0].b.y, 1.9f * light.worst[0].a.y);
  ASSERT_FALSE(light.nodes.empty());
  EXPECT_EQ(light.nodes[0].node, "floor");
}

TEST(CompareLight, cachesMatchByPlaceNotByNumber) {
  // The strong cache is number 4 of A and number 2 of B, at one place; their rows have the same nodes.
  Bake a = blackBake(), b = blackBake();
  scaleLinks(a, 4, 5, 2.0f);
  scaleLinks(b, 2, 3, 2.0f);
  std::vector<glm::vec3> places = b.caches.positionWorld.toVector();
  std::swap(places[2], places[4]);
  b.caches.positionWorld = places;
  const LightDifference light = difference(a, b);
  EXPECT_EQ(light.match.pairs.size(), 6u);
  EXPECT_EQ(light.maxChange, 0.0);
}

TEST(CompareLight, otherKindsOfLinksCompare) {
  Bake b = makeSmallBake();
  const Result<Links> packed = compactLinks(b.links);
  ASSERT_TRUE(packed) << packed.error().message;
  b.links = *packed;
  const LightDifference light = difference(makeSmallBake(), b);
  EXPECT_LT(light.maxRmse, 0.2) << "six bytes in place of twelve";
  EXPECT_GT(light.maxRmse, 0.0);
}

TEST(CompareLight, farAndTurnedCachesHaveNoPartner) {
  Bake b = blackBake();
  b.caches.positionWorld = withElement(b.caches.positionWorld, 5, glm::vec3(50, 0, 50));
  b.caches.normal = withElement(b.caches.normal, 4, glm::vec3(0, -1, 0));
  const LightDifference light = difference(blackBake(), b);
  EXPECT_EQ(light.match.onlyInB, 2u);
  EXPECT_LE(light.match.pairs.size(), 6u);
  EXPECT_FALSE(light.unmatched);
  Bake far = blackBake();
  std::vector<glm::vec3> places = far.caches.positionWorld.toVector();
  for (glm::vec3& p : places) p += glm::vec3(1000, 0, 0);
  far.caches.positionWorld = places;
  EXPECT_TRUE(difference(blackBake(), far).unmatched);
}

// Caches of a grid over a floor of surfels, half of them close to it.
Bake gridOverFloor(float lowest, float highest) {
  Bake bake;
  std::vector<glm::vec3> surfels, caches;
  for (int i = 0; i < 32 * 32; ++i) surfels.emplace_back(0.25f * (i % 32), 0.0f, 0.25f * (i / 32));
  for (int i = 0; i < 4 * 4 * 2; ++i)
    caches.emplace_back(2.0f * (i % 4), i < 16 ? lowest : highest, 2.0f * (i / 4 % 4));
  bake.surfels.areaEach = 0.0625f;
  bake.surfels.positionWorld = surfels;
  bake.surfels.emission = std::vector<glm::vec3>(surfels.size(), glm::vec3(0.0f));
  bake.caches.normal = std::vector<glm::vec3>(caches.size(), glm::vec3(0.0f));
  bake.caches.positionWorld = caches;
  return bake;
}

TEST(CompareLight, lampsKeepOffSurfacesWhereTheyCan) {
  const auto heights = [](const Bake& bake) {
    std::vector<float> found;
    for (const Lighting& each : makeLightings(bake, bake))
      if (each.group == "points") found.push_back(each.lights[0].positionWorld.y);
    return found;
  };
  EXPECT_EQ(heights(gridOverFloor(0.1f, 2.0f)), std::vector<float>(8, 2.0f)) << "three widths are 0.75 m";
  EXPECT_EQ(heights(gridOverFloor(0.1f, 0.1f)), std::vector<float>(8, 0.1f)) << "there is no other place";
}

// Nothing that was compared is not the same as no difference.
TEST(CompareLight, bakesWithoutCachesDoNotPassForOthers) {
  Bake none = makeSmallBake();
  none.caches = {};
  none.links = {};
  none.links.rowBegin = std::vector<std::uint32_t>{0};
  none.surfels.receiver = std::vector<std::uint32_t>(6, kGridReceiver);
  for (const Finding& finding : validateBake(none))
    ASSERT_NE(finding.severity, FindingSeverity::error) << toString(finding);
  EXPECT_TRUE(difference(none, makeSmallBake()).unmatched);
  EXPECT_TRUE(difference(makeSmallBake(), none).unmatched);
  EXPECT_FALSE(difference(none, none).unmatched);
}

TEST(CompareLight, ignoredLightingsAndNodesDoNotCount) {
  Bake b = blackBake();
  scaleLinks(b, 4, 5, 2.0f);
  EXPECT_GT(difference(blackBake(), b).maxRmse, 0.1);
  EXPECT_EQ(difference(blackBake(), b, {"sky", "emitters"}).maxRmse, 0.0);
  EXPECT_EQ(difference(blackBake(), b, {"sky", "emitter lamp"}).maxChange, 0.0);
  EXPECT_EQ(difference(blackBake(), b, {"node:floor"}).maxChange, 0.0);
  Bake renamed = b;
  editInstance(renamed, 0, [](BakedInstance& i) { i.node = "ground"; });
  EXPECT_EQ(difference(blackBake(), renamed, {"node:ground"}).maxChange, 0.0) << "B's name of A's floor";
  EXPECT_GT(difference(blackBake(), renamed, {"node:lamp"}).maxChange, 0.1);
  Context context;
  const Result<LightDifference> unknown = compareLight(b, b, nullptr, {{"moon"}}, context);
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::usage);
  EXPECT_NE(unknown.error().message.find("\"moon\""), std::string::npos);
  const Status nameless = checkIgnore({{"node:floor", "node:"}}, b, b, context);
  ASSERT_FALSE(nameless);
  EXPECT_EQ(nameless.error().code, ErrorCode::usage);
  EXPECT_NE(nameless.error().message.find("the name of a node"), std::string::npos) << nameless.error().message;
}

TEST(CompareLight, sameNumbersAtAnyThreadCount) {
  Bake b = makeSmallBake();
  scaleLinks(b, 3, 4, 2.0f);
  Context context;
  context.threads = 3;
  const Result<LightDifference> many = compareLight(makeSmallBake(), b, nullptr, {}, context);
  const LightDifference one = difference(makeSmallBake(), b);
  ASSERT_TRUE(many);
  for (std::size_t i = 0; i < one.lightings.size(); ++i) EXPECT_EQ(one.lightings[i].rmse, many->lightings[i].rmse);
}

TEST(CompareLight, theRuntimeKnowsTheSceneAndRefusesOtherFormats) {
  const Result<Relighter> relighter = Relighter::create(makeSmallBake(), {});
  ASSERT_TRUE(relighter);
  EXPECT_EQ(relighter->sceneHash(), 99u);
  Result<std::vector<std::byte>> bytes = serializeBake(makeSmallBake());
  ASSERT_TRUE(bytes);
  (*bytes)[8] = std::byte{200};
  const Result<Bake> other = parseBake(*bytes, nullptr);
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().code, ErrorCode::unsupported);
  EXPECT_NE(other.error().message.find("format version 200"), std::string::npos) << other.error().message;
}

TEST(CompareReport, followsThePublishedSchemaAndTheSchemaBites) {
  std::ifstream file(RELUME_SOURCE_DIR "/docs/compare.schema.json");
  SchemaCheck schema(Json::parse(file));
  Bake other = makeSmallBake(LinkKind::sh);
  editInstance(other, 0, [](BakedInstance& i) { i.transformHash = i.contentHash = 5; });
  other.provenance.optionsJson = "{\"links\":{\"pull\":\"area\"},\"seed\":8}";
  other.provenance.cameraHash ^= 1;  // of cameras that only look
  const BakeFile a = fileOf(makeSmallBake(), "a"), b = fileOf(other, "b");
  CompareBounds bounds;
  bounds.maxRmse = 1e-6;
  Json report = reportDifference(a, b, difference(a.bake, b.bake), {{"sky"}}, bounds);
  EXPECT_EQ(schema.check(report), std::vector<std::string>{});
  EXPECT_EQ(schema.check(reportSame("a", "b", 7, {}, {})), std::vector<std::string>{});
  EXPECT_EQ(report["baked"]["options"][0]["name"], "seed");
  EXPECT_EQ(report["baked"]["viewsChanged"], true);
  EXPECT_EQ(report["baked"]["sceneParts"][0]["text"], "node \"floor\" moved");
  EXPECT_TRUE(boundExceeded(report));

  Json broken = report;
  broken["light"]["surplus"] = 1;
  broken["a"].erase("bytes");
  broken["verdict"]["exceeded"].push_back("mood");
  EXPECT_EQ(schema.check(broken).size(), 3u);

  const std::string text = reportAsText(report);
  std::size_t at = 0;
  for (const char* heading :
       {"What was baked:", "Sizes:", "Arrays:", "Light (", "Worst places:", "Receivers:", "Verdict:"}) {
    const std::size_t found = text.find(heading, at);
    ASSERT_NE(found, std::string::npos) << heading << " missing or out of order\n" << text;
    at = found;
  }
}

// Surfaces that absorb nothing and see more of each other than there is to see: each bounce adds light.
TEST(CompareReport, saysWhichLightingsDidNotConverge) {
  std::ifstream file(RELUME_SOURCE_DIR "/docs/compare.schema.json");
  SchemaCheck schema(Json::parse(file));
  Bake growing = makeSmallBake();
  growing.surfels.albedo = std::vector<glm::vec3>(6, glm::vec3(1.0f));
  scaleLinks(growing, 0, 6, 1.9f);
  const BakeFile settled = fileOf(makeSmallBake(), "settled"), other = fileOf(blackBake(), "other"),
                 white = fileOf(growing, "white");
  for (const bool converges : {true, false}) {
    const BakeFile& b = converges ? other : white;
    const LightDifference light = difference(settled.bake, b.bake);
    const Json report = reportDifference(settled, b, light, {}, {});
    EXPECT_EQ(schema.check(report), std::vector<std::string>{});
    for (const Json& l : report["light"]["lightings"]) EXPECT_EQ(l["converged"], converges) << l["name"];
    for (const std::string& said : {reportAsText(report), reportAsPage(report, settled, b, &light, {})}) {
      EXPECT_EQ(said.find("to convergence") != std::string::npos, converges) << said;
      EXPECT_EQ(said.find("at most 1024 frames") != std::string::npos, !converges) << said;
      EXPECT_EQ(said.find("(not converged)") != std::string::npos, !converges) << said;
    }
  }
}

// Arrays that one of the bakes lacks, whichever it is; no certificate is not an error of 0.
TEST(CompareReport, listsWhatOneBakeAloneHas) {
  std::ifstream file(RELUME_SOURCE_DIR "/docs/compare.schema.json");
  SchemaCheck schema(Json::parse(file));
  const BakeFile plain = fileOf(makeSmallBake(), "plain"), drivable = fileOf(makeSmallDrivableBake(), "drivable");
  for (const bool back : {false, true}) {
    const BakeFile &a = back ? drivable : plain, &b = back ? plain : drivable;
    const Json report = reportDifference(a, b, difference(a.bake, b.bake), {}, {});
    EXPECT_EQ(schema.check(report), std::vector<std::string>{});
    std::size_t found = 0;
    for (const Json& array : report["sizes"]["arrays"]) {
      if (array["array"] != "emit.surfel") continue;
      ++found;
      EXPECT_EQ(array["same"], false);
      EXPECT_EQ(array[back ? "b" : "a"], 0);
      EXPECT_GT(array[back ? "a" : "b"], 0);
    }
    EXPECT_EQ(found, 1u);
    EXPECT_NE(reportAsText(report).find("emit.surfel"), std::string::npos) << reportAsText(report);
    EXPECT_TRUE(report["arrays"]["certifiedError"]["a"].is_null());
    EXPECT_NE(reportAsText(report).find("none -> none"), std::string::npos) << reportAsText(report);
  }
}

TEST(ComparePage, hasEveryPanelAndNothingFromOutside) {
  Bake other = makeSmallBake();
  editInstance(other, 1, [](BakedInstance& i) { i.node = std::string("<script>lamp & \"co\"\x1b\0", 21); });
  scaleLinks(other, 2, 4, 0.5f);
  const BakeFile a = fileOf(makeSmallBake(), "a"), b = fileOf(other, "b");
  const LightDifference light = difference(a.bake, b.bake);
  const Json report = reportDifference(a, b, light, {}, {});
  const RunReports runs = {Json::parse(R"({"stages":[{"stage":"links","seconds":1.5}]})"), Json()};
  const std::string page = reportAsPage(report, a, b, &light, runs);
  for (const char* id :
       {"verdict", "plan", "maps", "histograms", "receivers", "light", "baked", "sizes", "arrays", "stages"})
    EXPECT_NE(page.find("<section id=\"" + std::string(id) + "\">"), std::string::npos) << id;
  EXPECT_EQ(page.find("<script"), std::string::npos);
  EXPECT_EQ(page.find_first_of(std::string("\x1b\0", 2)), std::string::npos) << "bytes that HTML forbids";
  EXPECT_NE(page.find("\\x1b\\x00"), std::string::npos) << "and named";
  for (const char* outside : {"http:", "https:", "url(", "@import"})
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  std::size_t images = 0;
  for (std::size_t at = page.find("src=\""); at != std::string::npos; at = page.find("src=\"", at + 1), ++images)
    EXPECT_EQ(page.substr(at + 5, 22), "data:image/png;base64,");
  EXPECT_EQ(images, 3 * light.lightings.size() + 1);
  CompareBounds bounds;
  bounds.maxRmse = bounds.maxCacheChange = 0.0;
  const Json exceeded = reportDifference(a, b, light, {{"suns", "node:a & b"}}, bounds);
  const std::string bad = reportAsPage(exceeded, a, b, &light, runs);
  EXPECT_NE(bad.find("<p>Exceeded: relative RMSE of a lighting, relative change of a cache</p>"), std::string::npos);
  EXPECT_NE(bad.find("<p>Ignored: suns, node:a &amp; b</p>"), std::string::npos);
  const std::string same = reportAsPage(reportSame("a", "b", 7, {}, {}), a, b, nullptr, {});
  EXPECT_NE(same.find("Same bytes"), std::string::npos);
}

TEST(CompareReport, aBoundOfZeroHasNoSign) {
  const BakeFile a = fileOf(makeSmallBake(), "zero_a"), b = fileOf(blackBake(), "zero_b");
  CompareBounds bounds;
  bounds.maxRmse = bounds.maxCacheChange = bounds.maxReceiverChange = -0.0;
  const Json report = reportDifference(a, b, difference(a.bake, b.bake), {}, bounds);
  for (const char* bound : {"maxRmse", "maxCacheChange", "maxReceiverChange"})
    EXPECT_FALSE(std::signbit(report["verdict"][bound].get<double>())) << bound;
  EXPECT_NE(reportAsText(report).find("bound 0: EXCEEDED"), std::string::npos) << reportAsText(report);
  EXPECT_EQ(reportAsText(report).find("bound -0"), std::string::npos) << reportAsText(report);
}

TEST(CompareReport, aHostsCommasChangeNothing) {
  Bake other = makeSmallBake();
  scaleLinks(other, 2, 4, 0.5f);
  const BakeFile a = fileOf(makeSmallBake(), "a"), b = fileOf(other, "b");
  CompareBounds bounds;
  bounds.maxRmse = 0.125;
  const auto write = [&] {
    const LightDifference light = difference(a.bake, b.bake);
    const Json report = reportDifference(a, b, light, {}, bounds);
    return report.dump() + "\n" + reportAsText(report) + "\n" + reportAsPage(report, a, b, &light, {});
  };
  const std::string before = write();
  const test::CommaLocale commas;
  EXPECT_EQ(write(), before);
  if (!commas.ofC()) GTEST_SKIP() << test::kNoCommaLocale;
}

}  // namespace
}  // namespace relume
