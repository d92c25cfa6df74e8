// SPDX-License-Identifier: MIT
// Sharing links between caches, and stopping at an error.
#include "bake/links/share_links.h"
#include "bake/links/links.h"
#include "bake/links/select_cut.h"
#include "bake/links/visible_subtree.h"
#include "tests/links/links_fixture.h"

#include <gtest/gtest.h>

#include <string>

namespace relume {
namespace {

using test::randomArrivals;
using test::randomHierarchy;

// Caches that see little and caches that see much, with their trees and keys.
struct Views {
  explicit Views(std::uint32_t caches) : h(randomHierarchy(3000, 21)), order(h), nodes(h.nodeCount()) {
    for (std::uint32_t node = 0; node < h.nodeCount(); ++node) nodes[node] = {h.firstWeight[node], 1.0f, 0.0};
    sumHidden(h, nodes);
    for (std::uint32_t c = 0; c < caches; ++c) {
      tree.emplace_back(order).build(randomArrivals(h, 5u << c % 9, c), c % 2 ? 1e-3f : 2e-3f);
      cutKeys(tree.back(), nodes, LinkOptions::CutKey::readError, keys.emplace_back());
    }
  }

  struct Cuts {
    std::uint64_t links = 0;
    double error = 0;  // sum of the keys of all cuts' nodes
    double worst = 0;  // of a cache
  };
  Cuts cut(const CutLimit& limit) const {
    Cuts cuts;
    std::vector<CutCandidate> queue;
    std::vector<CutLink> cut;
    for (std::size_t c = 0; c < tree.size(); ++c) {
      selectCut(tree[c], keys[c], limit, queue, cut);
      cuts.links += cut.size();
      double error = 0;
      for (const CutLink& link : cut) error += double{keys[c].key[link.slot]};
      cuts.error += error;
      cuts.worst = std::max(cuts.worst, error);
    }
    return cuts;
  }

