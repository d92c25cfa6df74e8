// SPDX-License-Identifier: MIT
// What receivers read: bakes that hold the same light in the same caches, and hand it to other surfaces, differ.
#include "relume/bake/bake.h"
#include "tools/compare/compare_light.h"
#include "tools/compare/compare_report.h"
#include "tools/compare/compare_scene.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <ostream>

namespace relume {
namespace {

Scene importLevel() {
  Context context;
  Result<Scene> scene = importGltf(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb", context);
  EXPECT_TRUE(scene) << scene.error().message;
  return std::move(*scene);
}

const Scene& level() {
  static const Scene kScene = importLevel();
  return kScene;
}

BakeOptions smallOptions() {
  BakeOptions options = presetOptions(Preset::draft);
  options.playSpace.walks = 4096;
  options.surfels.count = 1024;
  options.caches.gridCaches = 64;
  options.caches.lightmapCaches = 512;
  options.links.raysPerCache = 256;
  return options;
}

const Bake& original() {
  static const Bake kBake = [] {
    Context context;
    Result<Bake> baked = bake(level(), smallOptions(), context);
    EXPECT_TRUE(baked) << baked.error().message;
    return std::move(*baked);
  }();
  return kBake;
}

LightDifference difference(const Bake& a, const Bake& b, const Scene* scene) {
  Context context;
  context.threads = 1;
  Result<LightDifference> light = compareLight(a, b, scene, {}, context);
  EXPECT_TRUE(light) << light.error().message;
  return light ? std::move(*light) : LightDifference{};
}

bool onMap(const Bake& bake, std::size_t part) {
  const LightmapPart& p = bake.caches.lightmap.parts[part];
  for (std::uint64_t k = 0; k < std::uint64_t{3} * p.triangleCount; ++k) {
    if (bake.caches.lightmap.cornerUv[p.firstCorner + k] != kGridLit) return true;
  }
  return false;
}

std::vector<std::size_t> partsOnMap(const Bake& bake) {
  std::vector<std::size_t> parts;
  for (std::size_t i = 0; i < bake.caches.lightmap.parts.size(); ++i) {
    if (onMap(bake, i)) parts.push_back(i);
  }
  return parts;
}

void shuffleCorners(Bake& bake) {
  std::vector<std::uint32_t> corners = bake.caches.lightmap.cornerUv.toVector();
  std::rotate(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(corners.size() / 2), corners.end());
  bake.caches.lightmap.cornerUv = corners;
}

void mirrorCorners(Bake& bake) {
  std::vector<std::uint32_t> corners = bake.caches.lightmap.cornerUv.toVector();
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) std::swap(corners[i], corners[i + 2]);
  bake.caches.lightmap.cornerUv = corners;
}

// The part with the most of the map.
void movePartToGrid(Bake& bake) {
  std::vector<std::uint32_t> corners = bake.caches.lightmap.cornerUv.toVector();
  const std::vector<std::size_t> parts = partsOnMap(bake);
  const LightmapPart& p = bake.caches.lightmap.parts[parts[0]];
  std::fill_n(corners.begin() + static_cast<std::ptrdiff_t>(p.firstCorner), 3 * p.triangleCount, kGridLit);
  bake.caches.lightmap.cornerUv = corners;
}

void moveAllToGrid(Bake& bake) {
  bake.caches.lightmap.cornerUv = std::vector<std::uint32_t>(bake.caches.lightmap.cornerUv.size(), kGridLit);
}

void recommendFewerBands(Bake& bake) { bake.provenance.lumaBands = bake.provenance.chromaBands = 1; }

void swapParts(Bake& bake) {
  std::vector<LightmapPart> parts = bake.caches.lightmap.parts.toVector();
  const std::vector<std::size_t> found = partsOnMap(bake);
  ASSERT_GE(found.size(), 2u);
  std::swap(parts[found[0]], parts[found[1]]);
  bake.caches.lightmap.parts = parts;
}

void shiftNames(Bake& bake) {
  std::vector<BakedInstance> shifted = bake.instances.toVector();
  for (std::size_t i = 0; i < shifted.size(); ++i) {
    shifted[i].node = bake.instances[(i + 1) % shifted.size()].node;
    shifted[i].mesh = bake.instances[(i + 1) % shifted.size()].mesh;
  }
  bake.instances = shifted;
}

void shiftNodesAlone(Bake& bake) {
  std::vector<BakedInstance> shifted = bake.instances.toVector();
  for (std::size_t i = 0; i < shifted.size(); ++i) shifted[i].node = bake.instances[(i + 1) % shifted.size()].node;
  bake.instances = shifted;
}

void emptyGrid(Bake& bake) {
  CacheGrid& grid = bake.caches.grid;
  grid.cache = std::vector<std::uint32_t>(grid.cache.size(), kNoCache);
  grid.fine = std::vector<std::uint32_t>(grid.fine.size(), kNoCache);
}

struct Mutation {
  const char* name;
  void (*apply)(Bake&);
  double min;              // change to be found, relative
  bool sameCaches = true;  // the caches gather the same light: only receivers can tell
  friend std::ostream& operator<<(std::ostream& out, const Mutation& m) { return out << m.name; }
};

class ReceiverMutation : public testing::TestWithParam<Mutation> {};

TEST_P(ReceiverMutation, findsIt) {
  Bake changed = original();
  GetParam().apply(changed);
  for (const Scene* scene : {static_cast<const Scene*>(nullptr), &level()}) {
    const LightDifference light = difference(original(), changed, scene);
    EXPECT_TRUE(light.receivers.unmatched || light.maxReceiverChange > GetParam().min)
        << light.maxReceiverChange << (scene ? " with" : " without") << " a scene";
    EXPECT_TRUE(!GetParam().sameCaches || light.maxRmse == 0.0) << light.maxRmse;
    const LightDifference back = difference(changed, original(), scene);
    EXPECT_TRUE(back.receivers.unmatched || back.maxReceiverChange > GetParam().min) << "the other way round";
  }
}

INSTANTIATE_TEST_SUITE_P(
    , ReceiverMutation,
    testing::Values(Mutation{"shuffledCorners", shuffleCorners, 0.5}, Mutation{"mirroredCorners", mirrorCorners, 0.1},
                    Mutation{"partMovedToGrid", movePartToGrid, 0.1}, Mutation{"allMovedToGrid", moveAllToGrid, 0.2},
                    Mutation{"recommendedBands", recommendFewerBands, 0.1}, Mutation{"swappedParts", swapParts, 0.1},
                    Mutation{"shiftedNames", shiftNames, 0.1, false},
                    Mutation{"shiftedNodes", shiftNodesAlone, 0.1, false},
                    Mutation{"emptyGrid", emptyGrid, 0.9, false}),
    [](const auto& test) { return std::string(test.param.name); });

TEST(CompareReceivers, sameTransportReadsExactlyTheSame) {
  Bake other = original();
  other.provenance.toolVersion = "9.9.9";
  for (const Scene* scene : {static_cast<const Scene*>(nullptr), &level()}) {
    const LightDifference light = difference(original(), other, scene);
    EXPECT_EQ(light.maxReceiverChange, 0.0);
    EXPECT_TRUE(light.worstReceivers.empty());
    EXPECT_FALSE(light.receivers.unmatched);
    EXPECT_EQ(light.receivers.partsOnlyInA + light.receivers.partsOnlyInB + light.receivers.partsReshaped, 0u);
    EXPECT_GT(light.receivers.list.size(), 10000u);
  }
}

// Every part that has a place on the map has receivers there, and they lie on the surface that a scene would give.
TEST(CompareReceivers, standOnTheSurfacesOfEveryPart) {
  const Receivers bare = placeReceivers(original(), original(), nullptr);
  const Receivers exact = placeReceivers(original(), original(), &level());
  for (const std::size_t part : partsOnMap(original())) {
    for (const Receivers* receivers : {&bare, &exact}) {
      EXPECT_TRUE(std::any_of(receivers->list.begin(), receivers->list.end(), [&](const Receiver& r) {
        return r.a.onMap && receivers->groups[r.group].node == original().instances[part].node;
      })) << original().instances[part].node;
    }
  }
  // Without a scene, places come from the texels' caches: within a texel of the surface.
  constexpr std::size_t kEvery = 50;
  constexpr float kTexel = 1.0f;  // [m]
  std::size_t asked = 0, far = 0;
  for (std::size_t i = 0; i < bare.list.size(); i += kEvery) {
    if (!bare.list[i].a.onMap) continue;
    ++asked;
    far += std::none_of(exact.list.begin(), exact.list.end(), [&](const Receiver& r) {
      return r.a.onMap && glm::distance(r.a.positionWorld, bare.list[i].a.positionWorld) < kTexel;
    });
  }
  EXPECT_GT(asked, 100u);
  EXPECT_LT(far, asked / 20);
}

TEST(CompareReceivers, nodesThatAreIgnoredDoNotCount) {
  Bake changed = original();
  swapParts(changed);
  const std::vector<std::size_t> found = partsOnMap(original());
  LightIgnore ignore;
  for (const std::size_t i : {found[0], found[1]}) ignore.names.push_back("node:" + original().instances[i].node);
  Context context;
  const Result<LightDifference> light = compareLight(original(), changed, nullptr, ignore, context);
  ASSERT_TRUE(light);
  EXPECT_EQ(light->maxReceiverChange, 0.0);
}

// Receivers that do not count do not change what the others are measured by.
TEST(CompareReceivers, nodesThatAreIgnoredAreAsIfTheyWereNotThere) {
  Bake changed = original();
  swapParts(changed);
  const Receivers all = placeReceivers(original(), changed, nullptr);
  Receivers few = all;
  const std::uint32_t kept = all.list.front().group;
  std::erase_if(few.list, [&](const Receiver& r) { return r.group != kept; });
  ASSERT_LT(few.list.size(), all.list.size() / 2);
  std::vector<bool> none(all.groups.size(), false), others(all.groups.size(), true);
  others[kept] = false;
  Result<Relighter> a = Relighter::create(original(), {}), b = Relighter::create(changed, {});
  ASSERT_TRUE(a && b);
  LightSetup setup;
  setup.skyRadiance = glm::vec3(1.0f);
  const std::vector<Light> lights(1);
  setup.lights = lights;
  ASSERT_TRUE(a->relight(setup) && b->relight(setup));
  const GroupChange ignored = compareReceivers(all, others, *a, *b).groups[kept];
  EXPECT_GT(ignored.change, 0.0);
  EXPECT_EQ(ignored.change, compareReceivers(few, none, *a, *b).groups[kept].change);
}

// Two bakes of one level, held against each other over the surfaces of another one: there is nothing to compare on.
TEST(CompareReceivers, aSceneThatHasNoneOfThePartsComparesNone) {
  Bake changed = original();
  shuffleCorners(changed);
  Scene other = level();
  for (Instance& instance : other.instances) instance.node += " of another level";
  const LightDifference light = difference(original(), changed, &other);
  EXPECT_EQ(light.receivers.partsMatched, 0u);
  EXPECT_TRUE(light.receivers.unmatched);
}

TEST(CompareReceivers, partsThatAreGoneOrReshapedAreCounted) {
  Bake changed = original();
  std::vector<BakedInstance> parts = changed.instances.toVector();
  parts[0].node = "another";
  parts[0].transformHash ^= 1;
  changed.instances = parts;
  const LightDifference light = difference(original(), changed, nullptr);
  EXPECT_EQ(light.receivers.partsOnlyInA, 1u);
  EXPECT_EQ(light.receivers.partsOnlyInB, 1u);
  for (BakedInstance& part : parts) {
    part.node += " of another level";
    part.transformHash ^= 2;
  }
  changed.instances = parts;
  EXPECT_TRUE(difference(original(), changed, nullptr).receivers.unmatched);
}

// A part whose surfels read the grid, the one with the most of them.
std::uint32_t partInGrid(const Bake& bake) {
  std::vector<std::size_t> count(bake.instances.size());
  for (std::uint32_t i = 0; i < bake.surfels.count(); ++i)
    count[bake.surfels.instance[i]] += bake.surfels.receiver[i] == kGridReceiver;
  return static_cast<std::uint32_t>(std::max_element(count.begin(), count.end()) - count.begin());
}

std::vector<Receiver> receiversOf(const Receivers& receivers, const std::string& node) {
  std::vector<Receiver> found = receivers.list;
  std::erase_if(found, [&](const Receiver& r) { return receivers.groups[r.group].node != node; });
  return found;
}

void editPart(Bake& bake, std::size_t part, const auto& edit) {
  std::vector<BakedInstance> parts = bake.instances.toVector();
  edit(parts[part]);
  bake.instances = parts;
}

TEST(CompareReceivers, partsInTheGridThatAreGoneAreNotCompared) {
  const std::uint32_t part = partInGrid(original());
  const std::string node = original().instances[part].node;
  const Receivers there = placeReceivers(original(), original(), nullptr);
  ASSERT_FALSE(receiversOf(there, node).empty());
  Bake gone = original();
  editPart(gone, part, [](BakedInstance& p) {
    p.node = p.mesh = "another";
    p.transformHash ^= 1;
  });
  const Receivers rest = placeReceivers(original(), gone, nullptr);
  EXPECT_EQ(rest.partsOnlyInA, 1u);
  EXPECT_EQ(rest.partsMatched, there.partsMatched - 1);
  EXPECT_TRUE(receiversOf(rest, node).empty());
  EXPECT_TRUE(receiversOf(placeReceivers(gone, original(), nullptr), "another").empty());
}

// At the places where B has it, and not where it was in A.
TEST(CompareReceivers, partsInTheGridThatWereMovedAreComparedWhereTheyAre) {
  const std::uint32_t part = partInGrid(original());
  const std::string node = original().instances[part].node;
  const glm::vec3 away(0.5f, 0.0f, 0.0f);
  Bake moved = original();
  editPart(moved, part, [](BakedInstance& p) { p.transformHash ^= 1; });
  std::vector<glm::vec3> places = moved.surfels.positionWorld.toVector();
  for (std::uint32_t i = 0; i < places.size(); ++i) {
    if (moved.surfels.instance[i] == part) places[i] += away;
  }
  moved.surfels.positionWorld = places;
  const auto inGrid = [&](const Bake& b) {
    std::vector<Receiver> found = receiversOf(placeReceivers(original(), b, nullptr), node);
    std::erase_if(found, [](const Receiver& r) { return r.a.onMap || r.b.onMap; });
    return found;
  };
  const std::vector<Receiver> before = inGrid(original()), now = inGrid(moved);
  ASSERT_FALSE(before.empty());
  ASSERT_EQ(now.size(), before.size());
  for (std::size_t i = 0; i < now.size(); ++i) {
    EXPECT_EQ(now[i].b.positionWorld, before[i].b.positionWorld + away);
    EXPECT_EQ(now[i].a.positionWorld, now[i].b.positionWorld);
  }
}

// Without a scene nobody knows where B has it.
TEST(CompareReceivers, partsThatWereMovedOffTheMapAreNotReadWhereTheyWere) {
  Bake moved = original();
  movePartToGrid(moved);
  const std::size_t part = partsOnMap(original())[0];
  const std::string node = original().instances[part].node;
  EXPECT_FALSE(receiversOf(placeReceivers(original(), moved, nullptr), node).empty());
  editPart(moved, part, [](BakedInstance& p) { p.transformHash ^= 1; });
  for (const Receiver& r : receiversOf(placeReceivers(original(), moved, nullptr), node)) EXPECT_FALSE(r.a.onMap);
}

// The large node that did not change does not hide the small one that did.
TEST(CompareReceivers, nodesOfOneNameAreJudgedEachByItself) {
  Bake changed = original();
  const std::vector<std::size_t> onMap = partsOnMap(original());
  const auto triangles = [](std::size_t x, std::size_t y) {
    const auto& parts = original().caches.lightmap.parts;
    return parts[x].triangleCount < parts[y].triangleCount;
  };
  const auto [small, large] = std::minmax_element(onMap.begin(), onMap.end(), triangles);
  std::vector<std::uint32_t> corners = changed.caches.lightmap.cornerUv.toVector();
  const LightmapPart& part = changed.caches.lightmap.parts[*small];
  std::fill_n(corners.begin() + static_cast<std::ptrdiff_t>(part.firstCorner), 3 * part.triangleCount, kGridLit);
  changed.caches.lightmap.cornerUv = corners;
  const LightDifference apart = difference(original(), changed, nullptr);
  ASSERT_FALSE(apart.worstReceivers.empty());
  ASSERT_EQ(apart.worstReceivers[0].group, original().instances[*small].node);

  Bake a = original();
  for (Bake* bake : {&a, &changed}) {
    for (const std::size_t i : {*small, *large}) editPart(*bake, i, [](BakedInstance& p) { p.node = "twin"; });
  }
  const LightDifference twins = difference(a, changed, nullptr);
  EXPECT_EQ(twins.maxReceiverChange, apart.maxReceiverChange);
  ASSERT_EQ(twins.worstReceivers.size(), apart.worstReceivers.size());
  EXPECT_EQ(twins.worstReceivers[0].group, *small < *large ? "twin (1 of 2)" : "twin (2 of 2)");
  EXPECT_EQ(twins.worstReceivers[0].receivers, apart.worstReceivers[0].receivers);
  Context context;
  const Result<LightDifference> ignored = compareLight(a, changed, nullptr, {{"node:twin"}}, context);
  ASSERT_TRUE(ignored);
  EXPECT_EQ(ignored->maxReceiverChange, 0.0) << "by name both are left out";
}

TEST(CompareReceivers, nodesOfOneNameAreToldApartAndTheirPrimitivesAreNot) {
  const auto part = [](const char* node, const char* mesh, std::uint64_t transform) {
    return BakedInstance{node, mesh, "", 0, transform};
  };
  const std::vector<BakedInstance> parts = {part("n", "m#0", 1),  part("n", "m#1", 1), part("n", "m#0", 2),
                                            part("n", "m#1", 2),  part("n", "m#0", 1), part("n", "m#1", 1),
                                            part("n", "rock", 1), part("x", "m#0", 1)};
  const PartNodes nodes = nodesOfParts(parts);
  EXPECT_EQ(nodes.ofPart, (std::vector<std::uint32_t>{0, 0, 1, 1, 2, 2, 3, 4}));
  EXPECT_EQ(nodes.names, (std::vector<std::string>{"n", "n", "n", "n", "x"}));
  EXPECT_EQ(nodes.texts, (std::vector<std::string>{"n (1 of 4)", "n (2 of 4)", "n (3 of 4)", "n (4 of 4)", "x"}));
}

TEST(CompareReceivers, partsThatWereRenamedAreCompared) {
  Bake changed = original();
  std::vector<BakedInstance> parts = changed.instances.toVector();
  for (BakedInstance& part : parts) part.node += " renamed";
  changed.instances = parts;
  const Receivers same = placeReceivers(original(), original(), nullptr);
  const Receivers renamed = placeReceivers(original(), changed, nullptr);
  EXPECT_EQ(renamed.partsOnlyInA + renamed.partsOnlyInB, 0u);
  EXPECT_FALSE(renamed.unmatched);
  EXPECT_EQ(renamed.list.size(), same.list.size());
  swapParts(changed);
  EXPECT_GT(difference(original(), changed, nullptr).maxReceiverChange, 0.01);
}

TEST(CompareReceivers, theVerdictNamesTheBound) {
  Bake changed = original();
  shuffleCorners(changed);
  const LightDifference light = difference(original(), changed, nullptr);
  ASSERT_FALSE(light.worstReceivers.empty());
  EXPECT_FALSE(light.worstReceivers[0].air);
  CompareBounds bounds;
  bounds.maxRmse = bounds.maxCacheChange = 0.0;
  const BakeFile a{"a", original(), {}}, b{"b", changed, {}};
  EXPECT_FALSE(boundExceeded(reportDifference(a, b, light, {}, bounds)));
  EXPECT_NE(reportAsText(reportDifference(a, b, light, {}, bounds)).find("Verdict: WITHIN BOUNDS"), std::string::npos);
  bounds.maxReceiverChange = 0.5;
  const nlohmann::json report = reportDifference(a, b, light, {}, bounds);
  EXPECT_TRUE(boundExceeded(report));
  EXPECT_EQ(report["verdict"]["exceeded"], nlohmann::json::array({"receiverChange"}));
  EXPECT_NE(reportAsText(report).find("Verdict: EXCEEDED"), std::string::npos) << reportAsText(report);
}

}  // namespace
}  // namespace relume
