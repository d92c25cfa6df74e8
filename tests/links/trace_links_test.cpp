// SPDX-License-Identifier: MIT
// The whole stage on scenes with analytic answers.
#include "bake/links/links.h"
#include "bake/links/visible_subtree.h"
#include "formats/compact_links.h"
#include "formats/sh.h"
#include "tests/links/links_fixture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <set>

namespace relume {
namespace {

using test::kPi;
using test::kY0;
using test::TileScene;

struct Traced {
  Hierarchy hierarchy;
  TracedLinks traced;
};

LinkOptions coneOptions(std::uint32_t rays, std::uint32_t links) {
  LinkOptions o;
  o.kind = LinkKind::cone;
  o.raysPerCache = rays;
  o.linksPerCache = o.maxLinksPerCache = links;
  return o;
}

Result<Traced> traceTiles(const TileScene& tiles, const LinkOptions& options, std::uint32_t skyPatches = 0,
                          int threads = 1) {
  Context context;
  context.threads = threads;
  Result<RayTracer> tracer = RayTracer::create(tiles.scene(), "avx2", context);
  if (!tracer) return tracer.error();
  const Surfels surfels = tiles.surfels();
  Result<Hierarchy> hierarchy = clusterSurfels(surfels, skyPatches, {}, context);
  if (!hierarchy) return hierarchy.error();
  Result<TracedLinks> links =
      traceLinks(*tracer, surfels, tiles.map(), *hierarchy, tiles.caches(), options, 1, context);
  if (!links) return links.error();
  return Traced{std::move(*hierarchy), std::move(*links)};
}

// Radiance coefficients a cache gets from its cone links when every node's radiosity is `radiosity` [W/m²].
std::vector<float> lightCache(const Links& links, std::uint32_t cache, double radiosity, int bands = 4) {
  std::vector<float> c(bands * bands, 0.0f), y(bands * bands), ratio(bands);
  for (std::uint32_t i = links.rowBegin[cache]; i < links.rowBegin[cache + 1]; ++i) {
    const ConeLink& link = links.cone[i];
    coneBandRatios(bands, unpackHalf(link.cosAlpha), ratio);
    evaluateSh(bands, unpackOctahedral(link.direction), y);
    for (int l = 0; l < bands; ++l) {
      for (int k = l * l; k < (l + 1) * (l + 1); ++k) {
        c[k] += static_cast<float>(radiosity * unpackHalf(link.transfer) * ratio[l] * y[k] / kY0);
      }
    }
  }
  return c;
}

double transferOf(const Links& links, std::uint32_t cache) {
  double f = 0;
  for (std::uint32_t i = links.rowBegin[cache]; i < links.rowBegin[cache + 1]; ++i)
    f += unpackHalf(links.cone[i].transfer);
  return f;
}

// Form factor of a point on one square's axis to a parallel square of side `side` at `distance` (Howell C-4 four
// times).
double pointToSquare(double side, double distance) {
  const double x = side / 2 / distance, r = std::sqrt(1 + x * x);
  return 4.0 / (2 * kPi) * 2 * (x / r) * std::atan(x / r);
}

TEST(TraceLinks, parallelPlatesGiveTheAnalyticFormFactor) {
  TileScene tiles;
  tiles.addRectangle({-1, 2, -1}, {2, 0, 0}, {0, 0, 2}, 16, true);  // both sides reflect: the one above sees no cache
  tiles.addRectangle({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, 16, true);
  tiles.addCache({0, 0, 0}, {0, 1, 0});
  tiles.addCache({0, 2, 0}, {0, -1, 0});
  tiles.addCache({0, 2, 0}, {0, 1, 0});  // looks away
  for (const std::uint32_t n : {4u, 40u, 254u}) {
    const auto result = traceTiles(tiles, coneOptions(16384, n));
    ASSERT_TRUE(result) << result.error().message;
    const Links& links = result->traced.links;
    for (std::uint32_t cache : {0u, 1u}) {
      const glm::vec3 normal(0, cache == 0 ? 1 : -1, 0);
      const auto c = lightCache(links, cache, 10.0);
      EXPECT_NEAR(irradianceLinear(c, normal) / 10.0, pointToSquare(2, 2), 0.005) << n;
    }
    EXPECT_EQ(links.rowBegin[2], links.rowBegin[3]);
  }
}

TEST(TraceLinks, anOccluderLeavesNothing) {
  TileScene tiles;
  tiles.addRectangle({-1, 2, -1}, {2, 0, 0}, {0, 0, 2}, 8, true);
  tiles.addRectangle({-2, 1, -2}, {4, 0, 0}, {0, 0, 4}, 1, false, false);  // in the way, without surfels
  tiles.addCache({0, 0, 0}, {0, 1, 0});
  tiles.addCache({0, 0.5f, 0}, {0, 0, 0});
  const auto result = traceTiles(tiles, coneOptions(4096, 254));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->traced.links.count(), 0u);
  EXPECT_GT(result->traced.statistics.unmappedShare, 0.3);
}

TEST(TraceLinks, aClosedBoxFillsTheSphereAndTheHemisphere) {
  TileScene tiles;
  tiles.addBox(1.0f, 12);
  tiles.addCache({0.3f, -0.2f, 0.4f}, {0, 0, 0});
  tiles.addCache({0.3f, -1.0f, 0.4f}, {0, 1, 0});
  const auto result = traceTiles(tiles, coneOptions(4096, 254));
  ASSERT_TRUE(result) << result.error().message;
  const Links& links = result->traced.links;
  EXPECT_NEAR(transferOf(links, 0), 4 * kY0, 1e-3);
  EXPECT_NEAR(transferOf(links, 1), 2 * kY0, 3e-3);
  EXPECT_NEAR(irradianceLinear(lightCache(links, 1, 1.0), {0, 1, 0}), 1.0, 3e-3);
  EXPECT_EQ(result->traced.statistics.missShare, 0.0);
  EXPECT_EQ(result->traced.statistics.backFaceShare, 0.0);
  EXPECT_EQ(result->traced.statistics.rays, 2u * 4096u);
}

TEST(TraceLinks, lightFromAllSidesArrivesEvenlyUnderAnyNormal) {
  TileScene tiles;
  tiles.addBox(1.0f, 12);
  tiles.addCache({0.0f, 0.0f, 0.0f}, {0, 0, 0});
  const auto result = traceTiles(tiles, coneOptions(16384, 254));
  ASSERT_TRUE(result) << result.error().message;
  const auto c = lightCache(result->traced.links, 0, 1.0);
  for (const glm::vec3 n : {glm::vec3(1, 0, 0), glm::vec3(0, -1, 0), glm::normalize(glm::vec3(1, 1, 1))}) {
    EXPECT_NEAR(irradianceClamped(4, c, n), 1.0, 0.01);
  }
}

TEST(TraceLinks, backSidesSendTheirOwnSurfelsLight) {
  TileScene tiles;
  tiles.addRectangle({-1, 1, -1}, {0, 0, 2}, {2, 0, 0}, 4, true);  // its front looks up, away from the cache
  tiles.addCache({0, 0, 0}, {0, 1, 0});
  const auto result = traceTiles(tiles, coneOptions(4096, 254));
  ASSERT_TRUE(result) << result.error().message;
  const Surfels surfels = tiles.surfels();
  ASSERT_GT(result->traced.links.count(), 0u);
  EXPECT_GT(result->traced.statistics.backFaceShare, 0.1);
  for (const ConeLink& link : result->traced.links.cone) {
    ASSERT_TRUE(result->hierarchy.isLeaf(link.node));
    EXPECT_LT(surfels.normal[result->hierarchy.sender(link.node)].y, 0.0f);
  }
}

TEST(TraceLinks, theSkyFillsWhatNothingBlocks) {
  TileScene tiles;
  tiles.addRectangle({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, 8);
  tiles.addCache({0, 0, 0}, {0, 1, 0});
  tiles.addCache({0, 50, 0}, {0, 0, 0});
  const auto result = traceTiles(tiles, coneOptions(4096, 254), 64);
  ASSERT_TRUE(result) << result.error().message;
  const Links& links = result->traced.links;
  EXPECT_NEAR(irradianceLinear(lightCache(links, 0, 1.0), {0, 1, 0}), 1.0, 3e-3);
  // Far above, nearly the whole sphere is sky: each patch has its equal share.
  EXPECT_NEAR(transferOf(links, 1), 4 * kY0, 1e-3);
  const auto surfelCount = tiles.surfels().count();
  std::uint32_t patches = 0;
  for (std::uint32_t i = links.rowBegin[1]; i < links.rowBegin[2]; ++i) {
    const ConeLink& link = links.cone[i];
    ASSERT_TRUE(result->hierarchy.isLeaf(link.node));
    const std::uint32_t sender = result->hierarchy.sender(link.node);
    if (sender < surfelCount) continue;
    ++patches;
    EXPECT_NEAR(unpackHalf(link.transfer), 4 * kY0 / 64, 0.4 * 4 * kY0 / 64);
    EXPECT_GT(glm::dot(unpackOctahedral(link.direction), result->hierarchy.skyDirection[sender - surfelCount]), 0.98f);
  }
  EXPECT_EQ(patches, 64u);
}

TEST(TraceLinks, withoutSkySendersMissesCarryNothing) {
  TileScene tiles;
  tiles.addRectangle({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, 8);
  tiles.addCache({0, 0, 0}, {0, 1, 0});
  const auto result = traceTiles(tiles, coneOptions(256, 254), 0);
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->traced.links.count(), 0u);
  EXPECT_EQ(result->traced.statistics.missShare, 1.0);
}

TEST(TraceLinks, emittersSurfacesAndSkyAreNeverInOneLink) {
  TileScene tiles;
  tiles.addRectangle({-1, 2, -1}, {2, 0, 0}, {0, 0, 2}, 4, false, true, glm::vec3(5.0f));
  tiles.addRectangle({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, 8);
  tiles.addCache({0, 1, 0}, {0, 0, 0});
  const auto result = traceTiles(tiles, coneOptions(4096, 3), 64);
  ASSERT_TRUE(result) << result.error().message;
  ASSERT_EQ(result->hierarchy.groupRoot.size(), 3u);
  ASSERT_EQ(result->traced.links.count(), 3u);
  const std::vector<std::uint32_t> parent = test::parentsOf(result->hierarchy);
  std::set<std::uint32_t> groups;
  for (const ConeLink& link : result->traced.links.cone) {
    for (const std::uint32_t root : result->hierarchy.groupRoot) {
      std::uint32_t node = link.node;
      while (node > root) node = parent[node];
      if (node == root) groups.insert(root);
    }
  }
  EXPECT_EQ(groups.size(), 3u);

  const auto refused = traceTiles(tiles, coneOptions(4096, 2), 64);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::usage);
  EXPECT_NE(refused.error().message.find("at least 3"), std::string::npos) << refused.error().message;
}

TEST(TraceLinks, coefficientsOfShLinksAddUpToTheCones) {
  TileScene tiles;
  tiles.addBox(1.0f, 8);
  for (int i = 0; i < 5; ++i) tiles.addCache({0.1f * static_cast<float>(i), 0.0f, 0.3f}, {0, 0, 0});
  LinkOptions options = coneOptions(1024, 60);
  const auto cone = traceTiles(tiles, options);
  options.kind = LinkKind::sh;
  options.bands = 3;
  const auto sh = traceTiles(tiles, options);
  ASSERT_TRUE(cone && sh);
  const Links &a = cone->traced.links, &b = sh->traced.links;
  EXPECT_EQ(b.bands, 3u);
  ASSERT_EQ(a.count(), b.count());
  ASSERT_EQ(b.shCoefficients.size(), b.count() * 9u);
  for (std::uint32_t i = 0; i < a.count(); ++i) {
    EXPECT_EQ(a.cone[i].node, b.shNode[i]);
    EXPECT_NEAR(unpackHalf(a.cone[i].transfer), unpackHalf(b.shCoefficients[i * 9]),
                2e-3 * unpackHalf(a.cone[i].transfer));
  }
  EXPECT_EQ(cone->traced.firstWeight, sh->traced.firstWeight);
}

TEST(TraceLinks, compactKindsStandForTheSameLinks) {
  TileScene tiles;
  tiles.addBox(1.0f, 8);
  // The grid's caches come first, as everywhere.
  for (int i = 0; i < 4; ++i) tiles.addCache({0.1f * static_cast<float>(i), 0.0f, 0.3f}, {0, 0, 0});
  for (int i = 0; i < 4; ++i) tiles.addCache({0.1f * static_cast<float>(i), -0.2f, 0.1f}, {0, 1, 0});
  const Caches caches = tiles.caches();
  const auto traceKind = [&](LinkKind kind) {
    LinkOptions options = coneOptions(1024, 60);
    options.kind = kind;
    options.bands = 3;
    return traceTiles(tiles, options);
  };
  const auto cone = traceKind(LinkKind::cone);
  ASSERT_TRUE(cone);
  for (const LinkKind kind : {LinkKind::oct6, LinkKind::irradiance}) {
    const auto compact = traceKind(kind);
    ASSERT_TRUE(compact);
    const Links& want = cone->traced.links;
    const Links& found = compact->traced.links;
    ASSERT_EQ(found.count(), want.count());
    EXPECT_EQ(found.shape.size(), shapeWords(kind, found.count(), countGridLinks(caches, found)));
    for (std::uint32_t cache = 0; cache < caches.count(); ++cache) {
      const bool surface = cache >= 4;
      std::array<float, 9> a, b;
      double error = 0.0, square = 0.0, irradiance = 0.0;
      for (std::uint32_t i = want.rowBegin[cache]; i < want.rowBegin[cache + 1]; ++i) {
        ASSERT_EQ(found.node(i), want.node(i));
        linkCoefficients(want, i, surface, 3, a);
        linkCoefficients(found, i, surface, 3, b);
        for (std::size_t k = 0; k < 9; ++k) error += std::pow(a[k] - b[k], 2.0), square += a[k] * a[k];
        irradiance += b[0];
      }
      if (kind == LinkKind::irradiance && surface) {
        // Radiosity pi all around: E = pi = 2 pi y_0 c_0.
        EXPECT_NEAR(irradiance * kPi * 2.0 * kPi * kY0, kPi, 5e-3 * kPi);
      } else {
        EXPECT_LT(std::sqrt(error / square), kind == LinkKind::oct6 ? 0.06 : 0.01) << "kind " << static_cast<int>(kind);
      }
    }
  }
}

TEST(TraceLinks, compactKindsRefuseMoreNodesThanTheyCanName) {
  BakeOptions options;
  options.surfels.count = 524288 - options.links.skyPatches + 1;
  EXPECT_FALSE(checkOptions(options));
  options.links.kind = LinkKind::cone;
  EXPECT_TRUE(checkOptions(options));
}

template <class T>
bool sameBytes(const Array<T>& a, const Array<T>& b) {
  return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(T)) == 0);
}

TEST(TraceLinks, theBytesDoNotDependOnTheThreads) {
  TileScene tiles;
  tiles.addBox(1.0f, 16);
  tiles.addRectangle({-0.5f, 0, -0.5f}, {1, 0, 0}, {0, 0, 1}, 6, true);
  RandomStream random(1, 2, 3);
  for (int i = 0; i < 150; ++i) {
    tiles.addCache({random.uniform() - 0.5f, random.uniform() - 0.5f, random.uniform() - 0.5f},
                   i % 2 ? glm::vec3(0, 1, 0) : glm::vec3(0.0f));
  }
  for (const auto kind : {LinkKind::cone, LinkKind::sh, LinkKind::oct6}) {
    for (const auto pull : {LinkOptions::PullWeight::area, LinkOptions::PullWeight::importance}) {
      LinkOptions options = coneOptions(1024, 50);
      options.kind = kind;
      options.pull = pull;
      const auto one = traceTiles(tiles, options, 16, 1), two = traceTiles(tiles, options, 16, 2),
                 five = traceTiles(tiles, options, 16, 5);
      ASSERT_TRUE(one && two && five);
      for (const auto* other : {&*two, &*five}) {
        EXPECT_TRUE(sameBytes(one->traced.links.rowBegin, other->traced.links.rowBegin));
        EXPECT_TRUE(sameBytes(one->traced.links.cone, other->traced.links.cone));
        EXPECT_TRUE(sameBytes(one->traced.links.shNode, other->traced.links.shNode));
        EXPECT_TRUE(sameBytes(one->traced.links.shCoefficients, other->traced.links.shCoefficients));
        EXPECT_TRUE(sameBytes(one->traced.links.head, other->traced.links.head));
        EXPECT_TRUE(sameBytes(one->traced.links.shape, other->traced.links.shape));
        EXPECT_EQ(one->traced.firstWeight, other->traced.firstWeight);
      }
    }
  }
}

TEST(TraceLinks, everyLinkIsOfANodeAndRowsAscend) {
  TileScene tiles;
  tiles.addBox(1.0f, 16);
  for (int i = 0; i < 40; ++i) tiles.addCache({0.02f * static_cast<float>(i), 0, 0}, {0, 0, 0});
  const auto result = traceTiles(tiles, coneOptions(4096, 100));
  ASSERT_TRUE(result) << result.error().message;
  const Links& links = result->traced.links;
  ASSERT_EQ(links.cacheCount(), 40u);
  for (std::uint32_t c = 0; c < 40; ++c) {
    EXPECT_EQ(links.rowBegin[c + 1] - links.rowBegin[c], 100u);
    for (std::uint32_t i = links.rowBegin[c]; i < links.rowBegin[c + 1]; ++i) {
      EXPECT_LT(links.cone[i].node, result->hierarchy.nodeCount());
      if (i > links.rowBegin[c]) {
        EXPECT_LT(links.cone[i - 1].node, links.cone[i].node);
      }
    }
  }
  for (const float w : result->traced.firstWeight) {
    EXPECT_GE(w, 0.0f);
    EXPECT_LE(w, 1.0f);
  }
}

TEST(TraceLinks, noCachesGiveNoLinks) {
  TileScene tiles;
  tiles.addBox(1.0f, 4);
  const auto result = traceTiles(tiles, coneOptions(256, 10));
  ASSERT_TRUE(result) << result.error().message;
  EXPECT_EQ(result->traced.links.count(), 0u);
  EXPECT_EQ(result->traced.firstWeight.size(), result->hierarchy.nodeCount());
}

TEST(TraceLinks, stopsWhenCancelled) {
  TileScene tiles;
  tiles.addBox(1.0f, 4);
  for (int i = 0; i < 2000; ++i) tiles.addCache({0, 0, 0}, {0, 0, 0});
  Context context;
  context.threads = 1;
  auto tracer = RayTracer::create(tiles.scene(), "avx2", context);
  const Surfels surfels = tiles.surfels();
  auto hierarchy = clusterSurfels(surfels, 0, {}, context);
  ASSERT_TRUE(tracer && hierarchy);
  context.onProgress = [](std::string_view, double fraction) { return fraction < 0.02; };
  const auto links =
      traceLinks(*tracer, surfels, tiles.map(), *hierarchy, tiles.caches(), coneOptions(256, 10), 1, context);
  ASSERT_FALSE(links);
  EXPECT_EQ(links.error().code, ErrorCode::failed);
  EXPECT_EQ(links.error().message, "cancelled");
}

}  // namespace
}  // namespace relume
