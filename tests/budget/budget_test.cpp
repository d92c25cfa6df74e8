// SPDX-License-Identifier: MIT
// Bakes that are made for a budget: they keep it, use it, and say so; in one piece, in shards, and until an error is
// met.
#include "bake/budget/choose_sizes.h"
#include "bake/shards/plan.h"
#include "bake/shards/shard.h"
#include "relume/bake/bake.h"
#include "relume/bake_file.h"
#include "relume/certificate.h"
#include "tests/budget/sample_level.h"
#include "tests/pipeline/tiny_bake.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

BakeOptions withBudget(float memoryMiB, float frameMs, float maxError = 0.0f) {
  BakeOptions options = test::smallBakeOptions();
  options.budget = {memoryMiB, frameMs, maxError};
  options.links.raysPerCache = 1024;  // find more than there is room for
  return options;
}

TEST(Budget, noneChangesNothing) {
  const BakeOptions options = presetOptions(Preset::high);
  EXPECT_EQ(optionsToJson(chooseSizes(options)), optionsToJson(options));
  const Result<BakeOptions> links = chooseLinks(options, {}, {}, {});
  ASSERT_TRUE(links);
  EXPECT_EQ(optionsToJson(*links), optionsToJson(options));
}

TEST(Budget, sizesGrowWithItAndAreOptionsThatBake) {
  for (const LinkKind kind : kLinkKinds) {
    std::uint32_t surfels = 0, caches = 0;
    for (float budget = 0.25f; budget <= 65536.0f; budget *= 1.6f) {
      for (const bool isTime : {false, true}) {
        BakeOptions options = isTime ? withBudget(0.0f, std::min(budget, 1000.0f)) : withBudget(budget, 0.0f);
        options.links.kind = kind;
        BakeOptions sized = chooseSizes(options);
        sized.budget = {};
        const Status status = checkOptions(sized);
        EXPECT_TRUE(status) << status.error().message;
        if (isTime) continue;
        EXPECT_GE(sized.surfels.count, surfels);
        EXPECT_GE(sized.caches.lightmapCaches, caches);
        surfels = sized.surfels.count;
        caches = sized.caches.lightmapCaches;
      }
    }
  }
  // What is switched off stays so.
  BakeOptions mapOnly = withBudget(8.0f, 0.0f), gridOnly = mapOnly;
  mapOnly.caches.gridCaches = 0;
  gridOnly.caches.lightmapCaches = 0;
  EXPECT_EQ(chooseSizes(mapOnly).caches.gridCaches, 0u);
  EXPECT_EQ(chooseSizes(gridOnly).caches.lightmapCaches, 0u);
}

TEST(Budget, bakesKeepItAndUseIt) {
  const Scene scene = test::sampleLevel();
  for (const float memoryMiB : {0.5f, 1.0f, 2.5f}) {
    const BakeOptions options = withBudget(memoryMiB, 0.0f);
    Context context;
    const Result<Bake> baked = bake(scene, options, context);
    ASSERT_TRUE(baked) << baked.error().message;
    const double held = test::heldBytes(*baked) / 1048576.0;
    EXPECT_LE(held, static_cast<double>(memoryMiB));
    EXPECT_GE(held, 0.93 * static_cast<double>(memoryMiB));
    EXPECT_EQ(baked->provenance.optionsJson, optionsToJson(options)) << "a bake says what was asked for";
  }
  for (const float frameMs : {0.1f, 0.3f}) {
    Context context;
    const Result<Bake> baked = bake(scene, withBudget(0.0f, frameMs), context);
    ASSERT_TRUE(baked) << baked.error().message;
    const double reckoned = runtimeCost(*baked).frameMs;
    EXPECT_LE(reckoned, static_cast<double>(frameMs));
    EXPECT_GE(reckoned, 0.93 * static_cast<double>(frameMs));
  }
  // The narrower of two decides.
  Context context;
  const Result<Bake> both = bake(scene, withBudget(64.0f, 0.1f), context);
  ASSERT_TRUE(both) << both.error().message;
  EXPECT_LE(runtimeCost(*both).frameMs, 0.1);
}

