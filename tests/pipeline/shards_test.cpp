// SPDX-License-Identifier: MIT
// Bakes in shards: however the caches are cut, in whatever order and at whatever number of threads the shards are made,
// the merged bake has the bytes of one that was made at once. Files that were damaged, or made to be, are refused by
// name and break nothing.
#include "bake/shards/shard.h"
#include "relume/bake/bake.h"
#include "relume/bake_file.h"
#include "tests/caches/big_level.h"
#include "tests/cli/make_gltf.h"
#include "tests/formats/corrupt_file.h"
#include "tests/load_level.h"
#include "tests/long_tests.h"
#include "tests/pipeline/tiny_bake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <random>

namespace relume {
namespace {

namespace fs = std::filesystem;

Scene room(const std::string& material = GltfParts{}.material) {
  const fs::path path = fs::path(testing::TempDir()) / "relume_shards_room.gltf";
  GltfParts parts;
  parts.material = material;
  std::ofstream(path) << makeGltf(parts);
  return test::loadLevel(path);
}

Scene twoRooms() { return test::loadLevel(RELUME_SOURCE_DIR "/samples/level/two_rooms.glb"); }

// Bytes as a file has them in memory: aligned, and kept alive by what is read from them.
struct Held {
  explicit Held(const Bytes& from) : words(std::make_shared<std::vector<std::uint64_t>>((from.size() + 7) / 8)) {
    if (!from.empty()) std::memcpy(words->data(), from.data(), from.size());
    bytes = std::as_bytes(std::span(*words)).first(from.size());
  }
  std::shared_ptr<std::vector<std::uint64_t>> words;
  std::span<const std::byte> bytes;
};

Result<BakePlan> parsePlan(const Bytes& bytes) {
  const Held held(bytes);
  return relume::parsePlan(held.bytes, held.words);
}
Result<Shard> parseShard(const Bytes& bytes) {
  const Held held(bytes);
  return relume::parseShard(held.bytes, held.words);
}

Bytes planBytes(const Scene& scene, const BakeOptions& options, int threads = 2) {
  Context context;
  context.threads = threads;
  const Result<BakePlan> plan = makePlan(scene, options, context);
  EXPECT_TRUE(plan) << plan.error().message;
  const Result<Bytes> bytes = plan ? serializePlan(*plan) : plan.error();
  EXPECT_TRUE(bytes) << bytes.error().message;
  return bytes ? *bytes : Bytes{};
}

Bytes shardBytes(const Scene& scene, const BakePlan& plan, const ShardNumber& number, int threads = 2) {
  Context context;
  context.threads = threads;
  const Result<Shard> shard = traceShard(scene, plan, number, context);
  EXPECT_TRUE(shard) << shard.error().message;
  const Result<Bytes> bytes = shard ? serializeShard(*shard) : shard.error();
  EXPECT_TRUE(bytes) << bytes.error().message;
  return bytes ? *bytes : Bytes{};
}

NamedShard named(const Bytes& bytes, const std::string& name = "a shard") { return {name, parseShard(bytes)}; }

Result<Bytes> merge(const Bytes& plan, std::vector<NamedShard> shards) {
  Context context;
  Result<BakePlan> read = parsePlan(plan);
  if (!read) return read.error();
  const Result<Bake> bake = mergeShards(std::move(*read), std::move(shards), context);
  if (!bake) return bake.error();
  return serializeBake(*bake);
}

Bytes plainBytes(const Scene& scene, const BakeOptions& options) {
  Context context;
  const Result<Bake> baked = bake(scene, options, context);
  EXPECT_TRUE(baked) << baked.error().message;
  const Result<Bytes> bytes = baked ? serializeBake(*baked) : baked.error();
  return bytes ? *bytes : Bytes{};
}

// Cut the caches at random: `count` even shards, of which some are cut further, in any order.
std::vector<ShardNumber> randomCut(std::mt19937& random, std::uint32_t maxCount) {
  const std::uint32_t count = 1 + static_cast<std::uint32_t>(random() % maxCount);
  std::vector<ShardNumber> cut;
  for (std::uint32_t i = 1; i <= count; ++i) {
    if (random() % 4 != 0) {
      cut.push_back({i, count});
      continue;
    }
    const std::uint32_t parts = 2 + static_cast<std::uint32_t>(random() % 2);
    for (std::uint32_t k = 1; k <= parts; ++k) cut.push_back({(i - 1) * parts + k, count * parts});
  }
  std::shuffle(cut.begin(), cut.end(), random);
  return cut;
}

void expectAnyCutGivesTheSameBytes(const Scene& scene, const BakeOptions& options, int cuts, std::uint32_t maxCount) {
  const Bytes plain = plainBytes(scene, options);
  const Bytes bytes = planBytes(scene, options, 1);
  EXPECT_TRUE(planBytes(scene, options, 7) == bytes) << "plans at 1 and 7 threads differ";
  const Result<BakePlan> plan = parsePlan(bytes);
  ASSERT_TRUE(plan) << plan.error().message;
  std::mt19937 random(static_cast<unsigned>(plain.size()));
  constexpr int kThreads[] = {1, 2, 7};
  for (int i = 0; i < cuts; ++i) {
    std::vector<NamedShard> shards;
    for (const ShardNumber& number : randomCut(random, maxCount))
      shards.push_back(named(shardBytes(scene, *plan, number, kThreads[random() % 3])));
    const std::size_t count = shards.size();
    const Result<Bytes> merged = merge(bytes, std::move(shards));
    ASSERT_TRUE(merged) << merged.error().message;
    EXPECT_TRUE(*merged == plain) << count << " shards";
  }
}

TEST(Shards, anyCutOfTheSampleLevelGivesTheBytesOfOneBake) {
  const bool isLong = test::longTests();
  expectAnyCutGivesTheSameBytes(twoRooms(), presetOptions(Preset::draft), isLong ? 24 : 4, isLong ? 60 : 9);
}

TEST(Shards, everyKindOfLinksAndWeightsMerges) {
  const Scene scene = room();
  for (const LinkKind kind : kLinkKinds) {
    SCOPED_TRACE(linkKindName(kind));
    BakeOptions options = test::tinyBakeOptions();
    options.links.kind = kind;
    expectAnyCutGivesTheSameBytes(scene, options, 4, 12);
    options.links.pull = LinkOptions::PullWeight::area;
    options.links.maxLinksPerCache = options.links.linksPerCache;  // none are shared out
    expectAnyCutGivesTheSameBytes(scene, options, 2, 12);
  }
}

TEST(Shards, levelsWithDrivableMaterialsAndManyMeshesMerge) {
  const std::string drivable =
      "{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.7,0.6,0.5,1]},\"extras\":{\"relume\":{\"drivable\":true}}}";
  const Scene lit = room(drivable);
  const Result<BakePlan> plan = parsePlan(planBytes(lit, test::tinyBakeOptions()));
  ASSERT_TRUE(plan);
  EXPECT_FALSE(plan->tracedEmission.empty()) << "links reckon with light that the bake does not have";
  expectAnyCutGivesTheSameBytes(lit, test::tinyBakeOptions(), 3, 9);

  Scene many = test::bigLevel(40, 4);
  Camera camera;
  camera.toWorld = glm::translate(glm::mat4(1.0f), {3.0f, 16.0f, 3.0f});
  many.cameras.push_back(camera);
  BakeOptions options = presetOptions(Preset::draft);
  options.surfels.count = 4096;
  options.caches.lightmapCaches = 512;
  options.caches.gridCaches = 128;
  expectAnyCutGivesTheSameBytes(many, options, 2, 9);
}

TEST(Shards, moreShardsThanCachesAreEmptyOrOfOneCache) {
  const Scene scene = room();
  const BakeOptions options = test::tinyBakeOptions();
  const Bytes bytes = planBytes(scene, options);
  const Result<BakePlan> plan = parsePlan(bytes);
  ASSERT_TRUE(plan);
  const std::uint32_t count = plan->bake.caches.count() + 3;
  std::vector<NamedShard> shards;
  for (std::uint32_t i = count; i >= 1; --i) shards.push_back(named(shardBytes(scene, *plan, {i, count})));
  const Result<Bytes> merged = merge(bytes, std::move(shards));
  ASSERT_TRUE(merged) << merged.error().message;
  EXPECT_TRUE(*merged == plainBytes(scene, options));
}

// A plan, two halves of it, and a third half: of other options.
class BrokenShards : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scene_ = new Scene(room());
    plan_ = new Bytes(planBytes(*scene_, test::tinyBakeOptions()));
    const Result<BakePlan> plan = parsePlan(*plan_);
    ASSERT_TRUE(plan);
    for (std::uint32_t i = 1; i <= 2; ++i) half_[i - 1] = new Bytes(shardBytes(*scene_, *plan, {i, 2}));
  }
  static void TearDownTestSuite() {
    delete scene_;
    delete plan_;
    for (Bytes*& half : half_) delete half;
  }

