// SPDX-License-Identifier: MIT
// Each CPU pass against a slow double-precision oracle.
#include "runtime/cpu/bounce.h"
#include "runtime/cpu/light_caches.h"
#include "runtime/cpu/light_surfels.h"
#include "runtime/cpu/pull.h"
#include "runtime/cpu/resolve.h"

#include "formats/compact_links.h"
#include "formats/color.h"
#include "formats/pack.h"
#include "formats/sh.h"
#include "tests/runtime/synthetic_bake.h"

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <thread>

namespace relume {
namespace {

constexpr double kPi = std::numbers::pi;

std::vector<glm::vec4> randomNodes(std::size_t count) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uniform(0.0f, 2.0f);
  std::vector<glm::vec4> nodes;
  for (std::size_t i = 0; i < count; ++i) {
    const float r = uniform(random), g = uniform(random), b = uniform(random);
    nodes.emplace_back(rgbToYCoCg({r, g, b}), 0.0f);
  }
  return nodes;
}

// Runs tasks on two threads, in an order of its own.
void onTwoThreads(std::uint32_t tasks, const std::function<void(std::uint32_t)>& body) {
  std::thread other([&] {
    for (std::uint32_t i = 1; i < tasks; i += 2) body(i);
  });
  for (std::uint32_t i = 0; i < tasks; i += 2) body(i);
  other.join();
}

TEST(Pull, rootIsTheMeanOfEqualAreas) {
  const Bake bake = test::makeSyntheticBake({.surfels = 3001, .linksPerCache = 4});
  std::vector<glm::vec4> nodes = randomNodes(bake.hierarchy.nodeCount());
  glm::dvec3 mean(0.0);
  for (const std::uint32_t leaf : bake.hierarchy.leafNode) mean += glm::dvec3(nodes[leaf]) / 3001.0;
  cpu::pull(bake.hierarchy, nodes, {});
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(nodes[0][k], mean[k], 1e-5);
}

TEST(Pull, weightsOtherThanAreasAreObeyedAndThreadsChangeNothing) {
  Bake bake = test::makeSyntheticBake({.surfels = 40000, .grid = {1, 1, 1}, .lightmapCaches = 1, .linksPerCache = 4});
  std::vector<float> weight = bake.hierarchy.firstWeight.toVector();
  std::mt19937 random(3);
  for (float& w : weight) w = static_cast<float>(random() % 1001) / 1000.0f;
  bake.hierarchy.firstWeight = std::move(weight);
  std::vector<glm::vec4> one = randomNodes(bake.hierarchy.nodeCount()), two = one;
  cpu::pull(bake.hierarchy, one, {});
  cpu::pull(bake.hierarchy, two, onTwoThreads);
  const Hierarchy& h = bake.hierarchy;
  for (std::uint32_t i = 0; i < h.nodeCount(); ++i) {
    ASSERT_EQ(one[i], two[i]);
    if (h.isLeaf(i)) continue;
    const glm::dvec4 a(one[h.child[i]]), b(one[h.child[i] + 1]);
    const double w = h.firstWeight[i];
    ASSERT_LT(glm::length(glm::dvec4(one[i]) - (w * a + (1.0 - w) * b)), 1e-6);
  }
}

// L_SH of one cache in double precision from the stored links.
std::vector<double> oracle(const Bake& bake, std::span<const glm::vec4> nodes, std::uint32_t cache, int luma, int chroma) {
  const Links& links = bake.links;
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
        for (int i = l * l; i < (l + 1) * (l + 1); ++i) c[static_cast<std::size_t>(i)] = f * integral * y[static_cast<std::size_t>(i)] / y[0];
      }
    } else if (linkHasHead(links.kind)) {
      std::array<float, 64> stored;
      linkCoefficients(links, k, bake.caches.normal[cache] != glm::vec3(0.0f), 8, stored);
      std::copy(stored.begin(), stored.end(), c.begin());
      node = links.node(k);
    } else {
      node = links.shNode[k];
      const std::size_t stride = links.bands * links.bands;
      for (std::size_t i = 0; i < stride; ++i) c[i] = unpackHalf(links.shCoefficients[k * stride + i]);
    }
    const auto lumaCount = static_cast<std::size_t>(luma * luma), chromaCount = static_cast<std::size_t>(chroma * chroma);
    for (std::size_t i = 0; i < lumaCount; ++i) sum[i] += nodes[node].x * c[i];
    for (std::size_t i = 0; i < chromaCount; ++i) sum[lumaCount + i] += nodes[node].y * c[i];
    for (std::size_t i = 0; i < chromaCount; ++i) sum[lumaCount + chromaCount + i] += nodes[node].z * c[i];
  }
  return sum;
}

