// SPDX-License-Identifier: MIT
// Bakes by way of a store have the bytes of a bake without one: after any edit of level and options, whatever stands in
// the store, and with several bakes at it at once. And what an edit cannot change is found.
#include "bake/shards/stored_bake.h"
#include "bake/shards/entry_names.h"
#include "relume/bake/bake.h"
#include "relume/bake_file.h"
#include "tests/caches/big_level.h"
#include "tests/cli/make_gltf.h"
#include "tests/formats/corrupt_file.h"
#include "tests/load_level.h"
#include "tests/long_tests.h"
#include "tests/pipeline/tiny_bake.h"

#include <gtest/gtest.h>
#include <glm/gtc/matrix_transform.hpp>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <thread>

namespace relume {
namespace {

namespace fs = std::filesystem;

Scene room() {
  const fs::path path = fs::path(testing::TempDir()) / "relume_stored_room.gltf";
  std::ofstream(path) << makeGltf(GltfParts{});
  return test::loadLevel(path);
}

Scene twoRooms() { return test::loadLevel(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb"); }

Scene terrain() {
  Scene scene = test::bigLevel(12, 4);
  Camera camera;
  camera.toWorld = glm::translate(glm::mat4(1.0f), {3.0f, 16.0f, 3.0f});
  scene.cameras.push_back(camera);
  scene.materials.emplace_back();
  scene.meshes[0].material = 0;
  return scene;
}

// The sample level with a lamp, a material whose light is driven, and glass of which every other texel is a hole.
Scene lit() {
  Scene scene = twoRooms();
  scene.materials[0].emission = glm::vec3(3.0f, 2.0f, 1.0f);
  if (scene.materials.size() > 1) scene.materials[1].drivable = true;
  return scene;
}

Bytes bytesOf(const Result<Bake>& baked) {
  EXPECT_TRUE(baked) << baked.error().message;
  const Result<Bytes> bytes = baked ? serializeBake(*baked) : baked.error();
  return bytes ? *bytes : Bytes{};
}

Bytes plainBytes(const Scene& scene, const BakeOptions& options) {
  Context context;
  return bytesOf(bake(scene, options, context));
}

struct Stored {
  Bytes bytes;
  EntryCache::Statistics statistics;
  std::string said;
  double traced = 0.0;                      // caches
  std::set<std::string, std::less<>> told;  // stages, by progress
};

class StoredBake : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              (std::string("relume_stored_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  Stored bakeOnce(const Scene& scene, const BakeOptions& options, int threads = 2,
                  const StorePatience& patience = {}) const {
    Stored result;
    Context context;
    context.threads = threads;
    std::mutex mutex;
    context.onMessage = [&](Severity severity, std::string_view text) {
      const std::scoped_lock lock(mutex);
      if (severity == Severity::warning) result.said += std::string(text) + "\n";
    };
    context.onProgress = [&](std::string_view stage, double) {
      const std::scoped_lock lock(mutex);
      result.told.emplace(stage);
      return true;
    };
    auto store = openStore(folder_.string());
    EXPECT_TRUE(store) << store.error().message;
    EntryCache cache(std::move(*store), 0, patience);
    result.bytes = bytesOf(bakeWithStore(scene, options, cache, context));
    result.statistics = cache.statistics();
    for (const StageReport& stage : context.report()) {
      for (const auto& [name, value] : stage.figures) result.traced += name == "caches_traced" ? value : 0.0;
    }
    return result;
  }

  std::vector<fs::path> entries() const {
    std::vector<fs::path> found;
    for (const auto& each : fs::recursive_directory_iterator(folder_)) {
      if (each.is_regular_file()) found.push_back(each.path());
    }
    std::sort(found.begin(), found.end());
    return found;
  }

  // What comes before a plan is looked for where the plan is not there.
  void removePlan(const Scene& scene, const BakeOptions& options, const fs::path& unless) const {
    const std::string name = toString(EntryNames(scene, options).plan());
    const fs::path path = folder_ / name.substr(0, 2) / name;
    if (path != unless) fs::remove(path);
  }

  fs::path folder_;
};

Bytes readAll(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(file)), {});
  const auto* data = reinterpret_cast<const std::byte*>(text.data());
  return Bytes(data, data + text.size());
}
void writeAll(const fs::path& path, const Bytes& bytes) {
  std::ofstream(path, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

// What people do to levels and to options between two bakes.
void edit(Scene& scene, BakeOptions& options, std::mt19937& random) {
  const auto unit = [&] { return static_cast<float>(random() % 1000) / 1000.0f; };
  Instance& instance = scene.instances[random() % scene.instances.size()];
  Material& material = scene.materials[random() % scene.materials.size()];
  switch (random() % 12) {
    case 0:
      instance.toWorld = glm::translate(instance.toWorld, glm::vec3(unit(), unit(), unit()) * 0.2f - 0.1f);
      break;
    case 1:
      instance.toWorld = glm::rotate(instance.toWorld, 0.1f * unit(), glm::vec3(0.0f, 1.0f, 0.0f));
      break;
    case 2:
      material.albedo = {unit(), unit(), unit()};
      break;
    case 3:
      material.emission = material.emission == glm::vec3(0.0f) ? glm::vec3(unit(), 1.0f, unit()) : glm::vec3(0.0f);
      break;
    case 4:
      material.doubleSided = !material.doubleSided;
      break;
    case 5:
      material.drivable = !material.drivable;
      break;
    case 6:
      instance.node += "x";
      break;
    case 7:
      options.links.linksPerCache = 8 + static_cast<std::uint32_t>(random() % 16);
      break;
    case 8:
      options.links.kind = kLinkKinds[random() % std::size(kLinkKinds)];
      break;
    case 9:
      options.links.pull = random() % 2 ? LinkOptions::PullWeight::area : LinkOptions::PullWeight::importance;
      break;
    case 10:
      options.seed = random() % 3;
      break;
    default:
      options.caches.lightmapCaches = 16 + static_cast<std::uint32_t>(random() % 3) * 8;
  }
}

// Edits pile up, and some are taken back, so that names of an earlier bake are met again.
TEST_F(StoredBake, randomEditsGiveTheBytesOfABakeWithoutAStore) {
  const int edits = test::longTests() ? 100 : 4;
  const Scene scenes[] = {room(), twoRooms(), terrain(), lit()};
  std::uint64_t found = 0;
  for (std::size_t s = 0; s < std::size(scenes); ++s) {
    std::mt19937 random(static_cast<unsigned>(s) + 5);
    std::vector<std::pair<Scene, BakeOptions>> past{{scenes[s], test::tinyBakeOptions()}};
    for (int i = 0; i < edits; ++i) {
      auto [scene, options] = past[random() % 3 == 0 ? random() % past.size() : past.size() - 1];
      if (random() % 5 != 0) edit(scene, options, random);
      const Stored stored = bakeOnce(scene, options, 1 + i % 3);
      ASSERT_TRUE(stored.bytes == plainBytes(scene, options)) << "level " << s << ", edit " << i;
      found += stored.statistics.found;
      past.emplace_back(std::move(scene), options);
    }
  }
  EXPECT_GT(found, 0u);
}

TEST_F(StoredBake, theSameLevelIsFoundWhole) {
  const Scene scene = twoRooms();
  const BakeOptions options = presetOptions(Preset::draft);
  const Bytes plain = plainBytes(scene, options);
  const Stored first = bakeOnce(scene, options), second = bakeOnce(scene, options, 7);
  EXPECT_TRUE(first.bytes == plain);
  EXPECT_TRUE(second.bytes == plain);
  EXPECT_EQ(first.statistics.found, 0u);
  EXPECT_EQ(first.statistics.missing, first.statistics.written);
  EXPECT_EQ(second.statistics.missing + second.statistics.written, 0u);
  EXPECT_EQ(second.statistics.found, first.statistics.written - 2) << "who has the plan needs no play space, no caches";
  EXPECT_EQ(second.traced, 0.0);
  EXPECT_EQ(first.said, second.said) << "what was said of the level is said again";
  for (const char* stage : {"find plan", "find links"}) EXPECT_TRUE(second.told.contains(stage)) << stage;
}

TEST_F(StoredBake, oneThatGetsTooSlowMidwayGivesTheSameBytes) {
  const Scene scene = room();
  const BakeOptions options = test::tinyBakeOptions();
  const Bytes plain = bakeOnce(scene, options).bytes;
  ASSERT_TRUE(plain == plainBytes(scene, options));
  const Stored slow = bakeOnce(scene, options, 2, {0.0, 0.0, 0.0});
  EXPECT_TRUE(slow.bytes == plain);
  EXPECT_EQ(slow.statistics.found, 1u) << "the plan";
  EXPECT_GT(slow.traced, 0.0);
  EXPECT_NE(slow.said.find("too slow, done without from here"), std::string::npos) << slow.said;
}

TEST_F(StoredBake, aBakeThatWasStoppedGoesOn) {
  const Scene scene = twoRooms();
  const BakeOptions options = presetOptions(Preset::draft);
  {
    Context context;
    context.onProgress = [](std::string_view stage, double fraction) {
      return stage != "links" || fraction == 0.0 || fraction == 1.0;
    };
    EntryCache cache(std::move(*openStore(folder_.string())), 0);
    EXPECT_FALSE(bakeWithStore(scene, options, cache, context));
    ASSERT_GE(cache.statistics().written, 3u) << "plan, threshold, and the first block";
  }
  const Stored rest = bakeOnce(scene, options);
  EXPECT_GE(rest.statistics.found, 3u);
  EXPECT_GT(rest.statistics.missing, 0u);
  EXPECT_TRUE(rest.bytes == plainBytes(scene, options));
}

TEST_F(StoredBake, coloursAndNamesChangeNoLink) {
  Scene scene = twoRooms();
  const BakeOptions options = presetOptions(Preset::draft);
  bakeOnce(scene, options);
  for (Material& material : scene.materials) {
    if (material.alphaMode == AlphaMode::opaque) material.albedo *= 0.5f;
  }
  Stored stored = bakeOnce(scene, options);
  EXPECT_EQ(stored.statistics.missing, 1u) << "the plan";
  EXPECT_EQ(stored.traced, 0.0);
  EXPECT_TRUE(stored.bytes == plainBytes(scene, options));
  scene.instances[0].node += " renamed";
  stored = bakeOnce(scene, options);
  EXPECT_EQ(stored.statistics.missing, 2u) << "the plan, and the caches, whose warnings name nodes";
  EXPECT_EQ(stored.traced, 0.0);
  EXPECT_TRUE(stored.bytes == plainBytes(scene, options));
  // Light and holes do.
  scene.materials[0].emission = glm::vec3(1.0f);
  EXPECT_GT(bakeOnce(scene, options).traced, 0.0);
}

TEST_F(StoredBake, optionsOfLinksChangeNoPlan) {
  const Scene scene = twoRooms();
  BakeOptions options = presetOptions(Preset::draft);
  bakeOnce(scene, options);
  options.links.linksPerCache /= 2;
  options.links.kind = LinkKind::cone;
  options.lumaBands = 3;
  const Stored stored = bakeOnce(scene, options);
  EXPECT_EQ(stored.statistics.found, 1u) << "the plan";
  EXPECT_GT(stored.traced, 0.0);
  EXPECT_TRUE(stored.bytes == plainBytes(scene, options));
}

TEST_F(StoredBake, surfelsChangeNeitherPlaySpaceNorCaches) {
  const Scene scene = twoRooms();
  BakeOptions options = presetOptions(Preset::draft);
  bakeOnce(scene, options);
  options.surfels.count /= 2;
  const Stored stored = bakeOnce(scene, options);
  EXPECT_EQ(stored.statistics.found, 2u);
  EXPECT_TRUE(stored.bytes == plainBytes(scene, options));
}

TEST_F(StoredBake, twoBakesAtOnceShareAStore) {
  const Scene first = twoRooms();
  Scene second = first;
  second.materials[0].albedo *= 0.5f;
  const BakeOptions options = presetOptions(Preset::draft);
  std::array<Stored, 4> stored;
  std::vector<std::thread> bakes;
  for (std::size_t i = 0; i < stored.size(); ++i)
    bakes.emplace_back([&, i] { stored[i] = bakeOnce(i % 2 == 0 ? first : second, options, 1); });
  for (std::thread& each : bakes) each.join();
  const Bytes plain[] = {plainBytes(first, options), plainBytes(second, options)};
  for (std::size_t i = 0; i < stored.size(); ++i) EXPECT_TRUE(stored[i].bytes == plain[i % 2]) << i;
  EXPECT_EQ(bakeOnce(second, options).statistics.missing, 0u);
}

TEST_F(StoredBake, damagedEntriesAreMadeAgain) {
  const Scene scene = room();
  const BakeOptions options = test::tinyBakeOptions();
  const Bytes plain = bakeOnce(scene, options).bytes;
  ASSERT_TRUE(plain == plainBytes(scene, options));
  const std::vector<fs::path> paths = entries();
  std::mt19937 random(3);
  for (const fs::path& path : paths) {
    const Bytes whole = readAll(path);
    for (int kind = 0; kind < 5; ++kind) {
      Bytes damaged = whole;
      if (kind == 0) damaged[random() % damaged.size()] ^= std::byte{4};
      if (kind == 1) damaged.resize(damaged.size() / 2);
      if (kind == 2) damaged.clear();
      if (kind == 3) damaged = readAll(paths[(static_cast<std::size_t>(&path - paths.data()) + 1) % paths.size()]);
      if (kind == 4) damaged.resize(damaged.size() + 8);
      writeAll(path, damaged);
      removePlan(scene, options, path);
      const Stored stored = bakeOnce(scene, options);
      EXPECT_TRUE(stored.bytes == plain) << path << " " << kind;
      EXPECT_EQ(stored.statistics.damaged, 1u) << path << " " << kind;
      EXPECT_NE(stored.said.find(path.filename().string() + " is made again"), std::string::npos) << stored.said;
    }
  }
  EXPECT_EQ(bakeOnce(scene, options).statistics.damaged, 0u) << "they were mended";
}

// What a run finds of its store is not kept with what it makes: the next has nothing to warn of.
TEST_F(StoredBake, entriesThatWereMendedAreNotWarnedOf) {
  const Scene scene = room();
  const BakeOptions options = test::tinyBakeOptions();
  const std::string ofTheLevel = bakeOnce(scene, options).said;
  for (const fs::path& path : entries()) writeAll(path, {});
  const Stored mending = bakeOnce(scene, options);
  EXPECT_EQ(mending.statistics.damaged, mending.statistics.written);
  EXPECT_NE(mending.said.find("is made again: cut to 0 bytes"), std::string::npos) << mending.said;
  EXPECT_EQ(bakeOnce(scene, options).said, ofTheLevel);
  // Play space and caches are looked for where there is no plan.
  removePlan(scene, options, {});
  EXPECT_EQ(bakeOnce(scene, options).said, ofTheLevel);
}

// Entries with checksums that fit, and numbers in them that do not: a bake in any case, and no crash.
TEST_F(StoredBake, forgedEntriesEndInABake) {
  const Scene scene = room();
  const BakeOptions options = test::tinyBakeOptions();
  bakeOnce(scene, options);
  constexpr std::uint32_t kValues[] = {0u, 1u, 0x7FFFFFFFu, 0x80000000u, 0xFFFFFFFFu, 0x7F800000u, 0x7FC00000u};
  std::mt19937 random(9);
  int damaged = 0;
  for (const fs::path& path : entries()) {
    const std::string text = path.filename().string();
    const EntryName name{std::stoull(text.substr(0, 16), nullptr, 16), std::stoull(text.substr(16), nullptr, 16)};
    const Bytes whole = readAll(path);
    const auto opened = openEntry(whole);
    ASSERT_TRUE(opened) << opened.error().message;
    const int tries = test::longTests() ? 400 : 16;
    for (int i = 0; i < tries; ++i) {
      Bytes inside(opened->bytes.begin(), opened->bytes.end());
      putAt(inside, random() % (inside.size() / 4) * 4, kValues[random() % std::size(kValues)]);
      // A plan stands behind its messages, a shard at the begin; a threshold is one number.
      for (std::size_t at = 0; at + kHeaderBytes < inside.size(); at += 8) {
        if (inside[at] != std::byte{0x89} || inside[at + 1] != std::byte{'R'}) continue;
        Bytes file(inside.begin() + static_cast<std::ptrdiff_t>(at), inside.end());
        reseal(file);
        std::copy(file.begin(), file.end(), inside.begin() + static_cast<std::ptrdiff_t>(at));
        break;
      }
      writeAll(path, *sealEntry(name, inside));
      removePlan(scene, options, path);
      const Stored stored = bakeOnce(scene, options);
      EXPECT_FALSE(stored.bytes.empty());
      damaged += stored.statistics.damaged > 0;
    }
    writeAll(path, whole);
  }
  EXPECT_GT(damaged, 20);
}

// Budgets choose sizes by what was placed, and an error takes several bakes: with a store, the same file.
TEST_F(StoredBake, budgetsGiveTheSameBytes) {
  const Scene scene = test::loadLevel(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb");
  Context context;
  for (const BudgetOptions& budget : {BudgetOptions{0.3f, 0.0f, 0.0f}, BudgetOptions{0.4f, 0.0f, 0.0f},
                                      BudgetOptions{0.4f, 0.1f, 0.0f}, BudgetOptions{0.4f, 0.0f, 0.9f}}) {
    BakeOptions options = test::smallBakeOptions();
    options.budget = budget;
    const auto plain = bytesOf(bake(scene, options, context));
    EXPECT_TRUE(bakeOnce(scene, options).bytes == plain);
    const Stored again = bakeOnce(scene, options);
    EXPECT_TRUE(again.bytes == plain);
    EXPECT_EQ(again.traced, 0.0);
  }
}

}  // namespace
}  // namespace relume
