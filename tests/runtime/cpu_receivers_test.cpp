// SPDX-License-Identifier: MIT
// What receivers read on the CPU: the resolve against the mathematics, surfels' bounces against the resolve.
#include "relume/relighter.h"
#include "runtime/cpu/bounce.h"
#include "runtime/cpu/light_caches.h"
#include "runtime/cpu/light_surfels.h"
#include "runtime/shared/resolve.h"
#include "runtime/shared/stencil.h"

#include "formats/color.h"
#include "formats/pack.h"
#include "formats/sh.h"
#include "tests/packed.h"
#include "tests/runtime/cpu_fixture.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>

namespace relume {
namespace {

using test::kPi, test::randomNodes, test::surfelsKernels;

// A light map of 2 x 1 texels over caches whose coefficients are those of constant radiance 1 and 3 from above +Z.
struct TwoTexels {
  Caches caches;
  std::vector<float> coefficients;
  CacheLight light;

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
        for (int i = 0; i < bands * bands; ++i)
          coefficients.push_back(radiance * tint[channel] * static_cast<float>(c[static_cast<std::size_t>(i)]));
      }
    }
    light = {{luma, chroma}, coefficients};
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
      const glm::vec3 e = irradianceOnLightmap(test::packed(map.caches), map.light, {0.375f, 0.3f}, {0, 0, 1});
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
  EXPECT_NEAR(irradianceOnLightmap(test::packed(map.caches), map.light, {0.3f, 0.5f}, {0, 0, 1}).r, want, 2e-3f);
  EXPECT_EQ(irradianceOnLightmap(test::packed(map.caches), map.light, {0.1f, 0.5f}, {0, 0, 1}), glm::vec3(0.0f));
  const TwoTexels empty(4, 4, {kNoCache, kNoCache});
  EXPECT_EQ(irradianceOnLightmap(test::packed(empty.caches), empty.light, {0.5f, 0.5f}, {0, 0, 1}), glm::vec3(0.0f));
}

// A hair within a cell of which one far corner alone has a cache: its weight has no finite reciprocal.
TEST(ResolveGrid, aCacheAHairAwayCountsNothing) {
  TwoTexels one(6, 1, {0, 1});
  one.caches.grid.resolution = {2, 1, 1};
  one.caches.grid.spacing = glm::vec3(1.0f);
  one.caches.grid.cache = std::vector<std::uint32_t>{kNoCache, 1};
  one.caches.positionWorld = std::vector<glm::vec3>{{0, 0, 0}, {1, 0, 0}};
  for (const float x : {0.0f, 1e-44f, 1e-40f, 1e-38f, 1e-30f, 0.5f}) {
    const glm::vec3 e = irradianceInGrid(test::packed(one.caches), one.light, {x, 0, 0}, {0, 0, 1});
    const float want = x < 1e-37f ? 0.0f : 3.0f * static_cast<float>(kPi);
    EXPECT_NEAR(e.r, want, 1e-2f) << x;
  }
}

TEST(ResolveLightmap, isNeverNegativeAndTakesAnyCoordinate) {
  const TwoTexels map(4, 4, {0, 1});
  const float nan = std::nanf("");
  for (const glm::vec2 uv : {glm::vec2(-5, 9), glm::vec2(1e30f, 0), glm::vec2(nan, nan)}) {
    const glm::vec3 e = irradianceOnLightmap(test::packed(map.caches), map.light, uv, {0, 0, -1});
    EXPECT_GE(e.r, 0.0f);
    EXPECT_GE(e.g, 0.0f);
    EXPECT_GE(e.b, 0.0f);
  }
}

TEST(ResolveLightmap, tiltedNormalsBlendToTheClampedCosine) {
  const TwoTexels map(4, 4, {0, 0});
  const glm::vec3 tilted(std::sin(1.2f), 0.0f, std::cos(1.2f));
  const float want = irradianceAtSurface(4, std::span<const float>(map.coefficients).first(16), tilted, {0, 0, 1});
  const glm::vec3 e = irradianceOnLightmap(test::packed(map.caches), map.light, {0.5f, 0.5f}, tilted);
  EXPECT_NEAR(rgbToYCoCg(e).x, want, 1e-4f);
}

