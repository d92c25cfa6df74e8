// SPDX-License-Identifier: MIT
// Surfels that are looked for when a hit asks, against the whole map.
#include "bake/surfels/surfels_on_demand.h"

#include "bake/base/parallel.h"
#include "bake/base/random.h"
#include "bake/surfels/surfel_map.h"
#include "tests/surfels/make_level.h"

#include <algorithm>
#include <numeric>

namespace relume {
namespace {

// A room with crumbs, a lamp, slivers and triangles without area, and a part that is not baked.
Level mixedLevel() {
  Level level;
  level.begin("room");
  level.addRoom({6, 3, 4});
  level.begin("crumbs");
  for (std::uint64_t i = 0; i < 500; ++i) {
    RandomStream r(5, 1, i);
    const auto small = [&] { return 0.1f * glm::vec3(r.uniform() - 0.5f, r.uniform() - 0.5f, r.uniform() - 0.5f); };
    const glm::vec3 at(6.0f * r.uniform(), 3.0f * r.uniform(), 4.0f * r.uniform());
    level.addTriangle(at, at + small(), i % 50 == 0 ? at : at + small());
  }
  level.begin("slivers");
  for (int i = 0; i < 20; ++i) {
    const auto x = 0.2f * static_cast<float>(i);
    level.addTriangle({x, 1, 0}, {x + 0.001f, 1, 2}, {x, 1, 4});
  }
  level.begin("lamp").emission = glm::vec3(1.0f);
  level.addRectangle({2, 2.9f, 1}, {1, 0, 0}, {0, 0, 1});
  level.begin("guest");
  level.addRectangle({1, 0.5f, 1}, {0, 0, 1}, {1, 0, 0});
  level.scene().instances.back().mode = BakeMode::dynamic;
  return level;
}

std::vector<Hit> hitsOn(const Scene& scene, std::size_t count) {
  std::vector<Hit> hits(count);
  for (std::size_t i = 0; i < count; ++i) {
    RandomStream r(6, 1, i);
    if (i % 16 == 0) continue;  // nothing is hit
    // As often on what is large as on all that is small.
    const std::uint32_t triangle = i % 2 == 0 ? r.below(12) : r.below(scene.triangleCount());
    Hit& hit = hits[i];
    hit.instance = scene.instanceOf(triangle);
    hit.triangle = triangle - scene.instances[hit.instance].firstTriangle;
    hit.back = r.below(2) == 1;
    glm::vec2 b = r.uniform2();
    if (b.x + b.y > 1.0f) b = glm::vec2(1.0f) - b;
    hit.barycentric = i % 8 == 1 ? glm::vec2(b.x, 1.0f - b.x) : b;  // some on the last edge
  }
  return hits;
}

TEST(SurfelsOnDemand, answerAsTheWholeMap) {
  Level level = mixedLevel();
  const Scene& scene = level.scene();
  const PlaySpace space = level.bothSides();
  const std::vector<SurfaceSample> surfels = scatter(level, space, 3000);
  const float spacing = 0.2f;
  Context context;
  const SurfelMap whole = buildSurfelMap(scene, space, surfels, spacing, context);
  const SurfelsOnDemand asked(scene, surfels, spacing, context);
  const std::vector<Hit> hits = hitsOn(scene, 20000);
  std::vector<std::uint32_t> found(hits.size());
  std::size_t mapped = 0, searches = 0;
  for (int round = 0; round < 2; ++round) {
    std::fill(found.begin(), found.end(), 12345u);
    asked.at(hits, found);
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const Hit& hit = hits[i];
      const std::uint32_t side =
          hit ? 2 * (scene.instances[hit.instance].firstTriangle + hit.triangle) + (hit.back ? 1 : 0) : 0;
      ASSERT_EQ(found[i], hit ? whole.at(side, hit.barycentric) : kNone) << i;
      mapped += found[i] != kNone ? 1 : 0;
    }
    if (round == 0) searches = asked.searches();
  }
  EXPECT_EQ(asked.searches(), searches) << "of what is known";
  EXPECT_GT(mapped, 20000u);
  EXPECT_GT(searches, 1000u);
}

TEST(SurfelsOnDemand, onlyTilesThatAreHitAreLookedFor) {
  Level level = mixedLevel();
  const PlaySpace space = level.bothSides();
  const std::vector<SurfaceSample> surfels = scatter(level, space, 3000);
  Context context;
  const SurfelsOnDemand asked(level.scene(), surfels, 0.2f, context);
  std::vector<Hit> hits(100);
  for (Hit& hit : hits) {
    hit.instance = 0;
    hit.barycentric = {0.3f, 0.3f};
  }
  std::vector<std::uint32_t> found(hits.size());
  asked.at(hits, found);
  EXPECT_NE(found[0], kNone);
  EXPECT_EQ(asked.searches(), 1u);
}

TEST(SurfelsOnDemand, answersDoNotDependOnWhoAsksFirst) {
  Level level = mixedLevel();
  const PlaySpace space = level.bothSides();
  const std::vector<SurfaceSample> surfels = scatter(level, space, 3000);
  Context context;
  const std::vector<Hit> hits = hitsOn(level.scene(), 20000);
  std::vector<std::uint32_t> inOrder(hits.size());
  SurfelsOnDemand(level.scene(), surfels, 0.2f, context).at(hits, inOrder);
  for (const int threads : {2, 7}) {
    context.threads = threads;
    const SurfelsOnDemand asked(level.scene(), surfels, 0.2f, context);
    // Several threads ask for the same hits at once.
    constexpr std::size_t kTimes = 4, kGrain = 97;
    std::vector<std::vector<std::uint32_t>> found(kTimes, std::vector<std::uint32_t>(hits.size()));
    parallelChunks(context, "", kTimes * hits.size(), kGrain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        const std::size_t i = k / kTimes;
        asked.at(std::span(hits).subspan(i, 1), std::span(found[k % kTimes]).subspan(i, 1));
      }
    });
    for (const auto& each : found) EXPECT_EQ(each, inOrder) << threads;
  }
}

}  // namespace
}  // namespace relume