  static std::vector<NamedShard> halves() { return {named(*half_[0], "one"), named(*half_[1], "two")}; }
  static void expectError(const Result<Bytes>& merged, ErrorCode code, const std::vector<std::string>& words) {
    ASSERT_FALSE(merged);
    EXPECT_EQ(merged.error().code, code) << merged.error().message;
    for (const std::string& each : words)
      EXPECT_NE(merged.error().message.find(each), std::string::npos) << each << " in: " << merged.error().message;
  }

  static inline Scene* scene_ = nullptr;
  static inline Bytes* plan_ = nullptr;
  static inline Bytes* half_[2] = {};
};

TEST_F(BrokenShards, missingAndDoubledOnesAreNamedAllAtOnce) {
  const Result<BakePlan> plan = parsePlan(*plan_);
  ASSERT_TRUE(plan);
  const auto shard = [&](std::uint32_t i, std::uint32_t n) {
    return named(shardBytes(*scene_, *plan, {i, n}), "shard" + std::to_string(i));
  };
  expectError(merge(*plan_, {shard(2, 5), shard(4, 5), shard(2, 5)}), ErrorCode::invalidFile,
              {"missing: shard 1/5", "doubled: ", "are in shard2 (shard 2/5), given twice", "missing: shard 3/5",
               "missing: shard 5/5"});
  expectError(merge(*plan_, {}), ErrorCode::invalidFile, {"missing: caches 0 to "});
  expectError(merge(*plan_, {shard(1, 2), shard(1, 3), shard(3, 3)}), ErrorCode::invalidFile,
              {"doubled: caches 0 to ", "missing: caches "});
}