TEST(ResolveLightmap, aTiltedPlaneInAUniformWorldGetsAllItsLight) {
  for (const auto& [luma, chroma] : {std::pair{1, 1}, {2, 1}, {3, 3}, {4, 4}, {8, 2}}) {
    const TwoTexels map(luma, chroma, {0, 0});
    for (float angle = 0.0f; angle < 1.04f; angle += 0.05f) {
      const glm::vec3 tilted(std::sin(angle), 0.0f, std::cos(angle));
      const glm::vec3 e = irradianceOnLightmap(test::packed(map.caches), map.light, {0.5f, 0.5f}, tilted);
      EXPECT_NEAR(e.r, kPi, 0.01 * kPi) << luma << " bands, angle " << angle;
      // A normal map on the cache's own plane turns away from light, as it should.
      const glm::vec3 mapped =
          irradianceOnLightmap(test::packed(map.caches), map.light, {0.5f, 0.5f}, tilted, {0, 0, 1});
      const double caught = luma > 1 ? 0.5 + 0.5 * std::cos(angle) : 1.0;
      EXPECT_NEAR(mapped.r, kPi * caught, 0.05 * kPi) << luma << " bands, angle " << angle;
    }
  }
}

// Between two caches of a round surface that look apart: neither is tilted against the other's mean, both have missed a
// lune of what the receiver sees.
TEST(ResolveLightmap, betweenCachesThatLookApartAUniformWorldIsStillUniform) {
  for (const int bands : {1, 2, 3, 4, 8}) {
    for (const float apart : {0.1f, 0.3f, 0.5f, 0.8f}) {
      TwoTexels map(bands, bands, {0, 1});
      const std::array<double, 64> zonal = TwoTexels::hemisphere();
      std::vector<glm::vec3> normals;
      for (std::size_t k = 0; k < 2; ++k) {
        const glm::vec3 m(k == 0 ? std::sin(apart) : -std::sin(apart), 0.0f, std::cos(apart));
        normals.push_back(m);
        std::array<float, kMaxCoefficients> y;
        evaluateSh(bands, m, y);
        for (std::size_t l = 0; l < static_cast<std::size_t>(bands); ++l) {
          for (std::size_t i = l * l; i < (l + 1) * (l + 1); ++i)
            map.coefficients[3 * k * static_cast<std::size_t>(bands * bands) + i] =
                static_cast<float>(zonal[l * l + l] * std::sqrt(4 * kPi / (2.0 * static_cast<double>(l) + 1))) * y[i];
        }
      }
      map.caches.normal = normals;
      map.light = {{bands, bands}, map.coefficients};
      for (const float u : {0.25f, 0.4f, 0.5f, 0.7f}) {
        const float share = std::clamp(2.0f * u - 0.5f, 0.0f, 1.0f);
        const float angle = (1.0f - 2.0f * share) * apart;
        const glm::vec3 n(std::sin(angle), 0.0f, std::cos(angle));
        const glm::vec3 e = irradianceOnLightmap(test::packed(map.caches), map.light, {u, 0.5f}, n);
        EXPECT_NEAR(rgbToYCoCg(e).x, kPi, 0.012 * kPi) << bands << " bands, " << apart << ", at " << u;
      }
    }
  }
}

