// SPDX-License-Identifier: MIT
// The whole bake, end to end: the same scene, options and seed give the same bytes at 1 and 2 threads and twice over,
// and what comes out keeps every invariant.
#include "formats/validate.h"
#include "relume/bake/bake.h"
#include "relume/bake_file.h"
#include "tests/cli/make_gltf.h"
#include "tests/long_tests.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace relume {
namespace {

namespace fs = std::filesystem;

BakeOptions tinyOptions() {
  BakeOptions options = presetOptions(Preset::draft);
  options.playSpace.walks = 4096;
  options.surfels.count = 1024;
  options.caches.gridCaches = 64;
  options.caches.lightmapCaches = 256;
  options.links.raysPerCache = 256;
  return options;
}

// Bake and serialise; the error's message in place of bytes when the scene is refused.
std::vector<std::byte> bakeBytes(const fs::path& path, const BakeOptions& options, int threads, std::string& refused) {
  Context context;
  context.threads = threads;
  const Result<Scene> scene = importGltf(path, context);
  if (!scene) return refused = scene.error().message, std::vector<std::byte>{};
  const Result<Bake> baked = bake(*scene, options, context);
  if (!baked) return refused = baked.error().message, std::vector<std::byte>{};
  for (const Finding& finding : validateBake(*baked)) {
    EXPECT_NE(finding.severity, FindingSeverity::error) << path << ": " << toString(finding);
  }
  const Result<std::vector<std::byte>> bytes = serializeBake(*baked);
  EXPECT_TRUE(bytes) << bytes.error().message;
  return bytes ? *bytes : std::vector<std::byte>{};
}

void expectSameBytes(const fs::path& path, const BakeOptions& options) {
  SCOPED_TRACE(path.string());
  std::string refused, refusedAgain;
  const auto one = bakeBytes(path, options, 1, refused);
  EXPECT_TRUE(!one.empty() || !refused.empty());
  for (const int threads : {2, 2}) {
    refusedAgain.clear();
    EXPECT_TRUE(bakeBytes(path, options, threads, refusedAgain) == one) << threads << " threads";
    EXPECT_EQ(refusedAgain, refused);
  }
}

fs::path writeRoom() {
  const fs::path path = fs::path(testing::TempDir()) / "relume_pipeline_room.gltf";
  std::ofstream(path) << makeGltf({});
  return path;
}

TEST(Pipeline, ownRoomGivesTheSameBytesAtAnyThreadCount) {
  const fs::path room = writeRoom();
  BakeOptions options = tinyOptions();
  expectSameBytes(room, options);
  options.links.kind = LinkKind::sh;
  expectSameBytes(room, options);
}

TEST(Pipeline, everyPlacementAndClusteringIsDeterministic) {
  const fs::path room = writeRoom();
  for (const auto placement :
       {SurfelOptions::Placement::halton, SurfelOptions::Placement::relaxed, SurfelOptions::Placement::eliminated}) {
    for (const auto method : {ClusteringOptions::Method::approximate, ClusteringOptions::Method::exact}) {
      BakeOptions options = tinyOptions();
      options.surfels.placement = placement;
      options.clustering.method = method;
      expectSameBytes(room, options);
    }
  }
}

TEST(Pipeline, seedChangesTheBytes) {
  const fs::path room = writeRoom();
  BakeOptions options = tinyOptions();
  std::string refused;
  const auto first = bakeBytes(room, options, 0, refused);
  options.seed = 2;
  EXPECT_FALSE(bakeBytes(room, options, 0, refused) == first);
}

TEST(Pipeline, provenanceNamesPartsAndFollowsContent) {
  Context context;
  const fs::path path = fs::path(testing::TempDir()) / "relume_pipeline_content.gltf";
  const auto provenanceOf = [&](const GltfParts& parts) {
    std::ofstream(path) << makeGltf(parts);
    const Result<Scene> scene = importGltf(path, context);
    EXPECT_TRUE(scene);
    Result<Bake> baked = bake(*scene, tinyOptions(), context);
    EXPECT_TRUE(baked) << baked.error().message;
    return std::pair{baked->instances[0], baked->provenance};
  };
  const auto [part, provenance] = provenanceOf({});
  EXPECT_EQ(part.node, "Room");
  EXPECT_EQ(provenance.optionsJson, optionsToJson(tinyOptions()));
  EXPECT_EQ(provenance.toolVersion.empty(), false);
  GltfParts moved;
  moved.room.position[0][0] += 0.001f;
  EXPECT_NE(provenanceOf(moved).first.contentHash, part.contentHash);
  EXPECT_NE(provenanceOf(moved).second.sceneHash, provenance.sceneHash);
  GltfParts painted;
  painted.material = "{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.7,0.6,0.4,1]}}";
  EXPECT_NE(provenanceOf(painted).first.contentHash, part.contentHash);
  EXPECT_EQ(provenanceOf({}).first.contentHash, part.contentHash);
}

TEST(Pipeline, conformanceScenesBakeTheSameOrAreRefusedTheSame) {
  const fs::path folder = fs::path(RELUME_SHARED_DIR) / "scenes" / "conformance" / "made";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " does not exist (set RELUME_SHARED_DIR)";
  BakeOptions options = tinyOptions();
  options.surfels.count = 256;
  options.caches.lightmapCaches = 64;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string extension = entry.path().extension().string();
    if ((extension == ".glb" || extension == ".gltf") && fs::file_size(entry.path()) < 200000)
      expectSameBytes(entry.path(), options);
  }
}

TEST(Pipeline, cornellGivesTheSameBytes) {
  const fs::path path = fs::path(RELUME_SHARED_DIR) / "scenes/cornell/cornell.glb";
  if (!fs::exists(path)) GTEST_SKIP() << path << " does not exist (set RELUME_SHARED_DIR)";
  expectSameBytes(path, tinyOptions());
}

TEST(Pipeline, sponzaAtTheHighPresetGivesTheSameBytes) {
  const fs::path path = fs::path(RELUME_SHARED_DIR) / "scenes/sponza/sponza.glb";
  if (!test::longTests()) GTEST_SKIP() << "a long test: set RELUME_LONG_TESTS=1";
  if (!fs::exists(path)) GTEST_SKIP() << path << " does not exist (set RELUME_SHARED_DIR)";
  expectSameBytes(path, presetOptions(Preset::high));
}

TEST(Pipeline, cancelledBakeSaysSo) {
  Context context;
  const Result<Scene> scene = importGltf(writeRoom(), context);
  ASSERT_TRUE(scene);
  // Cancel at the begin of each stage in turn.
  for (const std::string stage : {"play space", "surfels", "hierarchy", "caches", "links", "receivers"}) {
    Context cancelling;
    cancelling.onProgress = [&](std::string_view name, double) { return name != stage; };
    const Result<Bake> baked = bake(*scene, tinyOptions(), cancelling);
    ASSERT_FALSE(baked) << stage;
    EXPECT_EQ(baked.error().code, ErrorCode::failed);
    EXPECT_EQ(baked.error().message, "cancelled") << stage;
  }
}

}  // namespace
}  // namespace relume