TEST_F(BrokenShards, thoseOfOtherPlansSayWhatDiffers) {
  BakeOptions options = test::tinyBakeOptions();
  options.links.raysPerCache = 64;
  const Result<BakePlan> other = parsePlan(planBytes(*scene_, options));
  ASSERT_TRUE(other);
  std::vector<NamedShard> shards = halves();
  shards[1] = named(shardBytes(*scene_, *other, {2, 2}), "two");
  expectError(
      merge(*plan_, std::move(shards)), ErrorCode::invalidFile,
      {"two: of another plan: of other options, links.raysPerCache 64 where the plan has 32", "missing: shard 2/2"});

  const Scene painted = room("{\"pbrMetallicRoughness\":{\"baseColorFactor\":[0.1,0.6,0.5,1]}}");
  const Result<BakePlan> repainted = parsePlan(planBytes(painted, test::tinyBakeOptions()));
  ASSERT_TRUE(repainted);
  shards = halves();
  shards[0] = named(shardBytes(painted, *repainted, {1, 2}), "one");
  expectError(merge(*plan_, std::move(shards)), ErrorCode::invalidFile, {"one: of another plan: of another level"});
  // And a shard is not traced of a level that is not the plan's.
  Context context;
  const Result<Shard> wrong = traceShard(*scene_, *repainted, {1, 2}, context);
  ASSERT_FALSE(wrong);
  EXPECT_EQ(wrong.error().code, ErrorCode::invalidFile);
  EXPECT_NE(wrong.error().message.find("not the one of the plan"), std::string::npos) << wrong.error().message;
}