TEST(Resolve, receiversThatAreNowhereReadNothingAndAllOthersFiniteLight) {
  const Bake bake = test::makeBakeWithBricks({4, 3, 4}, true, true);
  RelightOptions options;
  options.gridTexture = true;
  options.gridTrust = 1.0f;
  Result<Relighter> relighter = Relighter::create(bake, options);
  ASSERT_TRUE(relighter) << relighter.error().message;
  const std::array<Light, 1> lights{
      Light{.kind = LightKind::point, .intensity = {60, 1, 1}, .positionWorld = {2, 1, 1}}};
  LightSetup setup;
  setup.lights = lights;
  ASSERT_TRUE(relighter->relight(setup));
  const auto isLight = [](const glm::vec3& e) {
    return std::isfinite(e.x) && std::isfinite(e.y) && std::isfinite(e.z) && e.x >= 0.0f && e.y >= 0.0f && e.z >= 0.0f;
  };
  std::size_t lit = 0;
  for (const test::WeirdReceiver& r : test::weirdReceivers()) {
    const glm::vec3 grid = relighter->irradianceInGrid(r.position, r.normal);
    const glm::vec3 map = relighter->irradianceOnLightmap(glm::vec2(r.position), r.normal);
    const glm::vec3 plane = relighter->irradianceOnLightmap(glm::vec2(0.5f), {0, 1, 0}, r.normal);
    ASSERT_TRUE(isLight(grid) && isLight(map) && isLight(plane)) << r.position.x << " " << r.position.y;
    if (!r.isInGrid()) {
      ASSERT_EQ(grid, glm::vec3(0.0f));
    }
    if (!r.isOnMap()) {
      ASSERT_EQ(map, glm::vec3(0.0f));
    }
    if (!r.canShade()) {
      ASSERT_EQ(plane, glm::vec3(0.0f));
    }
    // Far away reads what the border of the grid has.
    if (r.isInGrid()) {
      ASSERT_GT(grid.r, 0.0f) << r.position.x << " " << r.position.y << " " << r.position.z;
    }
    // The texture answers, or leaves it to the caches around.
    for (const GridLookup lookup : {GridLookup::texture, GridLookup::smooth}) {
      const glm::vec3 texture = relighter->irradianceInGrid(r.position, r.normal, lookup);
      ASSERT_TRUE(isLight(texture));
      if (!r.isInGrid()) {
        ASSERT_EQ(texture, glm::vec3(0.0f));
      }
    }
    lit += r.isInGrid();
  }
  EXPECT_GT(lit, 50u);
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
  const CacheLight light{{4, 4}, coefficients};
  const auto pi = static_cast<float>(kPi);
  const glm::vec3 side(0, 1, 0);
  // Both points lie in the receiver's plane: plain linear interpolation. Grey light has Y = R = G = B.
  EXPECT_NEAR(irradianceInGrid(test::packed(caches), light, {0.25f, 0, 0}, side).g, 1.5f * pi, 1e-3f);
  EXPECT_NEAR(irradianceInGrid(test::packed(caches), light, {-7, 3, 2}, side).g, pi, 1e-3f);
  // Facing +X from the middle: weight 1 ahead, 0.05² behind.
  const float behind = 0.05f * 0.05f;
  EXPECT_NEAR(irradianceInGrid(test::packed(caches), light, {0.5f, 0, 0}, {1, 0, 0}).g,
              pi * (3.0f + behind) / (1.0f + behind), 1e-3f);
  // Outside of the grid the way to its points begins at the position itself, here 1 m above their middle.
  const float cosine = 0.5f / std::sqrt(1.25f), back = wrapWeight(-cosine), ahead = wrapWeight(cosine);
  EXPECT_NEAR(irradianceInGrid(test::packed(caches), light, {0.5f, 1, 0}, {1, 0, 0}).g,
              pi * (back + 3.0f * ahead) / (back + ahead), 1e-3f);
  caches.grid.cache = std::vector<std::uint32_t>{0, kNoCache};
  EXPECT_NEAR(irradianceInGrid(test::packed(caches), light, {0.9f, 0, 0}, side).g, pi, 1e-3f);
  caches.grid.cache = std::vector<std::uint32_t>{kNoCache, kNoCache};
  EXPECT_EQ(irradianceInGrid(test::packed(caches), light, {0.9f, 0, 0}, side), glm::vec3(0.0f));
}

