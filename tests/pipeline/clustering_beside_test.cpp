// SPDX-License-Identifier: MIT
// The tree over the surfels is the same whether it is made beside the caches or after them, and a bake that ends early
// does not wait for it.
#include "bake/clustering_beside.h"

#include "bake/hierarchy/hierarchy.h"
#include "bake/stages.h"
#include "tests/load_level.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

namespace relume {
namespace {

Scene twoRooms() { return test::loadLevel(std::filesystem::path(RELUME_SOURCE_DIR) / "samples/level/two_rooms.glb"); }

BakeOptions manySurfels() {
  BakeOptions options = presetOptions(Preset::draft);
  options.playSpace.walks = 4096;
  options.surfels.count = ClusteringBeside::kMany;
  options.surfels.placement = SurfelOptions::Placement::halton;
  options.caches.gridCaches = 64;
  options.caches.lightmapCaches = 256;
  return options;
}

// Surfels on a floor.
Surfels floorSurfels(std::uint32_t count) {
  Surfels surfels;
  std::vector<glm::vec3> position, normal(count, glm::vec3(0, 1, 0)), none(count, glm::vec3(0.0f));
  const auto along = static_cast<std::uint32_t>(std::ceil(std::sqrt(static_cast<double>(count))));
  for (std::uint32_t i = 0; i < count; ++i) position.emplace_back(i % along, 0.0f, i / along);
  surfels.positionWorld = std::move(position);
  surfels.normal = std::move(normal);
  surfels.albedo = none;
  surfels.emission = std::move(none);
  return surfels;
}

// A tracer, and surfels to cluster.
struct Level {
  explicit Level(std::uint32_t count) : scene(twoRooms()), surfels(floorSurfels(count)) {
    Context context;
    auto made = RayTracer::create(scene, "", context, RayStructure::quick);
    EXPECT_TRUE(made);
    tracer.emplace(std::move(*made));
  }
  Scene scene;
  Surfels surfels;
  std::optional<RayTracer> tracer;
};

const StageReport* stageOf(const Context& context, const std::string& name) {
  const auto found = std::find_if(context.report().begin(), context.report().end(),
                                  [&](const StageReport& stage) { return stage.stage == name; });
  return found != context.report().end() ? &*found : nullptr;
}

TEST(ClusteringBeside, givesTheSameTreeAtAnyNumberOfThreads) {
  const Scene scene = twoRooms();
  const BakeOptions options = manySurfels();
  std::vector<std::uint32_t> first;
  for (const int threads : {1, 2, 7}) {
    Context context;
    context.threads = threads;
    const Result<PlacedLevel> placed = placeLevel(scene, options, placeStages(options), context);
    ASSERT_TRUE(placed) << placed.error().message;
    const std::vector<std::uint32_t> child = placed->hierarchy.child.toVector();
    if (first.empty()) first = child;
    EXPECT_TRUE(child == first) << threads << " threads";
    const StageReport *caches = stageOf(context, "caches"), *hierarchy = stageOf(context, "hierarchy");
    ASSERT_NE(hierarchy, nullptr);
    EXPECT_LT(caches, hierarchy) << "the order of the report does not depend on the threads";
    for (const char* figure : {"memory_estimate_mib", "senders", "groups", "depth"}) {
      const auto& figures = hierarchy->figures;
      EXPECT_EQ(std::count_if(figures.begin(), figures.end(), [&](const auto& f) { return f.first == figure; }), 1)
          << figure << " at " << threads << " threads";
    }
    EXPECT_EQ(context.maxMemory, 0u);
  }
}

TEST(ClusteringBeside, beginsOnlyWhereAThreadAndMemoryAreToSpare) {
  const Level many(ClusteringBeside::kMany), few(ClusteringBeside::kMany - 1);
  BakeOptions options = manySurfels();
  options.clustering.method = ClusteringOptions::Method::kd;
  Context one, four, little;
  one.threads = 1;
  four.threads = little.threads = 4;
  constexpr std::uint64_t kLittle = std::uint64_t{64} << 20;
  little.maxMemory = kLittle;
  ClusteringBeside alone(*many.tracer, many.surfels, options, one);
  EXPECT_FALSE(alone.isBeside());
  EXPECT_FALSE(ClusteringBeside(*few.tracer, few.surfels, options, four).isBeside());
  EXPECT_FALSE(ClusteringBeside(*many.tracer, many.surfels, options, little).isBeside());
  EXPECT_EQ(little.maxMemory, kLittle);
  ClusteringBeside beside(*many.tracer, many.surfels, options, four);
  ASSERT_TRUE(beside.isBeside());
  EXPECT_GT(four.maxMemory, 0u) << "what the tree may take is left out";
  const Result<Hierarchy> a = alone.take(), b = beside.take();
  ASSERT_TRUE(a && b);
  EXPECT_TRUE(a->child.toVector() == b->child.toVector());
  EXPECT_FALSE(beside.isBeside());
  EXPECT_EQ(four.maxMemory, 0u);
  EXPECT_EQ(four.threads, 4);
}

// No more threads run than were asked for, where the machine has more.
TEST(ClusteringBeside, threadsAreSharedOut) {
  for (int threads = 0; threads <= 64; ++threads) {
    for (const int ofMachine : {1, 2, 16, 64}) {
      const ClusteringBeside::Threads shared = ClusteringBeside::shareThreads(threads, ofMachine);
      if (!shared.beside) {
        EXPECT_TRUE(threads > 0 && threads < 4) << threads;
      } else if (threads > 0 && threads < ofMachine) {
        EXPECT_EQ(shared.tree + shared.rest, threads);
        EXPECT_GE(std::min(shared.tree, shared.rest), 1);
      } else {
        EXPECT_TRUE(shared.tree == threads && shared.rest == threads) << threads << " of " << ofMachine;
      }
    }
  }
}

TEST(ClusteringBeside, isCancelledWithItsContext) {
  const Level level(8 * ClusteringBeside::kMany);  // seconds of clustering
  BakeOptions options = manySurfels();
  Context context;
  context.threads = 4;
  ClusteringBeside beside(*level.tracer, level.surfels, options, context);
  ASSERT_TRUE(beside.isBeside());
  context.cancel();
  const Result<Hierarchy> made = beside.take();
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().message, "cancelled");
}

// A refusal may be for the memory that the tree took: caches are then placed once more, alone.
TEST(ClusteringBeside, refusedCachesAreTriedAgainAlone) {
  const Scene scene = twoRooms();
  const BakeOptions options = manySurfels();
  PlaceStages stages = placeStages(options);
  int calls = 0;
  stages.placeCaches = [&, made = stages.placeCaches](const RayTracer& tracer, const PlaySpace& space,
                                                      Context& context) -> Result<PlacedCaches> {
    if (++calls == 1) return Error{ErrorCode::failed, "no memory"};
    return made(tracer, space, context);
  };
  Context context;
  context.threads = 4;
  EXPECT_TRUE(placeLevel(scene, options, stages, context));
  EXPECT_EQ(calls, 2);
  calls = 0;
  context.threads = 1;
  const Result<PlacedLevel> alone = placeLevel(scene, options, stages, context);
  ASSERT_FALSE(alone);
  EXPECT_EQ(alone.error().message, "no memory");
  EXPECT_EQ(calls, 1);
}

}  // namespace
}  // namespace relume