TEST_F(BrokenShards, thoseOfOtherVersionsAreUnsupported) {
  for (const bool tool : {false, true}) {
    Result<BakePlan> plan = parsePlan(*plan_);
    ASSERT_TRUE(plan);
    Provenance& provenance = plan->bake.provenance;
    if (tool) provenance.toolVersion = "0.0.1";
    if (!tool) provenance.algorithmVersion = 1;
    const std::string word = tool ? "version 0.0.1" : "algorithm version 1";
    const Result<Bytes> old = serializePlan(*plan);
    ASSERT_TRUE(old);
    expectError(merge(*old, halves()), ErrorCode::unsupported, {word, "make the plan again"});
    Context context;
    const Result<Shard> traced = traceShard(*scene_, *parsePlan(*old), {1, 2}, context);
    ASSERT_FALSE(traced);
    EXPECT_EQ(traced.error().code, ErrorCode::unsupported);
    EXPECT_NE(traced.error().message.find(word), std::string::npos) << traced.error().message;
    // A shard that such a program made.
    Result<Shard> shard = parseShard(*half_[0]);
    ASSERT_TRUE(shard);
    shard->plan = 1;
    shard->provenance = provenance;
    std::vector<NamedShard> shards = halves();
    shards[0] = named(*serializeShard(*shard), "one");
    expectError(merge(*plan_, std::move(shards)), ErrorCode::unsupported, {"one: of another plan: of " + word});
  }
  Result<BakePlan> plan = parsePlan(*plan_);
  ASSERT_TRUE(plan);
  plan->bake.provenance.rayTracer = "embree 4.0.0 isa=avx2";
  Context context;
  const Result<Shard> traced = traceShard(*scene_, *parsePlan(*serializePlan(*plan)), {1, 2}, context);
  ASSERT_FALSE(traced);
  EXPECT_EQ(traced.error().code, ErrorCode::unsupported);
  EXPECT_NE(traced.error().message.find("embree 4.0.0"), std::string::npos) << traced.error().message;
}

// Half-written files: cut at every chunk's begin and end, and inside.
TEST_F(BrokenShards, filesCutAnywhereAreRefused) {
  for (const Bytes* whole : {plan_, half_[0]}) {
    std::vector<std::size_t> cuts{0, 1, 7, 8, 63, 64, whole->size() - 1};
    for (std::size_t row = 0; row < chunkCount(*whole); ++row) {
      const auto begin = getAt<std::uint64_t>(*whole, rowOffset(row) + 40);
      const auto bytes = getAt<std::uint64_t>(*whole, rowOffset(row) + 48);
      for (const std::uint64_t at : {begin, begin + bytes / 2, begin + bytes}) {
        if (at < whole->size()) cuts.push_back(at);
      }
    }
    for (const std::size_t size : cuts) {
      const Bytes cut(whole->begin(), whole->begin() + static_cast<std::ptrdiff_t>(size));
      const Error error = whole == plan_ ? parsePlan(cut).error() : parseShard(cut).error();
      EXPECT_EQ(error.code, ErrorCode::invalidFile) << size;
      const bool named = size == 0 || error.message.find("truncated") != std::string::npos;
      EXPECT_TRUE(named) << size << ": " << error.message;
    }
  }
  std::vector<NamedShard> shards = halves();
  shards[1] = named(Bytes(half_[1]->begin(), half_[1]->begin() + 1000), "two");
  expectError(merge(*plan_, std::move(shards)), ErrorCode::invalidFile, {"truncated", "missing: shard 2/2"});
}

TEST_F(BrokenShards, flippedBitsAreFoundByTheirChunk) {
  std::mt19937 random(7);
  for (const Bytes* whole : {plan_, half_[0]}) {
    for (int i = 0; i < 300; ++i) {
      Bytes flipped = *whole;
      const std::size_t at = random() % flipped.size();
      flipped[at] ^= std::byte{static_cast<unsigned char>(1u << random() % 8)};
      const bool taken =
          whole == plan_ ? static_cast<bool>(parsePlan(flipped)) : static_cast<bool>(parseShard(flipped));
      EXPECT_FALSE(taken) << "byte " << at;
    }
  }
}