// What is decided once and read from tables gives what the general resolve gives, for all kinds of receivers.
TEST(Bounce, agreesWithResolveAtEverySurfel) {
  // The last map has more caches than two bytes number.
  for (const auto& [kind, mapCaches] :
       {std::pair{LinkKind::cone, 260u}, {LinkKind::irradiance, 260u}, {LinkKind::cone, 66000u}}) {
    Bake bake = test::makeSyntheticBake({.surfels = 3000,
                                         .lightmapSize = mapCaches < 1000 ? 24u : 300u,
                                         .lightmapCaches = mapCaches,
                                         .linksPerCache = mapCaches < 1000 ? 64u : 24u,
                                         .kind = kind});
    // Some normals that are no longer the map's.
    std::vector<glm::vec3> normal = bake.surfels.normal.toVector();
    for (std::size_t s = 0; s < normal.size(); s += 5)
      normal[s] = glm::normalize(normal[s] + glm::vec3(0.3f, 0.2f, 0.1f));
    bake.surfels.normal = std::move(normal);
    const auto order = cpu::leafOrder(bake.hierarchy, bake.surfels.count(), std::pmr::new_delete_resource());
    const cpu::SurfelSet packed(bake.surfels, bake.hierarchy, bake.emitters, order, true,
                                std::pmr::new_delete_resource());
    const std::vector<std::uint32_t> nodes = randomNodes(bake.hierarchy.nodeCount());
    const PackedCaches caches = test::packed(bake.caches);
    ASSERT_EQ(caches.map().cache.wide() != nullptr, mapCaches > 65534);
    for (const auto& [luma, chroma] : {std::pair{1, 1}, {2, 1}, {2, 2}, {4, 1}, {4, 3}, {6, 2}}) {
      StoredLight stored({luma, chroma, kind == LinkKind::irradiance}, bake.caches.count(), bake.caches.firstMapCache(),
                         std::pmr::new_delete_resource());
      cpu::lightCaches(cpu::lightCachesBaseline, LinkSet(bake.links, std::pmr::new_delete_resource()), nodes, stored,
                       {});
      const CacheLight light = cacheLight(stored);
      cpu::Bounce bounce(caches, bake.surfels, order, kind, luma, std::pmr::new_delete_resource());
      cpu::LightSurfelsJob job;
      packed.describe(job);
      job.bounceScale = 0.5f;
      for (const cpu::LightSurfelsKernel* kernel : surfelsKernels()) {
        bounce.colorCaches(*kernel, stored, 0, static_cast<std::uint32_t>(bake.caches.count()));
        bounce.setLight(stored, job);
        std::size_t gridLit = 0;
        for (std::uint32_t i = 0; i < order.size(); ++i) {
          alignas(64) static std::array<float, 3 * cpu::kSurfelBlock> e;
          const std::uint32_t slot = i % cpu::kSurfelBlock, s = order[i];
          if (slot == 0) {
            e.fill(0.25f);
            bounce.add(*kernel, job, i / cpu::kSurfelBlock,
                       std::min<std::uint32_t>(cpu::kSurfelBlock, static_cast<std::uint32_t>(order.size()) - i),
                       e.data());
          }
          const Surfels& surfels = bake.surfels;
          const bool grid = surfels.receiver[s] == kGridReceiver;
          gridLit += grid ? 1 : 0;
          const glm::vec3 want =
              grid ? irradianceInGrid(caches, light, surfels.positionWorld[s], surfels.normal[s])
                   : irradianceOnLightmap(caches, light, unpackUnorm16x2(surfels.receiver[s]), surfels.normal[s]);
          const glm::vec3 found =
              2.0f * (glm::vec3(e[slot], e[cpu::kSurfelBlock + slot], e[2 * cpu::kSurfelBlock + slot]) - 0.25f);
          // Up to 14 degrees a surfel takes the light of its caches' own normals.
          const float cosine =
              grid ? 0.0f
                   : glm::dot(
                         surfels.normal[s],
                         meanNormal(caches.map(), lightmapStencil(caches.map(), unpackUnorm16x2(surfels.receiver[s]))));
          // Few links make rougher light.
          const bool isNearly = cosine > 0.97f && cosine < 0.9999f;
          if (isNearly && mapCaches > 1000) continue;
          const float tolerance = isNearly ? 0.1f : 0.02f;
          ASSERT_LT(glm::length(found - want), tolerance * glm::length(want) + 1e-4f)
              << "surfel " << s << " bands " << luma << " " << chroma;
        }
        EXPECT_GT(gridLit, 0u);
        EXPECT_LT(gridLit, 2000u);
      }
    }
  }
}

}  // namespace
}  // namespace relume
