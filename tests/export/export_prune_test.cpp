// SPDX-License-Identifier: MIT
// What an export leaves out: bytes that nothing refers to any more, and nothing that somebody may mean.
#include "tests/export/shared_levels.h"

#include <cstdint>
#include <vector>

namespace relume {
namespace {

using nlohmann::json;
using test::Box;
using test::Exported;
using test::isHusk;
using test::kLevel;
using test::madeLevel;
using test::someOptions;
using test::twoRooms;
using test::weldedBox;
using testing::GltfBuilder;

// What was not pruned reads as it did.
void expectSameValues(const std::filesystem::path& before, const std::filesystem::path& after) {
  Context context;
  const auto a = loadGltfDocument(before, context), b = loadGltfDocument(after, context);
  ASSERT_TRUE(a && b);
  AccessorReader readA(*a), readB(*b);
  const json root = test::jsonOf(after);
  for (std::size_t i = 0; i < a->model.accessors.size(); ++i) {
    if (isHusk(root["accessors"][i])) continue;
    const auto p = readA.floats(static_cast<int>(i), 1, 4, "before"),
               q = readB.floats(static_cast<int>(i), 1, 4, "now");
    ASSERT_TRUE(p && q) << i;
    EXPECT_EQ((*p)->values, (*q)->values) << "accessor " << i;
  }
}

// Every byte of the sample level's export belongs to something, but for what a step of 16 leaves.
TEST(ExportLevel, bytesThatNothingRefersToAreCut) {
  const Exported& e = twoRooms();
  EXPECT_GT(e.level.bytesPruned, 0u);
  expectSameValues(kLevel, e.path);
  std::uint64_t live = 0, husks = 0;
  for (const json& view : e.after["bufferViews"]) {
    husks += isHusk(view);
    if (!isHusk(view)) live += view["byteLength"].get<std::uint64_t>();
  }
  EXPECT_GT(husks, 0u);
  const auto bytes = e.after["buffers"][0]["byteLength"].get<std::uint64_t>();
  EXPECT_LE(bytes, live + 32 * e.after["bufferViews"].size());
  EXPECT_GE(bytes, live);
}

// An integer of an unknown extension may be the number of an accessor: room's positions stay while one is there.
TEST(ExportLevel, whatAnUnknownExtensionMayMeanStays) {
  GltfBuilder b = madeLevel();
  const Exported kept = test::exportOf(b.write("level.glb"), someOptions());
  EXPECT_EQ(kept.after["accessors"][0], kept.before["accessors"][0]);
  expectSameValues(testing::testFolder() / "level.glb", kept.path);
  b.root["extensions"]["VENDOR_weather"].erase("accessor");
  const Exported cut = test::exportOf(b.write("level.glb"), someOptions());
  EXPECT_TRUE(isHusk(cut.after["accessors"][0])) << cut.after["accessors"][0];
  EXPECT_GT(cut.level.bytesPruned, kept.level.bytesPruned);
  expectSameValues(testing::testFolder() / "level.glb", cut.path);
  test::expectSameSurfaces(cut.scene, cut.again);
  b.root["meshes"][0]["extras"]["collider"] = {{"accessor", 0}};
  const Exported meant = test::exportOf(b.write("level.glb"), someOptions());
  EXPECT_EQ(meant.after["accessors"][0], meant.before["accessors"][0]);
}

// One view for two meshes, of which one is split: the other's part of it stays, at another place.
TEST(ExportLevel, viewsOfSeveralAccessorsAreCutBetweenThem) {
  GltfBuilder b;
  const Box room = weldedBox(4.0f, true);
  std::vector<float> positions = {7, 7, 7};  // nobody's, and nobody knows
  positions.insert(positions.end(), room.position.begin(), room.position.end());
  const std::size_t second = positions.size();
  positions.insert(positions.end(), {1, 1, 1, 2, 1, 1, 2, 2, 1, 1, 2, 1});
  const int view = b.view(positions);
  const int a = b.accessor(view, 5126, 8, "VEC3"), c = b.accessor(view, 5126, 4, "VEC3");
  b.root["accessors"][static_cast<std::size_t>(a)]["byteOffset"] = 12;
  b.root["accessors"][static_cast<std::size_t>(c)]["byteOffset"] = 4 * second;
  b.node({{"mesh", b.mesh({{"attributes", {{"POSITION", a}}}, {"indices", b.indices(room.index)}})}});
  b.node({{"mesh", b.mesh({{"attributes", {{"POSITION", c}}}, {"indices", b.indices({0, 1, 2, 0, 2, 3})}})},
          {"extras", {{"relume", {{"bake", "dynamic"}}}}}});
  const Exported e = test::exportOf(b.write("level.glb"), someOptions());
  EXPECT_TRUE(isHusk(e.after["accessors"][static_cast<std::size_t>(a)]));
  EXPECT_FALSE(isHusk(e.after["bufferViews"][static_cast<std::size_t>(view)]));
  EXPECT_LT(e.after["bufferViews"][static_cast<std::size_t>(view)]["byteLength"], 4 * positions.size());
  expectSameValues(testing::testFolder() / "level.glb", e.path);
  test::expectSameSurfaces(e.scene, e.again);
}

}  // namespace
}  // namespace relume