TEST(Budget, oneThatIsTooSmallIsAnErrorThatSaysWhatWouldDo) {
  Context context;
  const Result<Bake> baked = bake(test::sampleLevel(), withBudget(0.01f, 0.0f), context);
  ASSERT_FALSE(baked);
  EXPECT_EQ(baked.error().code, ErrorCode::usage);
  EXPECT_NE(baked.error().message.find("budget is too small"), std::string::npos) << baked.error().message;
  EXPECT_NE(baked.error().message.find("--budget-mb"), std::string::npos);
}

TEST(Budget, shardsGiveTheBytesOfOneBake) {
  const Scene scene = test::sampleLevel();
  const BakeOptions options = withBudget(0.6f, 0.0f);
  Context context;
  const Result<Bake> whole = bake(scene, options, context);
  ASSERT_TRUE(whole) << whole.error().message;
  const Result<BakePlan> made = makePlan(scene, options, context);
  ASSERT_TRUE(made) << made.error().message;
  const auto file = serializePlan(*made);
  ASSERT_TRUE(file);
  Result<BakePlan> plan = parsePlan(*file, nullptr);
  ASSERT_TRUE(plan) << plan.error().message;
  EXPECT_EQ(optionsToJson(plan->chosen), optionsToJson(made->chosen));
  std::vector<NamedShard> shards;
  for (std::uint32_t i = 1; i <= 3; ++i)
    shards.push_back({"shard " + std::to_string(i), traceShard(scene, *plan, {i, 3}, context)});
  const Result<Bake> merged = mergeShards(std::move(*plan), std::move(shards), context);
  ASSERT_TRUE(merged) << merged.error().message;
  const auto first = serializeBake(*whole), second = serializeBake(*merged);
  ASSERT_TRUE(first && second);
  EXPECT_TRUE(*first == *second);
}

TEST(Budget, bakesUntilTheErrorIsMet) {
  const Scene scene = test::sampleLevel();
  Context context;
  std::vector<std::string> tried;
  context.onMessage = [&](Severity, std::string_view text) {
    if (text.find("certified error") != std::string_view::npos) tried.emplace_back(text);
  };
  const BakeOptions options = withBudget(0.0f, 0.0f, 0.5f);
  const Result<Bake> easy = bake(scene, options, context);
  ASSERT_TRUE(easy) << easy.error().message;
  EXPECT_LE(certifiedError(easy->certificate), 0.5f);
  EXPECT_EQ(tried.size(), 1u);
  EXPECT_EQ(easy->provenance.optionsJson, optionsToJson(options));

  const Result<Bake> never = bake(scene, withBudget(3.0f, 0.0f, 1e-4f), context);
  ASSERT_FALSE(never);
  EXPECT_EQ(never.error().code, ErrorCode::failed);
  EXPECT_NE(never.error().message.find("--max-error"), std::string::npos) << never.error().message;
  EXPECT_EQ(tried.size(), 3u) << "2 MiB, then all that the budget has";

  const Result<BakePlan> plan = makePlan(scene, options, context);
  ASSERT_FALSE(plan);
  EXPECT_EQ(plan.error().code, ErrorCode::usage);
}

TEST(Budget, threadsChangeNothing) {
  const Scene scene = test::sampleLevel();
  std::vector<std::byte> first;
  for (const int threads : {1, 2, 7}) {
    Context context;
    context.threads = threads;
    const Result<Bake> baked = bake(scene, withBudget(0.5f, 0.0f), context);
    ASSERT_TRUE(baked) << baked.error().message;
    const auto bytes = serializeBake(*baked);
    ASSERT_TRUE(bytes);
    if (first.empty()) first = *bytes;
    EXPECT_TRUE(*bytes == first) << threads << " threads";
  }
}

}  // namespace
}  // namespace relume