TEST_F(BrokenShards, planShardAndBakeAreToldApart) {
  const auto found = [](const Error& error) { return error.message.substr(error.message.find("found")); };
  EXPECT_EQ(found(parsePlan(*half_[0]).error()), "found a shard of a bake (relume bake --shard)");
  EXPECT_EQ(found(parseShard(*plan_).error()), "found the plan of a bake (relume bake --plan)");
  const Held held(*plan_);
  EXPECT_EQ(found(parseBake(held.bytes, held.words).error()), "found the plan of a bake (relume bake --plan)");
}

// Words of every chunk replaced, and the checksums made to fit: refused by the chunk's name, or harmless.
TEST_F(BrokenShards, forgedNumbersAreRefusedOrHarmless) {
  std::mt19937 random(11);
  constexpr std::uint32_t kValues[] = {0u, 1u, 0x7FFFFFFFu, 0x80000000u, 0xFFFFFFFFu, 0x7F800000u, 0x7FC00000u, 1000u};
  const int tries = test::longTests() ? 600 : 24;
  int refused = 0, taken = 0;
  for (const Bytes* whole : {plan_, half_[0]}) {
    for (std::size_t row = 0; row < chunkCount(*whole); ++row) {
      const auto begin = getAt<std::uint64_t>(*whole, rowOffset(row) + 40);
      const auto bytes = getAt<std::uint64_t>(*whole, rowOffset(row) + 48);
      for (int i = 0; i < tries && bytes >= 4; ++i) {
        Bytes forged = *whole;
        putAt(forged, begin + random() % (bytes / 4) * 4, kValues[random() % std::size(kValues)]);
        reseal(forged);
        std::vector<NamedShard> shards = halves();
        if (whole == half_[0]) {
          shards[0] = named(forged, "one");
          const Result<Bytes> merged = merge(*plan_, std::move(shards));
          (merged ? taken : refused) += 1;
          continue;
        }
        const Result<BakePlan> plan = parsePlan(forged);
        if (!plan) {
          ++refused;
          EXPECT_FALSE(plan.error().message.empty());
          continue;
        }
        ++taken;
        Context context;
        const Result<Shard> shard = traceShard(*scene_, *plan, {1, 9}, context);
        EXPECT_TRUE(!shard || shard->links.cacheCount() == shard->range.count());
      }
    }
  }
  EXPECT_GT(refused, 100);
  EXPECT_GT(taken, 10);
}

TEST(ShardNumbers, areReadOrRefused) {
  EXPECT_EQ(*parseShardNumber("1/1"), (ShardNumber{1, 1}));
  EXPECT_EQ(*parseShardNumber("6/17"), (ShardNumber{6, 17}));
  for (const char* bad : {"", "1", "/", "1/", "/2", "0/2", "3/2", "1/0", "-1/2", "1/2 ", " 1/2", "1/2/3", "a/b",
                          "1/1000001", "4294967297/4294967297", "1.5/2"})
    EXPECT_FALSE(parseShardNumber(bad)) << bad;
  // Every cache is in one shard.
  for (const std::uint32_t caches : {1u, 5u, 1000u, 4294967295u}) {
    std::uint32_t end = 0;
    for (std::uint32_t i = 1; i <= 7; ++i) {
      const CacheRange range = rangeOf({i, 7}, caches);
      EXPECT_EQ(range.begin, end);
      end = range.end;
    }
    EXPECT_EQ(end, caches);
  }
}

TEST(Shards, cancelledOnesSaySo) {
  const Scene scene = room();
  const BakeOptions options = test::tinyBakeOptions();
  const Result<BakePlan> plan = parsePlan(planBytes(scene, options));
  ASSERT_TRUE(plan);
  for (const std::string stage : {"rays", "play space", "links: shares", "links"}) {
    Context context;
    context.onProgress = [&](std::string_view name, double) { return name != stage; };
    const bool ofShard = stage == "links" || stage == "rays";
    const Error error =
        ofShard ? traceShard(scene, *plan, {1, 2}, context).error() : makePlan(scene, options, context).error();
    EXPECT_EQ(error.message, "cancelled") << stage;
  }
}

}  // namespace
}  // namespace relume
