// SPDX-License-Identifier: MIT
// What makes a bake out of date and what does not: options, versions, cameras, exporters' noise, another level.
#include "relume/bake/provenance.h"
#include "relume/bake_file.h"
#include "tests/pipeline/provenance_level.h"
#include "tools/compare/fit_bake.h"
#include "tools/compare/staleness.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relume {
namespace {

using relume::testing::GltfBuilder;
using test::Baked;
using test::bakeLevel;
using test::makeBase;
using test::sameButCameras;
using test::tinyOptions;
using test::withNoise;
using Json = nlohmann::json;

TEST(Provenance, materialsThatNobodyUsesChangeNothing) {
  GltfBuilder base = makeBase();
  const std::optional<Baked> before = bakeLevel(*base.import());
  ASSERT_TRUE(before);
  base.root["materials"][2]["alphaMode"] = "OPAQUE";
  const std::optional<Baked> now = bakeLevel(*base.import());
  EXPECT_TRUE(now && now->bytes == before->bytes);
}

TEST(Provenance, whereTheFilePutsWhatMovesChangesNothing) {
  GltfBuilder base = makeBase();
  Json& node = base.root["nodes"][1];
  node["extras"]["relume"]["bake"] = "dynamic";
  const std::optional<Baked> before = bakeLevel(*base.import());
  ASSERT_TRUE(before);
  node["translation"] = {30, 2, -1};
  node["rotation"] = {0, 1, 0, 0};
  const Result<Scene> moved = base.import();
  EXPECT_TRUE(findStaleness(*moved, nullptr, before->bake).upToDate());
  const std::optional<Baked> now = bakeLevel(*moved);
  EXPECT_TRUE(now && now->bytes == before->bytes);
  node["extras"]["relume"]["bake"] = "static";
  EXPECT_FALSE(findStaleness(*base.import(), nullptr, before->bake).upToDate());
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

// A bake that is read all the same is warned of without the advice of one that is refused.
TEST(Provenance, aStaleBakeThatIsReadIsOneWarning) {
  GltfBuilder base = makeBase();
  const std::optional<Baked> baked = bakeLevel(*base.import());
  ASSERT_TRUE(baked);
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "relume_stale_read.relume";
  ASSERT_TRUE(writeBake(baked->bake, file));
  base.node({{"name", "New"}, {"mesh", 1}});
  Result<Scene> scene = base.import();
  ASSERT_TRUE(scene);
  std::vector<std::string> warnings;
  Context context;
  context.onMessage = [&](Severity, std::string_view text) { warnings.emplace_back(text); };
  for (const bool isExported : {false, true}) {
    if (isExported) scene->exportedWith = 1;
    const auto refused = readBakeOf(*scene, file.string(), "new.glb", false, context);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find(", or give --allow-stale"), std::string::npos) << refused.error().message;
    EXPECT_TRUE(warnings.empty());
    ASSERT_TRUE(readBakeOf(*scene, file.string(), "new.glb", true, context));
    ASSERT_EQ(warnings.size(), 1u);
    const std::string said = std::exchange(warnings, {}).front();
    for (const char* word : {"new.glb", "; used all the same (--allow-stale): 2 of 3 parts found by name, the others "})
      EXPECT_NE(said.find(word), std::string::npos) << said;
    for (const char* word : {"or give --allow-stale", "was refused", "bake again", "give the level"})
      EXPECT_EQ(said.find(word), std::string::npos) << said;
  }
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace relume
