// SPDX-License-Identifier: MIT
// Glossy light on the CPU against the mathematics: furnaces, a lobe's integral by quadrature, bad receivers.
#include "relume/glossy.h"
#include "relume/relighter.h"

#include "formats/color.h"
#include "formats/sh.h"
#include "runtime/shared/glossy.h"
#include "tests/packed.h"
#include "tests/runtime/cpu_fixture.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

namespace relume {
namespace {

using test::kPi;

// Points of the sphere with equal areas (Fibonacci), of which `inside` ones count: their SH projection.
template <class Radiance>
std::vector<double> project(const Radiance& radiance) {
  constexpr int kPoints = 200000;
  std::vector<double> c(kMaxCoefficients, 0.0);
  for (int i = 0; i < kPoints; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kPoints, angle = i * kPi * (3.0 - std::sqrt(5.0)),
                 r = std::sqrt(1.0 - z * z);
    const glm::vec3 d(r * std::cos(angle), r * std::sin(angle), z);
    std::array<float, kMaxCoefficients> y;
    evaluateSh(kMaxBands, d, y);
    const double weight = 4.0 * kPi / kPoints * radiance(d);
    for (std::size_t k = 0; k < c.size(); ++k) c[k] += weight * static_cast<double>(y[k]);
  }
  return c;
}

// One cache, on a light map of one texel whose normal is +Z or in a grid of one point, under coloured light.
struct OneCache {
  Caches caches;
  std::vector<float> coefficients;
  CacheLight light;

  OneCache(const CacheBands& bands, bool onMap, const std::vector<double>& c, const glm::vec3& tint) {
    caches.positionWorld = std::vector<glm::vec3>(1, glm::vec3(0.0f));
    caches.normal = std::vector<glm::vec3>(1, onMap ? glm::vec3(0, 0, 1) : glm::vec3(0.0f));
    if (onMap) {
      caches.lightmap.width = caches.lightmap.height = 1;
      caches.lightmap.cache = std::vector<std::uint32_t>{0};
    } else {
      caches.grid.resolution = {1, 1, 1};
      caches.grid.spacing = glm::vec3(1.0f);
      caches.grid.cache = std::vector<std::uint32_t>{0};
    }
    const glm::vec3 yCoCg = rgbToYCoCg(tint);
    for (int channel = 0; channel < 3; ++channel) {
      const int all = channel == 0 ? bands.lumaBands : bands.chromaBands, held = onMap ? bands.onMap(all) : all;
      for (int i = 0; i < all * all; ++i)
        coefficients.push_back(i < held * held ? yCoCg[channel] * static_cast<float>(c[static_cast<std::size_t>(i)])
                                               : 0.0f);
    }
    light = {bands, coefficients};
  }

