// SPDX-License-Identifier: MIT
// Each CPU pass against a slow double-precision oracle.
#include "runtime/cpu/light_caches.h"
#include "runtime/cpu/light_surfels.h"
#include "runtime/cpu/pull.h"
#include "runtime/direct_light.h"
#include "runtime/shared/pack_color.h"
#include "runtime/shared/resolve.h"

#include "formats/color.h"
#include "formats/compact_links.h"
#include "formats/pack.h"
#include "formats/sh.h"
#include "tests/packed.h"
#include "tests/runtime/cpu_fixture.h"
#include "tests/runtime/lit_caches.h"
#include "tests/runtime/random_tree.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>
#include <thread>

namespace relume {
namespace {

using test::kPi, test::onTwoThreads, test::randomNodes, test::surfelsKernels;

TEST(Pull, rootIsTheMeanOfEqualAreas) {
  const Bake bake = test::makeSyntheticBake({.surfels = 3001, .linksPerCache = 4});
  for (const cpu::LightSurfelsKernel* kernel : surfelsKernels()) {
    std::vector<std::uint32_t> nodes = randomNodes(bake.hierarchy.nodeCount());
    glm::dvec3 mean(0.0);
    for (const std::uint32_t leaf : bake.hierarchy.leafNode) mean += glm::dvec3(unpackColor(nodes[leaf])) / 3001.0;
    cpu::PullTree(bake.hierarchy, std::pmr::new_delete_resource()).pull(*kernel, nodes, {});
    // A step of rounding a level, but halved with every level above it: two steps of 1/256 (blue: 1/128).
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(unpackColor(nodes[0])[k], mean[k], 0.012);
  }
}

TEST(Pull, roundingLosesNoEnergy) {
  const Bake bake =
      test::makeSyntheticBake({.surfels = 20000, .grid = {1, 1, 1}, .lightmapCaches = 1, .linksPerCache = 4});
  const Hierarchy& h = bake.hierarchy;
  std::vector<std::uint32_t> nodes(h.nodeCount(), 0);
  const glm::vec3 color(0.7001f, 0.33333f, 0.0251f);
  for (const std::uint32_t leaf : h.leafNode) nodes[leaf] = packColor(color, ditherOf(leaf));
  cpu::PullTree(h, std::pmr::new_delete_resource()).pull(*cpu::lightSurfelsKernel(Simd::best), nodes, {});
  for (const std::uint32_t level : {6u, 8u, 10u}) {
    glm::dvec3 mean(0.0);
    const double count = h.levelBegin[level + 1] - h.levelBegin[level];
    for (std::uint32_t i = h.levelBegin[level]; i < h.levelBegin[level + 1]; ++i)
      mean += glm::dvec3(unpackColor(nodes[i])) / count;
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(mean[k], color[k], 0.002 * 0.7) << "level " << level << " channel " << k;
  }
}

TEST(Pull, weightsOtherThanAreasAreObeyedAndThreadsChangeNothing) {
  Bake bake = test::makeSyntheticBake({.surfels = 120000, .grid = {1, 1, 1}, .lightmapCaches = 1, .linksPerCache = 4});
  bake.hierarchy = test::makeRandomTree(120000, 0.05f, 3);
  const Hierarchy& h = bake.hierarchy;
  const cpu::PullTree tree(h, std::pmr::new_delete_resource());
  std::vector<std::uint32_t> first;
  for (const cpu::LightSurfelsKernel* kernel : surfelsKernels()) {
    std::vector<std::uint32_t> one = randomNodes(h.nodeCount()), two = one;
    tree.pull(*kernel, one, {});
    tree.pull(*kernel, two, onTwoThreads);
    ASSERT_EQ(one, two);
    for (std::uint32_t i = 0; i < h.nodeCount(); ++i) {
      if (h.isLeaf(i)) continue;
      const glm::dvec3 a(unpackColor(one[h.child[i]])), b(unpackColor(one[h.child[i] + 1]));
      const double w = h.firstWeight[i];
      const glm::dvec3 want = w * a + (1.0 - w) * b;
      ASSERT_LT(glm::length(glm::dvec3(unpackColor(one[i])) - want), 0.01 * std::max({want.x, want.y, want.z}));
    }
  }
}

TEST(NodeSet, readsAnyPartOfWhatItHolds) {
  std::mt19937 random(11);
  for (const std::uint32_t density : {1u, 3u, 90u}) {
    std::vector<std::uint32_t> members;
    for (std::uint32_t i = 0; i < 5000; ++i) {
      if (random() % density == 0) members.push_back(i);
    }
    const cpu::NodeSet set(
        5000, 16, [&](std::uint32_t node) { return std::binary_search(members.begin(), members.end(), node); },
        std::pmr::new_delete_resource());
    ASSERT_EQ(set.size(), members.size());
    for (int i = 0; i < 200; ++i) {
      const auto first = static_cast<std::uint32_t>(random() % (members.size() + 1));
      const auto count = static_cast<std::uint32_t>(random() % (members.size() - first + 1));
      for (const cpu::LightSurfelsKernel* kernel : surfelsKernels()) {
        std::vector<std::uint32_t> found(count + cpu::kAtRoom);
        set.read(*kernel, first, count, found.data());
        ASSERT_TRUE(std::equal(found.begin(), found.begin() + count, members.begin() + first)) << first << " " << count;
      }
    }
  }
}

TEST(PackColor, isRightToAStepForAllSizesAndToMuchLessInTheMean) {
  for (const float scale : {1e-8f, 0.01f, 1.0f, 3.7f, 1e5f, 4e8f}) {
    const glm::vec3 color = scale * glm::vec3(0.61f, 1.0f, 0.07f);
    glm::dvec3 mean(0.0);
    for (std::uint32_t i = 0; i < 4096; ++i) {
      const glm::vec3 found = unpackColor(packColor(color, ditherOf(i)));
      for (int k = 0; k < 3; ++k) ASSERT_NEAR(found[k], color[k], scale / 127.0f) << scale;
      mean += glm::dvec3(found) / 4096.0;
    }
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(mean[k], color[k], 2e-5 * scale) << scale;
  }
  EXPECT_EQ(packColor(glm::vec3(0.0f), 0.99f), 0u);
  EXPECT_EQ(unpackColor(packColor({1.0f, 1.0f, 1.0f}, 0.5f)), glm::vec3(1.0f));
}

// L_SH of one cache in double precision from the stored links.
std::vector<double> oracle(const Bake& bake, std::span<const std::uint32_t> nodes, std::uint32_t cache, int luma,
                           int chroma) {
  const Links& links = bake.links;
  const LinkSet set(links, std::pmr::new_delete_resource());
  std::vector<double> sum(static_cast<std::size_t>(luma * luma + 2 * chroma * chroma), 0.0);
  for (std::uint32_t k = links.rowBegin[cache]; k < links.rowBegin[cache + 1]; ++k) {
    std::vector<double> c(64, 0.0);
    std::uint32_t node = 0;
    if (links.kind == LinkKind::cone) {
      const ConeLink& link = links.cone[k];
      node = link.node;
      std::array<float, 64> y;
      evaluateSh(8, unpackOctahedral(link.direction), y);
      const double f = unpackHalf(link.transfer), cosAlpha = unpackHalf(link.cosAlpha);
      for (int l = 0; l < 8; ++l) {
        // Z_l / Z_0 by the integral of P_l from cosAlpha to 1, midpoint rule.
        double integral = 0.0;
        const int steps = 2000;
        for (int s = 0; s < steps; ++s) {
          const double x = cosAlpha + (1.0 - cosAlpha) * (s + 0.5) / steps;
          integral += std::legendre(static_cast<unsigned>(l), x) / steps;
        }
        for (int i = l * l; i < (l + 1) * (l + 1); ++i)
          c[static_cast<std::size_t>(i)] = f * integral * y[static_cast<std::size_t>(i)] / y[0];
      }
    } else if (linkHasHead(links.kind)) {
      std::array<float, 64> stored;
      linkCoefficients(links, k, bake.caches.normal[cache] != glm::vec3(0.0f), 8, stored);
      const double rounding = set.rounding(links, k);
      for (std::size_t i = 0; i < c.size(); ++i) c[i] = rounding * stored[i];
      node = links.node(k);
    } else {
      node = links.shNode[k];
      const std::size_t stride = links.bands * links.bands;
      for (std::size_t i = 0; i < stride; ++i) c[i] = unpackHalf(links.shCoefficients[k * stride + i]);
    }
    const auto lumaCount = static_cast<std::size_t>(luma * luma),
               chromaCount = static_cast<std::size_t>(chroma * chroma);
    const glm::vec3 color = rgbToYCoCg(unpackColor(nodes[node]));
    for (std::size_t i = 0; i < lumaCount; ++i) sum[i] += color.x * c[i];
    for (std::size_t i = 0; i < chromaCount; ++i) sum[lumaCount + i] += color.y * c[i];
    for (std::size_t i = 0; i < chromaCount; ++i) sum[lumaCount + chromaCount + i] += color.z * c[i];
  }
  return sum;
}

// Of a cache's coefficients, relative to the first: kernels may take directions of six bits for what 14 bits say.
double precision(LinkKind kind) { return kind == LinkKind::oct6 ? 1e-4 : 2e-5; }

struct KernelCase {
  LinkKind kind;
  Simd simd;
};

// Rounding of stored coefficients, of a cache's largest.
constexpr double kStored = 1.0 / 32768.0;
double largestOf(const std::vector<double>& c) {
  return std::abs(*std::max_element(c.begin(), c.end(), [](double a, double b) { return std::abs(a) < std::abs(b); }));
}

class LightCaches : public testing::TestWithParam<KernelCase> {};

TEST_P(LightCaches, agreesWithTheOracleForEveryPairOfBands) {
  const auto kernel = cpu::lightCachesKernel(GetParam().simd);
  if (!kernel) GTEST_SKIP() << "this processor lacks the instruction set";
  // Row lengths that fill no vector evenly.
  const Bake bake = test::makeSyntheticBake({.surfels = 700,
                                             .grid = {2, 1, 1},
                                             .lightmapCaches = 3,
                                             .linksPerCache = 117,
                                             .kind = GetParam().kind,
                                             .bands = 8});
  const std::vector<std::uint32_t> nodes = randomNodes(bake.hierarchy.nodeCount());
  for (int luma = 1; luma <= 8; ++luma) {
    std::vector<std::vector<double>> expected;
    for (std::uint32_t cache = 0; cache < bake.caches.count(); ++cache)
      expected.push_back(oracle(bake, nodes, cache, luma, luma));
    for (int chroma = 1; chroma <= luma; ++chroma) {
      const auto y = static_cast<std::size_t>(luma * luma), c = static_cast<std::size_t>(chroma * chroma);
      const std::size_t stride = y + 2 * c;
      const std::vector<float> found = test::litCaches(kernel, bake.links, nodes, {luma, chroma}, onTwoThreads);
      for (std::size_t i = 0; i < found.size(); ++i) {
        const std::vector<double>& all = expected[i / stride];
        const std::size_t k = i % stride;
        const double want = k < y ? all[k] : (k < y + c ? all[y + (k - y)] : all[2 * y + (k - y - c)]);
        ASSERT_NEAR(found[i], want, precision(bake.links.kind) * all[0] + kStored * largestOf(all))
            << "l_Y " << luma << " l_C " << chroma << " coefficient " << k;
      }
    }
  }
}

std::vector<KernelCase> allKernels() {
  std::vector<KernelCase> all;
  for (const LinkKind kind : kLinkKinds) {
    for (const Simd simd : {Simd::baseline, Simd::avx2, Simd::avx512}) all.push_back({kind, simd});
  }
  return all;
}

INSTANTIATE_TEST_SUITE_P(Kernels, LightCaches, testing::ValuesIn(allKernels()));

// Nodes of more than 16 bits, whose high part is told by their place in the row; and f of 8 bits.
void expectNodesFound(const Bake& bake) {
  std::uint32_t last = 0;
  for (std::uint32_t i = 0; i < bake.links.count(); ++i) last = std::max(last, bake.links.node(i));
  ASSERT_GT(last, 2u << 16);
  const LinkSet set(bake.links, std::pmr::new_delete_resource());
  EXPECT_LT(set.bytes(), 5 * bake.links.count() + (2 + set.rows().nodeSteps) * bake.caches.count() + 128);
  const std::vector<std::uint32_t> nodes = randomNodes(bake.hierarchy.nodeCount());
  for (std::uint32_t cache = 0; cache < bake.caches.count(); ++cache) {
    double sum = 0.0, wanted = 0.0;
    for (std::uint32_t i = bake.links.rowBegin[cache]; i < bake.links.rowBegin[cache + 1]; ++i) {
      const double f = unpackTransfer(bake.links.head[i] >> 20);
      if (f > 1e-3) {
        ASSERT_NEAR(set.rounding(bake.links, i), 1.0, 0.1);
      }
      sum += f * set.rounding(bake.links, i);
      wanted += f;
    }
    EXPECT_NEAR(sum, wanted, 0.002 * wanted);
  }
  for (const Simd simd : {Simd::baseline, Simd::avx2, Simd::avx512}) {
    const auto kernel = cpu::lightCachesKernel(simd);
    if (!kernel) continue;
    const std::vector<float> found = test::litCaches(kernel, bake.links, nodes, {4, 4});
    for (std::uint32_t cache = 0; cache < bake.caches.count(); ++cache) {
      const std::vector<double> want = oracle(bake, nodes, cache, 4, 4);
      for (std::size_t i = 0; i < 48; ++i)
        ASSERT_NEAR(found[cache * 48 + i], want[i], precision(LinkKind::oct6) * want[0] + kStored * largestOf(want))
            << "cache " << cache;
    }
  }
}

TEST(LightCachesOfManyNodes, findTheirNodes) {
  for (const std::uint32_t links : {117u, 1900u}) {
    SCOPED_TRACE(links);
    expectNodesFound(test::makeSyntheticBake(
        {.surfels = 110000, .grid = {2, 1, 1}, .lightmapCaches = 6, .linksPerCache = links, .kind = LinkKind::oct6}));
  }
}

// Rows whose links are too many for 16 bits of where they begin.
TEST(LightCachesOfManyNodes, findTheirRows) {
  const Bake bake = test::makeSyntheticBake(
      {.surfels = 40000, .grid = {2, 1, 1}, .lightmapCaches = 6, .linksPerCache = 30000, .kind = LinkKind::oct6});
  ASSERT_GT(bake.links.rowBegin[bake.caches.count()], 3u << 16);
  const LinkSet set(bake.links, std::pmr::new_delete_resource());
  const LinkRows rows = set.rows();
  ASSERT_LT(1u << rows.rowShift, bake.caches.count());
  EXPECT_EQ(set.count(), bake.links.count());
  EXPECT_EQ(set.cacheCount(), bake.caches.count());
  for (std::uint32_t cache = 0; cache <= bake.caches.count(); ++cache)
    EXPECT_EQ(rowBegin(rows, cache), bake.links.rowBegin[cache]);
}

class LightCachesRows : public testing::TestWithParam<LinkKind> {};

TEST_P(LightCachesRows, ofOddSizesAndShort) {
  for (std::uint32_t bands = 1; bands <= 8; ++bands) {
    for (const std::uint32_t perCache : {1u, 2u, 5u}) {
      const Bake bake = test::makeSyntheticBake({.surfels = 16,
                                                 .grid = {1, 1, 1},
                                                 .lightmapCaches = 2,
                                                 .linksPerCache = perCache,
                                                 .kind = GetParam(),
                                                 .bands = bands});
      const std::vector<std::uint32_t> nodes = randomNodes(bake.hierarchy.nodeCount());
      const auto stride = static_cast<std::size_t>(3 * bands * bands);
      for (const Simd simd : {Simd::baseline, Simd::avx2, Simd::avx512}) {
        const auto kernel = cpu::lightCachesKernel(simd);
        if (!kernel) continue;
        const int b = static_cast<int>(bands);
        const std::vector<float> found = test::litCaches(kernel, bake.links, nodes, {b, b});
        for (std::uint32_t cache = 0; cache < bake.caches.count(); ++cache) {
          const std::vector<double> want = oracle(bake, nodes, cache, b, b);
          for (std::size_t i = 0; i < stride; ++i)
            ASSERT_NEAR(found[cache * stride + i], want[i],
                        precision(GetParam()) * (1 + want[0]) + kStored * largestOf(want));
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, LightCachesRows, testing::ValuesIn(kLinkKinds));

// A uniform world gives a surface cache its irradiance, pi L, from one coefficient.
TEST(IrradianceLinks, giveTheIrradianceOfAUniformWorld) {
  const Bake bake = test::makeSyntheticBake({.kind = LinkKind::irradiance});
  const std::vector<std::uint32_t> nodes(bake.hierarchy.nodeCount(), packColor(glm::vec3(kPi), 0.5f));
  for (const auto& [luma, chroma] : {std::pair{1, 1}, {2, 1}, {4, 4}}) {
    const std::vector<float> coefficients =
        test::litCaches(cpu::lightCachesBaseline, bake.links, nodes, {luma, chroma});
    const CacheLight light{{luma, chroma, true}, coefficients};
    for (std::uint32_t s = 0; s < bake.surfels.count(); s += 7) {
      if (bake.surfels.receiver[s] == kGridReceiver) continue;
      const glm::vec2 uv = unpackUnorm16x2(bake.surfels.receiver[s]);
      for (const glm::vec3& n : {bake.surfels.normal[s], glm::normalize(glm::vec3(1, 2, 3))}) {
        EXPECT_NEAR(irradianceOnLightmap(test::packed(bake.caches), light, uv, n).g, kPi, 0.005 * kPi);
      }
    }
  }
}

TEST(DirectIrradiance, followsTheDefinitionsOfEachKind) {
  const glm::vec3 up(0, 0, 1), origin(0);
  Light sun{.kind = LightKind::directional, .intensity = {3, 2, 1}, .direction = glm::normalize(glm::vec3(1, 0, -1))};
  EXPECT_NEAR(directIrradiance(sun, origin, up).x, 3.0f * std::sqrt(0.5f), 1e-5f);
  EXPECT_EQ(directIrradiance(sun, origin, -up), glm::vec3(0.0f));
  // E = I cos / d²: at height 2, one to the side: I 2 / 5^1.5.
  Light point{.kind = LightKind::point, .intensity = glm::vec3(10), .positionWorld = {1, 0, 2}};
  EXPECT_NEAR(directIrradiance(point, origin, up).y, 10.0f * 2.0f / std::pow(5.0f, 1.5f), 1e-5f);
  // The window of a range of 4 at distance sqrt 5: 1 - (5/16)².
  point.range = 4.0f;
  EXPECT_NEAR(directIrradiance(point, origin, up).y, 20.0f / std::pow(5.0f, 1.5f) * (1.0f - 25.0f / 256.0f), 1e-5f);
  point.range = 2.0f;
  EXPECT_EQ(directIrradiance(point, origin, up), glm::vec3(0.0f));
  // A spot straight above: inside the inner cone like a point light, outside the outer cone nothing, the square
  // between.
  Light spot{.kind = LightKind::spot,
             .intensity = glm::vec3(10),
             .positionWorld = {0, 0, 2},
             .direction = -up,
             .innerConeRad = 0.3f,
             .outerConeRad = 0.6f};
  EXPECT_NEAR(directIrradiance(spot, origin, up).x, 2.5f, 1e-5f);
  EXPECT_EQ(directIrradiance(spot, glm::vec3(2.0f * std::tan(0.61f), 0, 0), up), glm::vec3(0.0f));
  const float angle = 0.45f, d = 2.0f / std::cos(angle);
  const float t = (std::cos(angle) - std::cos(0.6f)) / (std::cos(0.3f) - std::cos(0.6f));
  EXPECT_NEAR(directIrradiance(spot, glm::vec3(2.0f * std::tan(angle), 0, 0), up).x,
              10.0f * std::cos(angle) / (d * d) * t * t, 1e-5f);
}

TEST(SurfelSet, liesOnTheLitSideOfWhatItStandsForAndNear) {
  const Bake bake = test::makeSyntheticBake({.surfels = 3000, .lightmapCaches = 260});
  const auto order = cpu::leafOrder(bake.hierarchy, bake.surfels.count(), std::pmr::new_delete_resource());
  const cpu::SurfelSet surfels(bake.surfels, bake.hierarchy, bake.emitters, order, true,
                               std::pmr::new_delete_resource());
  cpu::LightSurfelsJob job;
  surfels.describe(job);
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    const glm::vec3 n = bake.surfels.normal[order[i]];
    const glm::vec3 off = cpu::surfelPosition(job, i) - bake.surfels.positionWorld[order[i]];
    ASSERT_GT(glm::dot(off, n), -0.02f * std::max({job.step[0], job.step[1], job.step[2]}) - 1e-6f) << "surfel " << i;
    for (int k = 0; k < 3; ++k) ASSERT_LE(std::abs(off[k]), 1.01f * job.step[k] + 1e-6f);
    ASSERT_GT(glm::dot(cpu::unpackSurfelNormal(job.word[2][i]), n), 1.0f - 1e-6f);
  }
}

// Every kernel against directIrradiance(), at what the packed surfels are.
TEST(LightSurfels, kernelsGiveTheIrradianceOfEveryLight) {
  const Bake bake = test::makeSyntheticBake({.surfels = 3000, .lightmapCaches = 260});
  const std::vector<Light> lights = test::someLights();
  LightSetup setup;
  setup.lights = lights;
  const auto order = cpu::leafOrder(bake.hierarchy, bake.surfels.count(), std::pmr::new_delete_resource());
  const cpu::SurfelSet surfels(bake.surfels, bake.hierarchy, bake.emitters, order, true,
                               std::pmr::new_delete_resource());
  const float radius = discRadius(bake.surfels.areaEach);
  for (const cpu::LightSurfelsKernel* kernel : surfelsKernels()) {
    std::vector<std::uint32_t> nodes(bake.hierarchy.nodeCount(), 0);
    std::pmr::vector<cpu::PreparedLight> prepared(std::pmr::new_delete_resource());
    cpu::lightSurfels(*kernel, surfels, setup, nullptr, {}, prepared, nodes, onTwoThreads);
    std::size_t lit = 0;
    glm::dvec3 energy(0.0), wanted(0.0);
    for (std::uint32_t s = 0; s < bake.surfels.count(); ++s) {
      glm::vec3 e(0.0f);
      for (const Light& light : lights)
        e += directIrradiance(light, bake.surfels.positionWorld[s], bake.surfels.normal[s], radius);
      const glm::vec3 want = bake.surfels.albedo[s] * e + static_cast<float>(kPi) * bake.surfels.emission[s];
      const glm::vec3 found = unpackColor(nodes[bake.hierarchy.leafNode[s]]);
      lit += e != glm::vec3(0.0f) ? 1 : 0;
      energy += glm::dvec3(found);
      wanted += glm::dvec3(want);
      // Albedo in 8 bits and colours of 8 to 9.
      const float largest = std::max({want.r, want.g, want.b, e.r * 0.5f, e.g * 0.5f, e.b * 0.5f});
      ASSERT_LT(glm::length(found - want), 0.025f * largest + 1e-4f) << "surfel " << s;
    }
    EXPECT_GT(lit, 1000u);
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(energy[k], wanted[k], 5e-4 * wanted[k]) << k;
  }
}

// The solid angle of a disc over its area, by a sum over its rings.
double discMean(float height, float across) {
  constexpr int kRings = 200, kTurns = 200;
  double sum = 0.0, weights = 0.0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double r = (ring + 0.5) / kRings;
    for (int turn = 0; turn < kTurns; ++turn) {
      const double angle = 2.0 * kPi * (turn + 0.5) / kTurns, h = static_cast<double>(height);
      const double x = r * std::cos(angle) - static_cast<double>(across), y = r * std::sin(angle);
      sum += r * h / std::pow(x * x + y * y + h * h, 1.5);
      weights += r;
    }
  }
  return sum / weights;
}

TEST(DirectLight, aDiscGetsItsMean) {
  for (const float height : {0.1f, 0.3f, 1.0f, 2.0f, 4.0f}) {
    for (const float across : {0.0f, 0.3f, 0.6f, 0.9f, 1.1f, 1.5f, 2.0f, 3.0f, 5.0f}) {
      const Light light{
          .kind = LightKind::point, .intensity = glm::vec3(1.0f), .positionWorld = {across, height, 0.0f}};
      const double mean = discMean(height, across), within = across == 0.0f ? 0.002 : 0.14;
      EXPECT_NEAR(directIrradiance(light, glm::vec3(0.0f), {0, 1, 0}, 1.0f).x, mean, within * mean)
          << height << ", " << across;
    }
  }
}

// A plane of surfels gets half of what a light before it sends, in the mean over where before them that is, however
// near, and no surfel more than that.
TEST(DirectLight, aPlaneOfDiscsGetsHalfOfALightsFluxHoweverNearThatIs) {
  constexpr float kStep = 0.1f, kArea = kStep * kStep;
  constexpr int kSide = 100, kOffsets = 8;
  const float radius = discRadius(kArea), half = 2.0f * static_cast<float>(kPi);
  for (const float height : {1e-5f, 0.003f, 0.02f, 0.05f, 0.1f, 0.3f}) {
    double mean = 0.0;
    for (int offset = 0; offset < kOffsets * kOffsets; ++offset) {
      const auto across = [&](int i) { return kStep / 2 * (static_cast<float>(i) + 0.5f) / float{kOffsets}; };
      Light light{.kind = LightKind::point, .intensity = glm::vec3(1.0f)};
      light.positionWorld = {across(offset % kOffsets), height, across(offset / kOffsets)};
      double flux = 0.0;
      for (int i = -kSide; i <= kSide; ++i) {
        for (int k = -kSide; k <= kSide; ++k) {
          const glm::vec3 at(kStep * static_cast<float>(i), 0.0f, kStep * static_cast<float>(k));
          const float e = directIrradiance(light, at, {0, 1, 0}, radius).x;
          ASSERT_LE(e * kArea, 1.0001f * half) << height;
          flux += static_cast<double>(e * kArea);
        }
      }
      mean += flux / (kOffsets * kOffsets);
      const double off = height >= 0.05f ? 0.1 : height >= 0.02f ? 0.35 : 1.0;
      EXPECT_NEAR(flux, half, off * half) << height << ", " << offset;
    }
    EXPECT_NEAR(mean, half, 0.05 * half) << height;
  }
  // Far away a disc is its middle; below its plane nothing arrives.
  const Light far{.kind = LightKind::point, .intensity = glm::vec3(1.0f), .positionWorld = {1.0f, 0.5f, 0.0f}};
  const glm::vec3 up(0, 1, 0), origin(0.0f);
  EXPECT_NEAR(directIrradiance(far, origin, up, 0.139f).x, directIrradiance(far, origin, up).x, 0.015f);
  const Light below{.kind = LightKind::point, .intensity = glm::vec3(1.0f), .positionWorld = {0.0f, -1e-4f, 0.0f}};
  EXPECT_EQ(directIrradiance(below, origin, up, 0.1f), glm::vec3(0.0f));
}

// However near a light is: hosts that bring their shadows get what the kernels give.
TEST(DirectLight, staysFiniteWhereSquaresOfDistancesVanish) {
  const glm::vec3 up(0, 1, 0);
  for (const LightKind kind : {LightKind::point, LightKind::spot}) {
    for (const float distance : {1e-38f, 1e-30f, 1e-23f, 1e-20f, 1e-10f, 1e-6f, 1e-4f}) {
      const Light light{
          .kind = kind, .intensity = {1e20f, 0, 1}, .positionWorld = {0, distance, 0}, .outerConeRad = 3.0f};
      const glm::vec3 e = directIrradiance(light, glm::vec3(0.0f), up);
      EXPECT_TRUE(e.x >= 0.0f && e.x <= 1.001e28f) << distance << ": " << e.x;
      EXPECT_EQ(e.y, 0.0f) << distance;
      EXPECT_TRUE(e.z >= 0.0f && e.z <= 1.001e8f) << distance << ": " << e.z;
    }
  }
}

}  // namespace
}  // namespace relume