struct KernelCase {
  LinkKind kind;
  Simd simd;
};

class LightCaches : public testing::TestWithParam<KernelCase> {};

TEST_P(LightCaches, agreesWithTheOracleForEveryPairOfBands) {
  const auto kernel = cpu::lightCachesKernel(GetParam().simd);
  if (!kernel) GTEST_SKIP() << "this processor lacks the instruction set";
  // Row lengths that fill no vector evenly.
  const Bake bake = test::makeSyntheticBake({.surfels = 700, .grid = {2, 1, 1}, .lightmapCaches = 3, .linksPerCache = 117,
                                             .kind = GetParam().kind, .bands = 8});
  const std::vector<glm::vec4> nodes = randomNodes(bake.hierarchy.nodeCount());
  for (int luma = 1; luma <= 8; ++luma) {
    std::vector<std::vector<double>> expected;
    for (std::uint32_t cache = 0; cache < bake.caches.count(); ++cache) expected.push_back(oracle(bake, nodes, cache, luma, luma));
    for (int chroma = 1; chroma <= luma; ++chroma) {
      const auto y = static_cast<std::size_t>(luma * luma), c = static_cast<std::size_t>(chroma * chroma);
      const std::size_t stride = y + 2 * c;
      std::vector<float> found(bake.caches.count() * stride, -1.0f);
      cpu::lightCaches(kernel, bake.links, nodes, luma, chroma, found, onTwoThreads);
      for (std::size_t i = 0; i < found.size(); ++i) {
        const std::vector<double>& all = expected[i / stride];
        const std::size_t k = i % stride;
        const double want = k < y ? all[k] : (k < y + c ? all[y + (k - y)] : all[2 * y + (k - y - c)]);
        ASSERT_NEAR(found[i], want, 2e-5 * all[0]) << "l_Y " << luma << " l_C " << chroma << " coefficient " << k;
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

class LightCachesRows : public testing::TestWithParam<LinkKind> {};

TEST_P(LightCachesRows, ofOddSizesAndShort) {
  for (std::uint32_t bands = 1; bands <= 8; ++bands) {
    for (const std::uint32_t perCache : {1u, 2u, 5u}) {
      const Bake bake = test::makeSyntheticBake({.surfels = 16, .grid = {1, 1, 1}, .lightmapCaches = 2, .linksPerCache = perCache,
                                                 .kind = GetParam(), .bands = bands});
      const std::vector<glm::vec4> nodes = randomNodes(bake.hierarchy.nodeCount());
      const auto stride = static_cast<std::size_t>(3 * bands * bands);
      for (const Simd simd : {Simd::baseline, Simd::avx2, Simd::avx512}) {
        const auto kernel = cpu::lightCachesKernel(simd);
        if (!kernel) continue;
        std::vector<float> found(bake.caches.count() * stride);
        const int b = static_cast<int>(bands);
        cpu::lightCaches(kernel, bake.links, nodes, b, b, found, {});
        for (std::uint32_t cache = 0; cache < bake.caches.count(); ++cache) {
          const std::vector<double> want = oracle(bake, nodes, cache, b, b);
          for (std::size_t i = 0; i < stride; ++i) ASSERT_NEAR(found[cache * stride + i], want[i], 1e-5 * (1 + want[0]));
        }
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, LightCachesRows, testing::ValuesIn(kLinkKinds));

// A uniform world gives a surface cache its irradiance, pi L, from one coefficient.
TEST(IrradianceLinks, giveTheIrradianceOfAUniformWorld) {
  const Bake bake = test::makeSyntheticBake({.kind = LinkKind::irradiance});
  const std::vector<glm::vec4> nodes(bake.hierarchy.nodeCount(), glm::vec4(kPi, 0.0f, 0.0f, 0.0f));
  for (const auto& [luma, chroma] : {std::pair{1, 1}, {2, 1}, {4, 4}}) {
    std::vector<float> coefficients(bake.caches.count() * static_cast<std::size_t>(luma * luma + 2 * chroma * chroma));
    cpu::lightCaches(cpu::lightCachesBaseline, bake.links, nodes, luma, chroma, coefficients, {});
    const cpu::CacheLight light{luma, chroma, coefficients, true};
    for (std::uint32_t s = 0; s < bake.surfels.count(); s += 7) {
      if (bake.surfels.receiver[s] == kGridReceiver) continue;
      const glm::vec2 uv = unpackUnorm16x2(bake.surfels.receiver[s]);
      for (const glm::vec3& n : {bake.surfels.normal[s], glm::normalize(glm::vec3(1, 2, 3))}) {
        EXPECT_NEAR(cpu::irradianceOnLightmap(bake.caches, light, uv, n).g, kPi, 0.005 * kPi);
      }
    }
  }
}

TEST(DirectIrradiance, followsTheDefinitionsOfEachKind) {
  const glm::vec3 up(0, 0, 1), origin(0);
  Light sun{.kind = LightKind::directional, .intensity = {3, 2, 1}, .direction = glm::normalize(glm::vec3(1, 0, -1))};
  EXPECT_NEAR(cpu::directIrradiance(sun, origin, up).x, 3.0f * std::sqrt(0.5f), 1e-5f);
  EXPECT_EQ(cpu::directIrradiance(sun, origin, -up), glm::vec3(0.0f));
  // E = I cos / d²: at height 2, one to the side: I 2 / 5^1.5.
  Light point{.kind = LightKind::point, .intensity = glm::vec3(10), .positionWorld = {1, 0, 2}};
  EXPECT_NEAR(cpu::directIrradiance(point, origin, up).y, 10.0f * 2.0f / std::pow(5.0f, 1.5f), 1e-5f);
  // The window of a range of 4 at distance sqrt 5: 1 - (5/16)².
  point.range = 4.0f;
  EXPECT_NEAR(cpu::directIrradiance(point, origin, up).y, 20.0f / std::pow(5.0f, 1.5f) * (1.0f - 25.0f / 256.0f), 1e-5f);
  point.range = 2.0f;
  EXPECT_EQ(cpu::directIrradiance(point, origin, up), glm::vec3(0.0f));
  // A spot straight above: inside the inner cone like a point light, outside the outer cone nothing, the square between.
  Light spot{.kind = LightKind::spot, .intensity = glm::vec3(10), .positionWorld = {0, 0, 2}, .direction = -up,
             .innerConeRad = 0.3f, .outerConeRad = 0.6f};
  EXPECT_NEAR(cpu::directIrradiance(spot, origin, up).x, 2.5f, 1e-5f);
  EXPECT_EQ(cpu::directIrradiance(spot, glm::vec3(2.0f * std::tan(0.61f), 0, 0), up), glm::vec3(0.0f));
  const float angle = 0.45f, d = 2.0f / std::cos(angle);
  const float t = (std::cos(angle) - std::cos(0.6f)) / (std::cos(0.3f) - std::cos(0.6f));
  EXPECT_NEAR(cpu::directIrradiance(spot, glm::vec3(2.0f * std::tan(angle), 0, 0), up).x, 10.0f * std::cos(angle) / (d * d) * t * t, 1e-5f);
}

// A light map of 2 x 1 texels over caches whose coefficients are those of constant radiance 1 and 3 from above +Z.
struct TwoTexels {
  Caches caches;
  std::vector<float> coefficients;
  cpu::CacheLight light;

  TwoTexels(int luma, int chroma, std::vector<std::uint32_t> texels) {
    caches.positionWorld = std::vector<glm::vec3>(2, glm::vec3(0.0f));
    caches.normal = std::vector<glm::vec3>(2, glm::vec3(0, 0, 1));
    caches.lightmap.width = 2;
    caches.lightmap.height = 1;
    caches.lightmap.cache = std::move(texels);
    const glm::vec3 tint = rgbToYCoCg({1.0f, 0.5f, 0.25f});
    for (const float radiance : {1.0f, 3.0f}) {
      std::array<double, 64> c = hemisphere();
      for (int channel = 0; channel < 3; ++channel) {
        const int bands = channel == 0 ? luma : chroma;
        for (int i = 0; i < bands * bands; ++i) coefficients.push_back(radiance * tint[channel] * static_cast<float>(c[static_cast<std::size_t>(i)]));
      }
    }
    light = {luma, chroma, coefficients, false};
  }

  // Projection of the upper half of the sphere: only m = 0, 2 pi K_l Int_0^1 P_l.
  static std::array<double, 64> hemisphere() {
    std::array<double, 64> c{};
    for (int l = 0; l < 8; ++l) {
      double integral = 0.0;
      for (int s = 0; s < 4000; ++s) integral += std::legendre(static_cast<unsigned>(l), (s + 0.5) / 4000.0) / 4000.0;
      c[static_cast<std::size_t>(l * l + l)] = 2 * kPi * std::sqrt((2 * l + 1) / (4 * kPi)) * integral;
    }
    return c;
  }
};

TEST(ResolveLightmap, isExactForTheCachesOwnNormalWithAnyBands) {
  for (int luma = 1; luma <= 8; ++luma) {
    for (int chroma = 1; chroma <= luma; ++chroma) {
      const TwoTexels map(luma, chroma, {0, 1});
      // A quarter of the way between the texel centres: radiance 1.5.
      const glm::vec3 e = cpu::irradianceOnLightmap(map.caches, map.light, {0.375f, 0.3f}, {0, 0, 1});
      const float want = static_cast<float>(1.5 * kPi);
      EXPECT_NEAR(e.r, want, 2e-3f) << luma << " " << chroma;
      EXPECT_NEAR(e.g, 0.5f * want, 2e-3f) << luma << " " << chroma;
      EXPECT_NEAR(e.b, 0.25f * want, 2e-3f) << luma << " " << chroma;
    }
  }
}

TEST(ResolveLightmap, texelsWithoutACacheCountNothing) {
  const TwoTexels map(4, 4, {kNoCache, 1});
  const float want = static_cast<float>(3.0 * kPi);
  EXPECT_NEAR(cpu::irradianceOnLightmap(map.caches, map.light, {0.3f, 0.5f}, {0, 0, 1}).r, want, 2e-3f);
  EXPECT_EQ(cpu::irradianceOnLightmap(map.caches, map.light, {0.1f, 0.5f}, {0, 0, 1}), glm::vec3(0.0f));
  const TwoTexels empty(4, 4, {kNoCache, kNoCache});
  EXPECT_EQ(cpu::irradianceOnLightmap(empty.caches, empty.light, {0.5f, 0.5f}, {0, 0, 1}), glm::vec3(0.0f));
}

TEST(ResolveLightmap, isNeverNegativeAndTakesAnyCoordinate) {
  const TwoTexels map(4, 4, {0, 1});
  const float nan = std::nanf("");
  for (const glm::vec2 uv : {glm::vec2(-5, 9), glm::vec2(1e30f, 0), glm::vec2(nan, nan)}) {
    const glm::vec3 e = cpu::irradianceOnLightmap(map.caches, map.light, uv, {0, 0, -1});
    EXPECT_GE(e.r, 0.0f);
    EXPECT_GE(e.g, 0.0f);
    EXPECT_GE(e.b, 0.0f);
  }
}

TEST(ResolveLightmap, tiltedNormalsBlendToTheClampedCosine) {
  const TwoTexels map(4, 4, {0, 0});
  const glm::vec3 tilted(std::sin(1.2f), 0.0f, std::cos(1.2f));
  const float want = irradianceAtSurface(4, std::span<const float>(map.coefficients).first(16), tilted, {0, 0, 1});
  const glm::vec3 e = cpu::irradianceOnLightmap(map.caches, map.light, {0.5f, 0.5f}, tilted);
  EXPECT_NEAR(rgbToYCoCg(e).x, want, 1e-4f);
}

TEST(ResolveLightmap, aTiltedPlaneInAUniformWorldGetsAllItsLight) {
  for (const auto& [luma, chroma] : {std::pair{1, 1}, {2, 1}, {3, 3}, {4, 4}, {8, 2}}) {
    const TwoTexels map(luma, chroma, {0, 0});
    for (float angle = 0.0f; angle < 1.04f; angle += 0.05f) {
      const glm::vec3 tilted(std::sin(angle), 0.0f, std::cos(angle));
      const glm::vec3 e = cpu::irradianceOnLightmap(map.caches, map.light, {0.5f, 0.5f}, tilted);
      EXPECT_NEAR(e.r, kPi, 0.01 * kPi) << luma << " bands, angle " << angle;
      // A normal map on the cache's own plane turns away from light, as it should.
      const glm::vec3 mapped = cpu::irradianceOnLightmap(map.caches, map.light, {0.5f, 0.5f}, tilted, {0, 0, 1});
      const double caught = luma > 1 ? 0.5 + 0.5 * std::cos(angle) : 1.0;
      EXPECT_NEAR(mapped.r, kPi * caught, 0.05 * kPi) << luma << " bands, angle " << angle;
    }
  }
}

// A grid of 2 x 1 x 1 points one metre apart, full spheres of constant radiance 1 and 3.
TEST(ResolveGrid, interpolatesClampsAndWeighsByNormal) {
  Caches caches;
  caches.positionWorld = std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}};
  caches.normal = std::vector<glm::vec3>(2, glm::vec3(0.0f));
  caches.grid.resolution = {2, 1, 1};
  caches.grid.spacing = glm::vec3(1.0f);
  caches.grid.cache = std::vector<std::uint32_t>{0, 1};
  std::vector<float> coefficients(2 * 48, 0.0f);
  const auto full = static_cast<float>(2 * std::sqrt(kPi));
  coefficients[0] = full;
  coefficients[48] = 3.0f * full;
  const cpu::CacheLight light{4, 4, coefficients, false};
  const auto pi = static_cast<float>(kPi);
  const glm::vec3 side(0, 1, 0);
  // Both points lie in the receiver's plane: plain linear interpolation. Grey light has Y = R = G = B.
  EXPECT_NEAR(cpu::irradianceInGrid(caches, light, {0.25f, 0, 0}, side).g, 1.5f * pi, 1e-3f);
  EXPECT_NEAR(cpu::irradianceInGrid(caches, light, {-7, 3, 2}, side).g, pi, 1e-3f);
  // Facing +X from the middle: weight 1 ahead, 0.05² behind.
  const float behind = 0.05f * 0.05f;
  EXPECT_NEAR(cpu::irradianceInGrid(caches, light, {0.5f, 0, 0}, {1, 0, 0}).g, pi * (3.0f + behind) / (1.0f + behind), 1e-3f);
  caches.grid.cache = std::vector<std::uint32_t>{0, kNoCache};
  EXPECT_NEAR(cpu::irradianceInGrid(caches, light, {0.9f, 0, 0}, side).g, pi, 1e-3f);
  caches.grid.cache = std::vector<std::uint32_t>{kNoCache, kNoCache};
  EXPECT_EQ(cpu::irradianceInGrid(caches, light, {0.9f, 0, 0}, side), glm::vec3(0.0f));
}

// The table of band 1 gives what the general resolve gives, for all kinds of receivers.
TEST(Bounce, agreesWithResolveAtEverySurfel) {
  for (const LinkKind kind : {LinkKind::cone, LinkKind::irradiance}) {
    Bake bake = test::makeSyntheticBake({.surfels = 3000, .lightmapCaches = 260, .kind = kind});
    // Some normals that are no longer the map's.
    std::vector<glm::vec3> normal = bake.surfels.normal.toVector();
    for (std::size_t s = 0; s < normal.size(); s += 5) normal[s] = glm::normalize(normal[s] + glm::vec3(0.3f, 0.2f, 0.1f));
    bake.surfels.normal = std::move(normal);
    const std::vector<glm::vec4> nodes = randomNodes(bake.hierarchy.nodeCount());
    for (const auto& [luma, chroma] : {std::pair{1, 1}, {2, 1}, {2, 2}, {4, 1}, {4, 3}, {6, 2}}) {
      std::vector<float> coefficients(bake.caches.count() * static_cast<std::size_t>(luma * luma + 2 * chroma * chroma));
      cpu::lightCaches(cpu::lightCachesBaseline, bake.links, nodes, luma, chroma, coefficients, {});
      const cpu::CacheLight light{luma, chroma, coefficients, kind == LinkKind::irradiance};
      cpu::Bounce bounce(bake, luma, chroma, {});
      bounce.setLight(light, {});
      std::size_t gridLit = 0;
      for (std::uint32_t s = 0; s < bake.surfels.count(); ++s) {
        const Surfels& surfels = bake.surfels;
        const bool grid = surfels.receiver[s] == kGridReceiver;
        gridLit += grid ? 1 : 0;
        const glm::vec3 want =
            grid ? cpu::irradianceInGrid(bake.caches, light, surfels.positionWorld[s], surfels.normal[s])
                 : cpu::irradianceOnLightmap(bake.caches, light, unpackUnorm16x2(surfels.receiver[s]), surfels.normal[s]);
        ASSERT_LT(glm::length(bounce.irradiance(s) - want), 1e-4f * (1.0f + glm::length(want))) << "surfel " << s;
      }
      EXPECT_GT(gridLit, 0u);
      EXPECT_LT(gridLit, 2000u);
    }
  }
}

}  // namespace
}  // namespace relume