  Hierarchy h;
  LeafOrder order;
  std::vector<CutNode> nodes;
  std::vector<VisibleSubtree> tree;
  std::vector<CutKeys> keys;
};

TEST(KeyCounts, theThresholdUsesTheTotalAndNoMore) {
  const Views views(60);
  for (const std::uint32_t cap : {30u, 100u, 65535u}) {
    KeyCounts even, odd;
    for (std::size_t c = 0; c < views.tree.size(); ++c) (c % 2 ? odd : even).add(views.tree[c], views.keys[c].key, cap);
    even.merge(odd);
    EXPECT_EQ(even.caches(), 60u);
    const std::uint64_t all = views.cut(CutLimit{cap}).links;
    for (const double share : {0.1, 0.3, 0.7, 0.95}) {
      const double total = share * static_cast<double>(all);
      const auto cuts = views.cut(CutLimit{cap, even.keyFor(total)});
      EXPECT_LE(static_cast<double>(cuts.links), total) << cap << ' ' << share;
      EXPECT_GE(static_cast<double>(cuts.links), 0.98 * total - 5) << cap << ' ' << share;
    }
    EXPECT_EQ(even.keyFor(static_cast<double>(all)), -1.0f);
    EXPECT_EQ(views.cut(CutLimit{cap, even.keyFor(0.0)}).links, views.tree.size());  // the roots at least
  }
}

TEST(KeyCounts, sharedLinksLeaveLessErrorThanEqualShares) {
  const Views views(60);
  for (const std::uint32_t each : {10u, 40u, 120u}) {
    const auto uniform = views.cut(CutLimit{each});
    KeyCounts counts;
    for (std::size_t c = 0; c < views.tree.size(); ++c) counts.add(views.tree[c], views.keys[c].key, 65535);
    const auto shared = views.cut(CutLimit{65535, counts.keyFor(static_cast<double>(uniform.links))});
    EXPECT_LE(shared.links, uniform.links);
    EXPECT_LT(shared.error, 0.9 * uniform.error) << each;
  }
}

TEST(SelectCut, stopsAtTheErrorAskedFor) {
  const Views views(60);
  const auto coarse = views.cut(CutLimit{2});
  std::uint64_t links = 0;
  for (const double share : {0.5, 0.1, 0.01}) {
    const auto sum = static_cast<float>(share * coarse.worst);
    const auto cuts = views.cut(CutLimit{65535, -1.0f, sum});
    EXPECT_LE(cuts.worst, double{sum} * 1.0001);
    EXPECT_GT(cuts.worst, 0.3 * double{sum});  // and not long before
    EXPECT_GT(cuts.links, links);
    links = cuts.links;
  }
}

// Some caches in the open middle of a box, some behind a small screen close to a wall.
test::TileScene boxWithScreens() {
  test::TileScene tiles;
  tiles.addBox(1.0f, 24);
  tiles.addRectangle({-0.3f, -0.9f, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f}, 8, true);
  RandomStream random(1, 2, 3);
  for (int i = 0; i < 90; ++i) {
    tiles.addCache(
        {1.6f * random.uniform() - 0.8f, i % 2 ? -0.95f : 0.5f * random.uniform(), 1.6f * random.uniform() - 0.8f},
        glm::vec3(0.0f));
  }
  return tiles;
}

Result<TracedLinks> trace(const test::TileScene& tiles, const LinkOptions& options, int threads = 1,
                          std::string* warning = nullptr) {
  Context context;
  context.threads = threads;
  context.onMessage = [&](Severity, std::string_view text) {
    if (warning != nullptr) *warning += text;
  };
  auto tracer = RayTracer::create(tiles.scene(), "avx2", context);
  if (!tracer) return tracer.error();
  const Surfels surfels = tiles.surfels();
  auto hierarchy = clusterSurfels(surfels, 0, {}, context);
  if (!hierarchy) return hierarchy.error();
  return traceLinks(*tracer, surfels, tiles.map(), *hierarchy, tiles.caches(), options, 1, context);
}

TEST(TraceLinks, aTotalIsSharedOutAndRowsDiffer) {
  const test::TileScene tiles = boxWithScreens();
  LinkOptions options;
  options.raysPerCache = 1024;
  options.maxLinksPerCache = 600;
  options.linksTotal = 90 * 100;
  const auto one = trace(tiles, options, 1), three = trace(tiles, options, 3);
  ASSERT_TRUE(one && three);
  EXPECT_LE(one->links.count(), options.linksTotal);
  EXPECT_GE(one->links.count(), 0.97 * options.linksTotal);
  std::uint32_t min = 65535, max = 0;
  for (std::uint32_t c = 0; c < 90; ++c) {
    const std::uint32_t length = one->links.rowBegin[c + 1] - one->links.rowBegin[c];
    min = std::min(min, length);
    max = std::max(max, length);
    EXPECT_EQ(length, three->links.rowBegin[c + 1] - three->links.rowBegin[c]);
  }
  EXPECT_LT(min, 90u);
  EXPECT_GT(max, 110u);
  EXPECT_LE(max, 600u);
  EXPECT_EQ(one->firstWeight, three->firstWeight);

  options.linksTotal = 0xFFFFFFFFu;  // more than there are: the cap alone
  options.linksPerCache = options.maxLinksPerCache = 60;
  const auto capped = trace(tiles, options);
  ASSERT_TRUE(capped);
  EXPECT_EQ(capped->links.count(), 90u * 60u);
}

// The mean is kept whatever the caches see, and as many for each where the most is the mean.
TEST(TraceLinks, linksPerCacheIsTheMean) {
  const test::TileScene tiles = boxWithScreens();
  LinkOptions options;
  options.raysPerCache = 1024;
  options.linksPerCache = 50;
  const auto shared = trace(tiles, options);
  ASSERT_TRUE(shared);
  EXPECT_NEAR(shared->links.count(), 90.0 * 50.0, 0.03 * 90.0 * 50.0);
  std::uint32_t max = 0;
  for (std::uint32_t c = 0; c < 90; ++c) max = std::max(max, shared->links.rowBegin[c + 1] - shared->links.rowBegin[c]);
  EXPECT_GT(max, 55u);
  EXPECT_LE(max, 8u * 50u);
  options.linksTotal = 90 * 30;  // in place of the mean
  const auto total = trace(tiles, options);
  ASSERT_TRUE(total);
  EXPECT_NEAR(total->links.count(), 90.0 * 30.0, 0.03 * 90.0 * 30.0);
  options.linksTotal = 0;
  options.maxLinksPerCache = 50;
  const auto equal = trace(tiles, options);
  ASSERT_TRUE(equal);
  for (std::uint32_t c = 0; c < 90; ++c) EXPECT_EQ(equal->links.rowBegin[c + 1] - equal->links.rowBegin[c], 50u);
}

TEST(TraceLinks, aTotalThatIsTooSmallLeavesARootEachAndSaysSo) {
  const test::TileScene tiles = boxWithScreens();
  LinkOptions options;
  options.raysPerCache = 256;
  options.linksTotal = 10;
  std::string warning;
  const auto traced = trace(tiles, options, 1, &warning);
  ASSERT_TRUE(traced);
  EXPECT_EQ(traced->links.count(), 90u);
  EXPECT_NE(warning.find("90 links where 10 were asked for"), std::string::npos) << warning;
}

TEST(TraceLinks, aLargerErrorNeedsFewerLinks) {
  const test::TileScene tiles = boxWithScreens();
  LinkOptions options;
  options.raysPerCache = 1024;
  options.linksPerCache = options.maxLinksPerCache = 600;
  std::uint32_t before = 0;
  for (const float error : {1.0f, 0.25f, 0.1f}) {
    options.maxError = error;
    const auto traced = trace(tiles, options);
    ASSERT_TRUE(traced);
    EXPECT_GT(traced->links.count(), before) << error;
    before = traced->links.count();
  }
  EXPECT_LT(before, 90u * 600u);
}

}  // namespace
}  // namespace relume
