// SPDX-License-Identifier: MIT
// What a resolve by textures is told to make and write, on the CPU backend.
#include "formats/pack.h"
#include "tests/runtime/furnace_bake.h"
#include "tests/runtime/make_relighter.h"
#include "tests/runtime/synthetic_bake.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <iterator>
#include <numeric>
#include <string>
#include <vector>

namespace relume {
namespace {

using test::makeRelighter;

std::vector<std::byte> write(const Relighter& relighter, std::size_t texture) {
  const auto resolve = relighter.textureResolve();
  EXPECT_TRUE(resolve);
  std::vector<std::byte> texels(resolve->textures.at(texture).bytes, std::byte{0xAA});
  const Status ok = relighter.writeResolveTexture(texture, texels);
  EXPECT_TRUE(ok) << (ok ? "" : ok.error().message);
  return texels;
}

float halfAt(const std::vector<std::byte>& texels, std::size_t index) {
  std::uint16_t half = 0;
  std::memcpy(&half, texels.data() + 2 * index, 2);
  return unpackHalf(half);
}

TEST(TextureResolve, lightmapHoldsCoefficientsAndNormals) {
  const Bake bake = test::makeBakeWithBricks({4, 3, 4}, true, true);
  RelightOptions options;
  options.lumaBands = 3;
  options.chromaBands = 1;
  Relighter relighter = makeRelighter(bake, options);
  LightSetup setup;
  setup.skyRadiance = glm::vec3(1.0f);
  const std::vector<Light> lights{{.kind = LightKind::point, .intensity = {60, 20, 10}, .positionWorld = {3, 2, 3}}};
  setup.lights = lights;
  ASSERT_TRUE(relighter.relight(setup));
  const auto resolve = relighter.textureResolve();
  ASSERT_TRUE(resolve);
  const ResolveTexture& map = resolve->textures[0];
  EXPECT_STREQ(map.sampler, "relumeLightmap");
  EXPECT_EQ(map.size, glm::uvec3(bake.caches.lightmap.width, bake.caches.lightmap.height, 3 + 1 + 1 + 1));
  EXPECT_TRUE(map.isLight && map.isFiltered);
  const std::vector<std::byte> texels = write(relighter, 0);
  const std::vector<float> coefficients = relighter.cacheCoefficients();
  const auto stride = static_cast<std::size_t>(relighter.coefficientsPerCache());
  const std::size_t layer = std::size_t{4} * map.size.x * map.size.y;
  std::size_t lit = 0;
  for (std::size_t t = 0; t < bake.caches.lightmap.cache.size(); ++t) {
    const std::uint32_t cache = bake.caches.lightmap.cache[t];
    EXPECT_EQ(halfAt(texels, 5 * layer + 4 * t + 3), cache == kNoCache ? 0.0f : 1.0f);
    if (cache == kNoCache) continue;
    const float* c = &coefficients[stride * cache];
    for (std::size_t i = 0; i < 9; ++i)
      ASSERT_NEAR(halfAt(texels, i / 4 * layer + 4 * t + i % 4), c[i], 1e-3f * std::abs(c[i]) + 1e-6f);
    ASSERT_NEAR(halfAt(texels, 3 * layer + 4 * t), c[9], 1e-3f * std::abs(c[9]) + 1e-6f);
    ASSERT_NEAR(halfAt(texels, 4 * layer + 4 * t), c[10], 1e-3f * std::abs(c[10]) + 1e-6f);
    for (std::size_t k = 0; k < 3; ++k) {
      const auto normal = bake.caches.normal[cache][static_cast<glm::length_t>(k)];
      ASSERT_NEAR(halfAt(texels, 5 * layer + 4 * t + k), normal, 0.5f / 127.0f + 1e-3f);
    }
    lit += c[0] > 0.0f;
  }
  EXPECT_GT(lit, 10u);
}

// Light is linear, and radiosity is packed alike whatever power of two it is times: a relighter lit 2^20 times as
// strongly has 2^20 times the light. Halves hold as much of it as one factor on all that belongs together allows.
constexpr float kStronger = 0x1p20f;

Relighter litRoom(const Bake& bake, float times) {
  RelightOptions options;
  options.lumaBands = 3;
  options.chromaBands = 1;
  options.gridTexture = true;
  options.gridTrust = 1.0f;
  Relighter relighter = makeRelighter(bake, options);
  const Light lamp{.kind = LightKind::point, .intensity = times * glm::vec3(60, 20, 10), .positionWorld = {3, 2, 3}};
  LightSetup setup;
  setup.lights = {&lamp, 1};
  setup.emissionScale = glm::vec3(0.0f);
  EXPECT_TRUE(relighter.relight(setup));
  return relighter;
}

// As dimmed is of bright: element i of group g has the least of kStronger and what takes the group's largest to 65504.
void expectDimmedAsOne(const std::vector<float>& dim, const std::vector<float>& bright, std::size_t groups,
                       const std::function<std::vector<std::size_t>(std::size_t group)>& elements) {
  std::size_t dimmed = 0;
  for (std::size_t g = 0; g < groups; ++g) {
    float largest = 0.0f;
    for (const std::size_t i : elements(g)) largest = std::max(largest, std::abs(dim[i]));
    const float factor = std::min(kStronger, largest > 0.0f ? 65504.0f / largest : kStronger);
    dimmed += factor < kStronger;
    // Both are rounded to halves.
    for (const std::size_t i : elements(g)) ASSERT_NEAR(bright[i], factor * dim[i], 2e-3f * factor * largest) << i;
  }
  EXPECT_GT(dimmed, groups / 10);
}

std::vector<float> halvesOf(const std::vector<std::byte>& texels) {
  std::vector<float> halves(texels.size() / 2);
  for (std::size_t i = 0; i < halves.size(); ++i) halves[i] = halfAt(texels, i);
  return halves;
}

TEST(TextureResolve, whatHalvesDoNotHoldIsDimmedAsOne) {
  const Bake bake = test::makeBakeWithBricks({4, 3, 4}, true, true);
  const Relighter dim = litRoom(bake, 1.0f), bright = litRoom(bake, kStronger);
  const auto resolve = dim.textureResolve();
  ASSERT_TRUE(resolve && resolve->textures.size() == 6);
  // All layers of a texel but the last, which is its normal.
  const std::size_t texels = bake.caches.lightmap.cache.size();
  expectDimmedAsOne(halvesOf(write(dim, 0)), halvesOf(write(bright, 0)), texels, [&](std::size_t t) {
    std::vector<std::size_t> at;
    for (std::size_t i = 0; i < 20; ++i) at.push_back(4 * (i / 4 * texels + t) + i % 4);
    return at;
  });
  expectDimmedAsOne(halvesOf(write(dim, 1)), halvesOf(write(bright, 1)), bake.caches.firstMapCache(),
                    [](std::size_t cache) {
                      std::vector<std::size_t> at(20);
                      std::iota(at.begin(), at.end(), 20 * cache);
                      return at;
                    });
  // The grid's texture: a vector and, in another volume, Co and Cg; the weight is as it was.
  std::vector<float> volumes[2];
  for (const Relighter* each : {&dim, &bright}) {
    std::vector<float>& light = volumes[each == &bright ? 1 : 0];
    const std::vector<float> vectors = halvesOf(write(*each, 3)), chroma = halvesOf(write(*each, 4));
    for (std::size_t t = 0; t < vectors.size() / 4; ++t) {
      light.insert(light.end(), &vectors[4 * t], &vectors[4 * t] + 3);
      light.insert(light.end(), &chroma[2 * t], &chroma[2 * t] + 2);
    }
    if (each == &bright) {
      const std::vector<float> before = halvesOf(write(dim, 3));
      for (std::size_t t = 0; t < vectors.size() / 4; ++t) ASSERT_EQ(vectors[4 * t + 3], before[4 * t + 3]);
    }
  }
  expectDimmedAsOne(volumes[0], volumes[1], volumes[0].size() / 5, [](std::size_t t) {
    return std::vector<std::size_t>{5 * t, 5 * t + 1, 5 * t + 2, 5 * t + 3, 5 * t + 4};
  });
}

TEST(PlainMaps, whatHalvesDoNotHoldIsDimmedAsOne) {
  const Bake bake = test::makeBakeWithBricks({4, 3, 4}, true, true);
  const Relighter dim = litRoom(bake, 1.0f), bright = litRoom(bake, kStronger);
  const std::size_t texels = bake.caches.lightmap.cache.size();
  std::vector<float> maps[2], l1[2];
  for (const Relighter* each : {&dim, &bright}) {
    std::vector<std::uint16_t> map(4 * texels), four(16 * texels);
    ASSERT_TRUE(each->irradianceMap(map) && each->irradianceMapL1(four));
    std::transform(map.begin(), map.end(), std::back_inserter(maps[each == &bright ? 1 : 0]), unpackHalf);
    std::transform(four.begin(), four.end(), std::back_inserter(l1[each == &bright ? 1 : 0]), unpackHalf);
  }
  expectDimmedAsOne(maps[0], maps[1], texels, [](std::size_t t) {
    return std::vector<std::size_t>{4 * t, 4 * t + 1, 4 * t + 2};
  });
  expectDimmedAsOne(l1[0], l1[1], texels, [&](std::size_t t) {
    std::vector<std::size_t> at;
    for (std::size_t k = 0; k < 12; ++k) at.push_back(4 * (k / 3 * texels + t) + k % 3);
    return at;
  });
}

TEST(TextureResolve, lightChangesWithTheFrameAndTheRestDoesNot) {
  const Bake bake = test::makeBakeWithBricks({4, 3, 4}, true, true);
  RelightOptions options;
  options.gridTexture = true;
  options.gridTrust = 1.0f;
  Relighter relighter = makeRelighter(bake, options);
  const auto resolve = relighter.textureResolve();
  ASSERT_TRUE(resolve);
  ASSERT_EQ(resolve->textures.size(), 6u);
  LightSetup setup;
  const std::vector<Light> lights{{.kind = LightKind::point, .intensity = {60, 20, 10}, .positionWorld = {3, 2, 3}}};
  setup.lights = lights;
  std::vector<std::vector<std::byte>> dark;
  for (std::size_t i = 0; i < 6; ++i) dark.push_back(write(relighter, i));
  ASSERT_TRUE(relighter.relight(setup));
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_EQ(write(relighter, i) != dark[i], resolve->textures[i].isLight) << resolve->textures[i].sampler;
    EXPECT_EQ(write(relighter, i), write(relighter, i));
  }
}

TEST(TextureResolve, wrongSizesAndIndicesAreRefusedAndWriteNothing) {
  const Relighter relighter = makeRelighter(test::makeFurnaceBake(0.5f, 1.0f, 3));
  const auto resolve = relighter.textureResolve();
  ASSERT_TRUE(resolve);
  std::vector<std::byte> texels(resolve->textures[0].bytes + 1, std::byte{0xAA});
  const std::vector<std::byte> before = texels;
  const Status size = relighter.writeResolveTexture(0, texels);
  ASSERT_FALSE(size);
  EXPECT_EQ(size.error().code, ErrorCode::usage);
  EXPECT_NE(size.error().message.find("texels has"), std::string::npos) << size.error().message;
  const Status index = relighter.writeResolveTexture(3, std::span(texels).first(resolve->textures[0].bytes));
  ASSERT_FALSE(index);
  EXPECT_NE(index.error().message.find("texture is 3, there are 3"), std::string::npos) << index.error().message;
  EXPECT_EQ(texels, before);
}

TEST(TextureResolve, aBakeWithoutLightmapOrGridHasEmptyTexels) {
  Bake bake = test::makeBakeWithBricks({4, 3, 4}, false, false);
  bake.caches.lightmap = {};
  bake.surfels.receiver = std::vector<std::uint32_t>(bake.surfels.count(), kGridReceiver);
  Relighter relighter = makeRelighter(bake);
  EXPECT_TRUE(relighter.relight({}));
  const auto resolve = relighter.textureResolve();
  ASSERT_TRUE(resolve);
  EXPECT_EQ(resolve->textures[0].size.x, 1u);
  for (const std::byte b : write(relighter, 0)) ASSERT_EQ(b, std::byte{0});
}

TEST(TextureResolve, glslIsPlain) {
  const Relighter relighter = makeRelighter(test::makeFurnaceBake(0.5f, 1.0f, 3));
  const auto glsl = relighter.textureResolveGlsl();
  ASSERT_TRUE(glsl) << glsl.error().message;
  for (const char c : *glsl) ASSERT_TRUE(c == '\n' || (c >= ' ' && c <= '~'));
  for (const char* absent : {"//", "/*", "#include"}) EXPECT_EQ(glsl->find(absent), std::string::npos) << absent;
  EXPECT_NE(glsl->find("vec3 relumeIrradianceLightmap(vec2 uv, vec3 n)"), std::string::npos);
}

}  // namespace
}  // namespace relume