  glm::vec3 onMap(const glm::vec3& r, float n) const {
    return glossyOnLightmap(test::packed(caches), light, {0.5f, 0.5f}, r, n);
  }
  glm::vec3 inGrid(const glm::vec3& r, float n) const {
    return glossyInGrid(test::packed(caches), light, glm::vec3(0.0f), {0, 0, 1}, r, n);
  }
};

const glm::vec3 kTint(0.9f, 0.4f, 0.2f);

TEST(Glossy, aUniformWorldIsReflectedAsItIs) {
  const std::vector<double> above = project([](const glm::vec3&d) { return d.z > 0.0f ? 1.0 : 0.0; }),
                            all = project([](const glm::vec3&) { return 1.0; });
  for (int luma = 1; luma <= kMaxBands; ++luma) {
    for (int chroma = 1; chroma <= luma; ++chroma) {
      for (const bool glossy : {false, true}) {
        const OneCache map({luma, chroma, false, glossy}, true, above, kTint), grid({luma, chroma}, false, all, kTint);
        for (const float n : {0.0f, 1.0f, 4.0f, 16.0f, 64.0f, 1e9f}) {
          for (const float z : {0.0f, 0.3f, 0.7f, 1.0f}) {
            const glm::vec3 r(std::sqrt(1.0f - z * z), 0.0f, z);
            ASSERT_LT(glm::distance(map.onMap(r, n), kTint), 0.02f) << luma << " " << chroma << " " << n << " " << z;
            ASSERT_LT(glm::distance(grid.inGrid(r, n), kTint), 0.002f) << luma << " " << chroma << " " << n;
          }
        }
      }
    }
  }
}

// Smooth light, which eight bands hold, in lobes that need no more: the integral of light times lobe.
TEST(Glossy, isTheMeanRadianceInTheLobe) {
  const auto radiance = [](const glm::vec3& d) {
    return 1.5 + static_cast<double>(d.x) + 0.8 * static_cast<double>(d.y * d.z) - 0.4 * static_cast<double>(d.z);
  };
  const OneCache grid({8, 8}, false, project(radiance), glm::vec3(1.0f));
  for (const float n : {1.0f, 4.0f, 16.0f, 64.0f}) {
    for (const glm::vec3& axis : {glm::vec3(0, 0, 1), glm::vec3(1, 0, 0), glm::vec3(0.5f, -0.7f, 0.2f)}) {
      const glm::vec3 r = glm::normalize(axis);
      double sum = 0.0, weight = 0.0;
      constexpr int kPoints = 100000;
      for (int i = 0; i < kPoints; ++i) {
        const double z = 1.0 - (2.0 * i + 1.0) / kPoints, angle = i * kPi * (3.0 - std::sqrt(5.0)),
                     s = std::sqrt(1.0 - z * z);
        const glm::vec3 d(s * std::cos(angle), s * std::sin(angle), z);
        const double lobe = std::pow(std::max(0.0, static_cast<double>(glm::dot(d, r))), static_cast<double>(n));
        sum += lobe * radiance(d);
        weight += lobe;
      }
      ASSERT_NEAR(grid.inGrid(r, n).g, sum / weight, 2e-3) << n;
    }
  }
}

// Light of any brightness that the lights' bounds allow, diffuse and glossy: squares of it would overflow, or be
// nothing.
TEST(Readers, areLinearInTheLight) {
  const glm::vec3 toward = glm::normalize(glm::vec3(0.6f, 0.2f, 0.8f)),
                  n = glm::normalize(glm::vec3(-0.2f, 0.1f, 0.9f));
  const auto c = project([&](const glm::vec3& d) { return glm::dot(d, toward) > 0.8f ? 1.0 : 0.01; });
  for (const auto& [luma, chroma] : {std::pair(1, 1), {2, 1}, {2, 2}, {3, 1}, {3, 2}, {8, 3}}) {
    for (const bool onMap : {true, false}) {
      for (const bool guess : {true, false}) {
        OneCache cache({luma, chroma}, onMap, c, kTint);
        cache.light.guessBands = guess;
        const auto read = [&](bool glossy) {
          if (glossy) return onMap ? cache.onMap(n, 4.0f) : cache.inGrid(n, 4.0f);
          return onMap ? irradianceOnLightmap(test::packed(cache.caches), cache.light, {0.5f, 0.5f}, n)
                       : irradianceInGrid(test::packed(cache.caches), cache.light, glm::vec3(0.0f), n);
        };
        const std::vector<float> plain = cache.coefficients;
        const glm::vec3 diffuse = read(false), glossy = read(true);
        EXPECT_GT(diffuse.g, 0.0f);
        for (const float scale : {0x1p80f, 0x1p-80f}) {
          for (std::size_t i = 0; i < plain.size(); ++i) cache.coefficients[i] = scale * plain[i];
          EXPECT_LT(glm::distance(read(false) / scale, diffuse), 1e-6f * diffuse.r)
              << luma << " " << chroma << " " << scale;
          EXPECT_LT(glm::distance(read(true) / scale, glossy), 1e-6f * glossy.r)
              << luma << " " << chroma << " " << scale;
        }
      }
    }
  }
}

// Light from one side is brightest toward that side, the more so the higher the exponent and the more bands.
TEST(Glossy, sharperLobesSeeMoreOfASmallLight) {
  const glm::vec3 toward = glm::normalize(glm::vec3(0.6f, 0.0f, 0.8f));
  const auto c = project([&](const glm::vec3& d) { return glm::dot(d, toward) > 0.95f ? 1.0 : 0.0; });
  float before = 0.0f;
  for (const float n : {1.0f, 4.0f, 16.0f, 64.0f}) {
    const float seen = OneCache({8, 8}, true, c, glm::vec3(1.0f)).onMap(toward, n).g;
    EXPECT_GT(seen, before);
    before = seen;
  }
  // The mirrored viewer's ray misses it.
  EXPECT_LT(OneCache({8, 8}, true, c, glm::vec3(1.0f)).onMap({-toward.x, 0.0f, toward.z}, 64.0f).g, 0.1f * before);
}

// Without RelightOptions::glossy the light map lacks the last of 8 bands.
TEST(Glossy, theOptionKeepsTheLastBandOnTheMap) {
  const glm::vec3 toward(0, 0, 1);
  const auto c = project([&](const glm::vec3& d) { return d.z > 0.98f ? 1.0 : 0.0; });
  const float without = OneCache({4, 4, false, false}, true, c, glm::vec3(1.0f)).onMap(toward, 64.0f).g,
              with = OneCache({4, 4, false, true}, true, c, glm::vec3(1.0f)).onMap(toward, 64.0f).g;
  EXPECT_GT(with, 1.2f * without);
}

// Chroma of two bands follows luma's highlight: its colour is that of the light.
TEST(Glossy, highlightsKeepTheirColour) {
  const auto c = project([](const glm::vec3& d) { return d.z > 0.9f ? 1.0 : 0.0; });
  for (const int chroma : {1, 2, 3, 8}) {
    const glm::vec3 seen = OneCache({8, chroma, false, true}, true, c, kTint).onMap({0, 0, 1}, 64.0f);
    EXPECT_NEAR(seen.g / seen.r, kTint.g / kTint.r, 0.02f) << chroma;
    EXPECT_NEAR(seen.b / seen.r, kTint.b / kTint.r, 0.02f) << chroma;
  }
}

TEST(Glossy, badReceiversReadNothingAndBadExponentsAreClamped) {
  const Bake bake = test::makeBakeWithBricks({4, 3, 4}, true, true);
  for (const LinkKind kind : {LinkKind::cone, LinkKind::irradiance}) {
    Bake of = bake;
    if (kind == LinkKind::irradiance) of = test::makeSyntheticBake({.kind = kind});
    Result<Relighter> relighter = Relighter::create(of, {.glossy = true});
    ASSERT_TRUE(relighter) << relighter.error().message;
    LightSetup setup;
    const std::array<Light, 1> lights{
        Light{.kind = LightKind::point, .intensity = {60, 1, 1}, .positionWorld = {2, 1, 1}}};
    setup.lights = lights;
    ASSERT_TRUE(relighter->relight(setup));
    const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
    const auto isLight = [](const glm::vec3& l) {
      return std::isfinite(l.x) && std::isfinite(l.y) && std::isfinite(l.z) && l.x >= 0 && l.y >= 0 && l.z >= 0;
    };
    for (const test::WeirdReceiver& r : test::weirdReceivers()) {
      for (const float n : {nan, -inf, -1.0f, 0.0f, 1.0f, 1e30f, inf}) {
        ASSERT_TRUE(isLight(relighter->glossyInGrid(r.position, r.normal, {0, 1, 0}, n)));
        ASSERT_TRUE(isLight(relighter->glossyInGrid(r.position, {0, 1, 0}, r.normal, n)));
        ASSERT_TRUE(isLight(relighter->glossyOnLightmap(glm::vec2(r.position), r.normal, n)));
        if (!r.isInGrid()) {
          ASSERT_EQ(relighter->glossyInGrid(r.position, r.normal, {0, 1, 0}, n), glm::vec3(0.0f));
        }
        if (!r.isOnMap()) {
          ASSERT_EQ(relighter->glossyOnLightmap(glm::vec2(r.position), r.normal, n), glm::vec3(0.0f));
        }
      }
    }
    const glm::vec3 up(0, 1, 0), place(2, 1, 2);
    EXPECT_EQ(relighter->glossyInGrid(place, up, up, nan), relighter->glossyInGrid(place, up, up, 0.0f));
    EXPECT_EQ(relighter->glossyInGrid(place, up, up, inf), relighter->glossyInGrid(place, up, up, kMaxExponent));
    EXPECT_EQ(relighter->glossyInGrid(place, up, up, -3.0f), relighter->glossyInGrid(place, up, up, 0.0f));

    // Many at once are the same as one at a time; lengths must agree.
    const std::array<glm::vec3, 2> places{place, {1, 1, 1}}, normals{up, up}, reflected{up, {1, 0, 0}};
    const std::array<float, 2> exponents{4.0f, 16.0f};
    std::array<glm::vec3, 2> radiance{};
    ASSERT_TRUE(relighter->glossyInGrid(places, normals, reflected, exponents, radiance));
    EXPECT_EQ(radiance[1], relighter->glossyInGrid(places[1], up, reflected[1], 16.0f));
    const Status wrong = relighter->glossyInGrid(places, normals, reflected, std::span(exponents).first(1), radiance);
    ASSERT_FALSE(wrong);
    EXPECT_NE(wrong.error().message.find("exponent"), std::string::npos);
  }
}

TEST(Glossy, roughnessBecomesAnExponentAndAShare) {
  EXPECT_NEAR(glossyExponent(0.6f), 3.36f, 0.01f);
  EXPECT_EQ(glossyExponent(1.0f), 1.0f);
  EXPECT_EQ(glossyExponent(0.0f), kMaxExponent);
  EXPECT_EQ(glossyShare(0.3f), 0.0f);
  EXPECT_EQ(glossyShare(0.6f), 1.0f);
  EXPECT_NEAR(glossyShare(0.5f), 0.5f, 1e-6f);
  float before = kMaxExponent;
  for (float roughness = 0.01f; roughness <= 1.0f; roughness += 0.01f) {
    EXPECT_LE(glossyExponent(roughness), before);
    before = glossyExponent(roughness);
  }
}

TEST(Glossy, whiteSurfacesReflectAllLightAndOthersLess) {
  // A furnace of radiance 1: what is scattered of irradiance / pi = 1 and what is mirrored of it.
  for (float metalness = 0.0f; metalness <= 1.0f; metalness += 0.25f) {
    for (float roughness = 0.0f; roughness <= 1.0f; roughness += 0.125f) {
      for (float cosine = -1.0f; cosine <= 1.0f; cosine += 0.0625f) {
        const ReflectanceSplit white = splitReflectance(glm::vec3(1.0f), metalness, roughness, cosine);
        EXPECT_NEAR(white.diffuse.x + white.specular.x, 1.0f, 1e-5f) << metalness << ' ' << roughness << ' ' << cosine;
        const ReflectanceSplit some = splitReflectance({0.0f, 0.5f, 0.9f}, metalness, roughness, cosine);
        for (int i = 0; i < 3; ++i) {
          EXPECT_GE(some.diffuse[i], 0.0f);
          EXPECT_GE(some.specular[i], 0.0f);
          EXPECT_LE(some.diffuse[i] + some.specular[i], 1.0f + 1e-5f);
        }
      }
    }
  }
}

TEST(Glossy, dielectricsMirrorLittleAndMetalsTheirColour) {
  const glm::vec3 color(0.9f, 0.5f, 0.1f);
  const ReflectanceSplit plastic = splitReflectance(color, 0.0f, 0.2f, 1.0f),
                         metal = splitReflectance(color, 1.0f, 0.2f, 1.0f);
  EXPECT_NEAR(plastic.specular.x, 0.04f, 0.01f);
  EXPECT_EQ(plastic.specular.x, plastic.specular.z);
  EXPECT_NEAR(plastic.diffuse.y, 0.5f * (1.0f - plastic.specular.y), 1e-6f);
  EXPECT_EQ(metal.diffuse, glm::vec3(0.0f));
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(metal.specular[i], color[i], 0.03f);
  // Toward the horizon smooth surfaces mirror all.
  EXPECT_GT(splitReflectance(color, 0.0f, 0.0f, 0.0f).specular.x, 0.95f);
}

}  // namespace
}  // namespace relume
