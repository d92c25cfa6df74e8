// SPDX-License-Identifier: MIT
// The OpenGL backend against the CPU backend, pass by pass and over whole frames.
#include "relume/relighter.h"

#include "runtime/cpu/light_caches.h"
#include "runtime/cpu/light_surfels.h"
#include "runtime/cpu/pull.h"
#include "runtime/shared/pack_color.h"
#include "runtime/shared/receivers.h"
#include "shaders/shared/layout.h"
#include "tests/packed.h"
#include "tests/runtime/furnace_bake.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/lit_caches.h"
#include "tests/runtime/random_tree.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"

#include "formats/color.h"
#include "formats/pack.h"

#include <epoxy/gl.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace relume {
namespace {

using test::coefficientDifference, test::difference, test::makeRelighter, test::manySurfels;

class GlRelighter : public test::GlTest {};

std::vector<float> flatten(const std::vector<glm::vec3>& v) {
  std::vector<float> flat;
  for (const glm::vec3& each : v) flat.insert(flat.end(), {each.x, each.y, each.z});
  return flat;
}

TEST(GlRelighterWithoutContext, isRefused) {
  const Result<EglContext> probe = EglContext::create();
  if (!probe) GTEST_SKIP() << probe.error().message;
  { const EglContext ended = *EglContext::create(); }
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.getProcAddress = EglContext::getProcAddress;
  const Result<Relighter> made = Relighter::create(test::makeFurnaceBake(0.5f, 0.0f, 3), options);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::unsupported);
  EXPECT_NE(made.error().message.find("found none"), std::string::npos) << made.error().message;
}

TEST_F(GlRelighter, surfelPassAgrees) {
  const Bake bake = test::makeSyntheticBake(manySurfels(LinkKind::cone, 4));
  const std::vector<Light> lights = test::someLights();
  LightSetup setup;
  setup.lights = lights;
  setup.skyRadiance = {0.5f, 0.7f, 1.0f};
  Relighter cpu = makeRelighter(bake, BackendKind::cpu), gl = makeRelighter(bake, BackendKind::gl);
  const auto leaves = [&bake](const Relighter& relighter) {
    const std::vector<glm::vec3> all = relighter.nodeRadiosity();
    std::vector<glm::vec3> picked;
    for (const std::uint32_t node : bake.hierarchy.leafNode) picked.push_back(all[node]);
    return flatten(picked);
  };
  EXPECT_TRUE(cpu.relight(setup));
  EXPECT_TRUE(gl.relight(setup));
  // Steps of rounding, against the mean.
  EXPECT_LT(difference(leaves(cpu), leaves(gl)), 0.01);
  // The host's own numbers in place of lights, emission and sky.
  std::vector<glm::vec3> irradiance, emission, patches;
  for (std::uint32_t s = 0; s < bake.surfels.count(); ++s) {
    irradiance.emplace_back(s % 7, s % 5, s % 3);
    emission.emplace_back(s % 2, s % 11, 0.5f);
  }
  for (std::size_t p = 0; p < 48; ++p) patches.emplace_back(p, 1.0f, 0.0f);
  setup.bounceScale = 0.0f;
  setup.surfelIrradiance = irradiance;
  setup.surfelEmission = emission;
  setup.skyPatches = patches;
  const std::size_t before = gl.bufferSizes()[0].second;
  EXPECT_TRUE(cpu.relight(setup));
  EXPECT_TRUE(gl.relight(setup));
  EXPECT_LT(difference(leaves(cpu), leaves(gl)), 0.01);
  // From now on it knows the bake's number of each surfel, four bytes, in three kinds of whole blocks.
  EXPECT_EQ(gl.bufferSizes()[0].first, "surfels");
  const std::size_t added = gl.bufferSizes()[0].second - before;
  EXPECT_GE(added, 4 * bake.surfels.count());
  EXPECT_LT(added, 4 * (bake.surfels.count() + 3 * 64));
}

// The strongest light that check() takes, far beyond halves; then usual light, whose bounces forget the frames before.
TEST_F(GlRelighter, lightBeyondHalvesLeavesWithItsFrames) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  std::vector<Light> strong, usual = test::someLights();
  for (const LightKind kind : {LightKind::directional, LightKind::point, LightKind::spot}) {
    for (const float range : {0.0f, 1e-38f, 3e38f}) {
      strong.push_back({kind, glm::vec3(1e20f, 0.0f, 1.0f), {1, 1, 1}, {0, -1, 0}, range, 0.0f, 0.0f});
      strong.push_back({kind, glm::vec3(0.0f, 1e20f, 1.0f), glm::vec3(1e9f), {0, -1, 0}, range, 0.0f, 3.1415926f});
    }
  }
  // What a point light does not have.
  strong.push_back({.kind = LightKind::point, .direction = glm::vec3(nan), .innerConeRad = nan, .outerConeRad = nan});
  for (const LinkKind kind : {LinkKind::cone, LinkKind::irradiance}) {
    const Bake bake = test::makeSyntheticBake(manySurfels(kind, 4));
    strong[0].positionWorld = strong[2].positionWorld = bake.surfels.positionWorld[0];
    Relighter blinded = makeRelighter(bake, BackendKind::gl), fresh = makeRelighter(bake, BackendKind::gl);
    LightSetup setup;
    setup.lights = strong;
    setup.emissionScale = setup.skyRadiance = glm::vec3(1e20f);
    for (int frame = 0; frame < 3; ++frame) ASSERT_TRUE(blinded.relight(setup));
    setup = {};
    setup.lights = usual;
    setup.bounceScale = 0.0f;
    for (Relighter* each : {&blinded, &fresh}) ASSERT_TRUE(each->relight(setup));
    setup.bounceScale = 1.0f;
    for (Relighter* each : {&blinded, &fresh}) ASSERT_TRUE(each->relight(setup));
    EXPECT_EQ(blinded.cacheCoefficients(), fresh.cacheCoefficients());
    // Without a frame that bounces nothing, it fades.
    LightSetup lasting;
    lasting.lights = strong;
    ASSERT_TRUE(blinded.relight(lasting));
    ASSERT_TRUE(blinded.relight(lasting));
    for (int frame = 0; frame < 400; ++frame) ASSERT_TRUE(blinded.relight({}));
    for (const float c : blinded.cacheCoefficients()) ASSERT_TRUE(std::isfinite(c));
  }
}

TEST_F(GlRelighter, surfelsOfAllKindsBounceAsOnTheCpu) {
  for (const auto& [luma, chroma] : {std::pair{1, 1}, {2, 1}, {3, 2}, {4, 4}, {5, 5}}) {
    Bake bake = test::makeSyntheticBake(manySurfels(LinkKind::cone, 4));
    // The room's surfels face as their caches do: bend every third.
    std::vector<glm::vec3> normals(bake.surfels.normal.begin(), bake.surfels.normal.end());
    for (std::size_t s = 0; s < normals.size(); s += 3) {
      normals[s] = glm::normalize(normals[s] + (0.3f + static_cast<float>(s % 5)) * glm::vec3(0.3f, 0.5f, -0.2f));
    }
    bake.surfels.normal = normals;
    const PackedCaches caches = test::packed(bake.caches);
    const std::vector<Light> lights = test::someLights();
    LightSetup setup;
    setup.lights = lights;
    Relighter cpu = makeRelighter(bake, BackendKind::cpu, luma, chroma),
              gl = makeRelighter(bake, BackendKind::gl, luma, chroma);
    for (int frame = 0; frame < 2; ++frame) {
      EXPECT_TRUE(cpu.relight(setup));
      EXPECT_TRUE(gl.relight(setup));
    }
    const std::vector<glm::vec3> expected = cpu.nodeRadiosity(), found = gl.nodeRadiosity();
    std::array<int, 3> ofKind{};
    std::array<glm::dvec3, 3> sum{}, error{};
    for (std::uint32_t s = 0; s < bake.surfels.count(); ++s) {
      const auto kind =
          static_cast<std::size_t>(receiverKind(caches.map(), bake.surfels, s, normalsCount(bake.links.kind, luma)));
      const std::uint32_t leaf = bake.hierarchy.leafNode[s];
      ++ofKind[kind];
      sum[kind] += expected[leaf];
      error[kind] += found[leaf] - expected[leaf];
    }
    // Dithers and the light map's filter leave no error in the mean.
    EXPECT_GT(ofKind[0], 0);
    EXPECT_EQ(ofKind[1] > 0, luma > 1);
    EXPECT_GT(ofKind[2], 0);
    for (std::size_t kind = 0; kind < 3; ++kind) {
      for (int k = 0; k < 3; ++k) {
        EXPECT_LE(std::abs(error[kind][k]), 1e-3 * sum[kind][k]) << "kind " << kind << " bands " << luma;
      }
    }
  }
}

// The surfels of a work group name their leaves by 16 bits from the first on: those of a rare kind lie farther apart.
TEST_F(GlRelighter, surfelsOfARareKindAreLitWhereverTheirLeavesLie) {
  Bake bake = test::makeSyntheticBake({.surfels = 120000, .grid = {2, 2, 2}, .lightmapCaches = 6, .linksPerCache = 8});
  const auto onMap = std::find_if(bake.surfels.receiver.begin(), bake.surfels.receiver.end(),
                                  [](std::uint32_t receiver) { return receiver != kGridReceiver; });
  ASSERT_NE(onMap, bake.surfels.receiver.end());
  std::vector<std::uint32_t> receivers(bake.surfels.count(), *onMap);
  for (std::size_t s = 0; s < receivers.size(); s += 5000) receivers[s] = kGridReceiver;
  bake.surfels.receiver = receivers;
  const std::vector<Light> lights = test::someLights();
  LightSetup setup;
  setup.lights = lights;
  Relighter cpu = makeRelighter(bake, BackendKind::cpu), gl = makeRelighter(bake, BackendKind::gl);
  for (int frame = 0; frame < 2; ++frame) {
    EXPECT_TRUE(cpu.relight(setup));
    EXPECT_TRUE(gl.relight(setup));
  }
  const std::vector<glm::vec3> expected = cpu.nodeRadiosity(), found = gl.nodeRadiosity();
  for (std::uint32_t s = 0; s < bake.surfels.count(); ++s) {
    const glm::vec3 &a = expected[bake.hierarchy.leafNode[s]], &b = found[bake.hierarchy.leafNode[s]];
    // Steps of rounding, which are 1/128 of the largest channel in blue.
    const float largest = std::max({a.r, a.g, a.b});
    for (int k = 0; k < 3; ++k) ASSERT_NEAR(b[k], a[k], 0.03f * largest + 1e-5f) << "surfel " << s;
  }
}

// Radiosity of all nodes after a frame, against the CPU's pull of the same leaves.
void expectPullAgrees(const Bake& bake, const char* what) {
  const std::vector<Light> lights = test::someLights();
  LightSetup setup;
  setup.lights = lights;
  Relighter gl = makeRelighter(bake, BackendKind::gl);
  EXPECT_TRUE(gl.relight(setup));
  const std::vector<glm::vec3> found = gl.nodeRadiosity();
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < found.size(); ++i) nodes.push_back(packColor(found[i], ditherOf(i)));
  cpu::PullTree(bake.hierarchy, std::pmr::new_delete_resource()).pull(*cpu::lightSurfelsKernel(Simd::best), nodes, {});
  std::vector<glm::vec3> expected;
  for (const std::uint32_t each : nodes) expected.push_back(unpackColor(each));
  // A colour may be rounded the other way, by a step of 1/128 of its largest channel.
  for (std::size_t i = 0; i < found.size(); ++i) {
    const float largest = std::max({expected[i].r, expected[i].g, expected[i].b});
    for (int k = 0; k < 3; ++k) {
      ASSERT_NEAR(found[i][k], expected[i][k], 0.02f * largest + 1e-5f)
          << bake.surfels.count() << " surfels, " << what << ", node " << i;
    }
  }
}

TEST_F(GlRelighter, pullPassAgrees) {
  for (const std::uint32_t surfels : {1u, 2u, 37u, 20000u}) {
    Bake bake =
        test::makeSyntheticBake({.surfels = surfels, .grid = {1, 1, 1}, .lightmapCaches = 6, .linksPerCache = 8});
    expectPullAgrees(bake, "a balanced tree");
    bake.hierarchy = test::makeRandomTree(surfels, 0.05f, 5);
    expectPullAgrees(bake, "a random tree");
  }
  Bake bake = test::makeSyntheticBake({.surfels = 3000, .grid = {1, 1, 1}, .lightmapCaches = 6, .linksPerCache = 8});
  bake.hierarchy = test::makeRandomTree(3000, 0.0f, 5);
  expectPullAgrees(bake, "a chain");
}

// Coefficients of a frame, against the CPU's from the same nodes.
void expectCachesAgree(const Bake& bake, int luma, int chroma) {
  const std::vector<Light> lights = test::someLights();
  LightSetup setup;
  setup.lights = lights;
  Relighter gl = makeRelighter(bake, BackendKind::gl, luma, chroma);
  EXPECT_TRUE(gl.relight(setup));
  std::vector<std::uint32_t> nodes;
  for (const glm::vec3& each : gl.nodeRadiosity()) nodes.push_back(packColor(each, 0.5f));
  const std::vector<float> expected = test::litCaches(cpu::lightCachesKernel(Simd::best), bake.links, nodes,
                                                      {luma, chroma}, {}, bake.caches.firstMapCache());
  // Halves have 11 bits.
  EXPECT_LT(coefficientDifference(expected, gl.cacheCoefficients(), gl.coefficientsPerCache()), 1e-3)
      << "kind " << static_cast<int>(bake.links.kind) << " l " << luma << " " << chroma;
}

TEST_F(GlRelighter, cachePassAgreesForAllKindsAndManyBands) {
  for (const LinkKind kind : kLinkKinds) {
    const Bake bake = test::makeSyntheticBake({.surfels = 600, .linksPerCache = 61, .kind = kind, .bands = 8});
    for (const auto& [luma, chroma] : {std::pair{1, 1}, {2, 1}, {3, 2}, {4, 4}, {5, 3}, {8, 6}})
      expectCachesAgree(bake, luma, chroma);
  }
}

// Repacked links have 16 bits for a node: rows that reach over several times as many, in uneven steps.
TEST_F(GlRelighter, cachePassAgreesWithManyNodes) {
  for (const std::uint32_t surfels : {40000u, 150000u}) {
    Bake bake = test::makeSyntheticBake(
        {.surfels = surfels, .grid = {3, 3, 3}, .lightmapCaches = 60, .linksPerCache = 61, .kind = LinkKind::oct6});
    std::vector<std::uint32_t> heads = bake.links.head.toVector();
    for (std::uint32_t c = 0; c < bake.links.cacheCount(); ++c) {
      const std::uint32_t begin = bake.links.rowBegin[c], end = bake.links.rowBegin[c + 1];
      std::uint32_t next = 0;  // nodes ascend
      for (std::uint32_t i = begin; i < end; ++i) {
        const double share = std::pow((i - begin + 0.5) / (end - begin), 0.3 + c % 5);
        const std::uint32_t node = std::max(next, static_cast<std::uint32_t>(share * bake.hierarchy.nodeCount()));
        heads[i] = (heads[i] & 0xFFF00000u) | node;
        next = node + 1;
      }
    }
    bake.links.head = std::move(heads);
    const LinkSet links(bake.links, std::pmr::new_delete_resource());
    ASSERT_EQ(links.rows().kind, kRepackedLinks);
    ASSERT_EQ(links.rows().nodeSteps, (bake.hierarchy.nodeCount() - 1) >> 16);
    expectCachesAgree(bake, 3, 2);
  }
}

TEST_F(GlRelighter, cachePassFillsEachTexelFromItsCache) {
  const Bake bake = test::makeSyntheticBake(manySurfels(LinkKind::cone, 3));
  Relighter gl = makeRelighter(bake, BackendKind::gl, 3, 2);
  EXPECT_TRUE(gl.relight({}));
  const std::vector<float> coefficients = gl.cacheCoefficients();
  const GlResolveInputs inputs = gl.gl()->inputs();
  const Lightmap& map = bake.caches.lightmap;
  const auto expectChannel = [&](GLuint texture, std::size_t layers, std::size_t first, std::size_t count) {
    std::vector<float> texels(4 * layers * map.cache.size());
    glBindTexture(GL_TEXTURE_2D_ARRAY, texture);
    glGetTexImage(GL_TEXTURE_2D_ARRAY, 0, GL_RGBA, GL_FLOAT, texels.data());
    glBindTexture(GL_TEXTURE_2D_ARRAY, 0);
    for (std::size_t t = 0; t < map.cache.size(); ++t) {
      for (std::size_t i = 0; i < 4 * layers; ++i) {
        const float found = texels[(i / 4 * map.cache.size() + t) * 4 + i % 4];
        const bool stored = map.cache[t] != kNoCache && i < count;
        const float expected = stored ? coefficients[map.cache[t] * std::size_t{17} + first + i] : 0.0f;
        ASSERT_EQ(found, expected) << "texel " << t << " coefficient " << i;
      }
    }
  };
  ASSERT_EQ(gl.coefficientsPerCache(), 17);
  expectChannel(inputs.lightmapY, 3, 0, 9);
  expectChannel(inputs.lightmapCo, 1, 9, 4);
  expectChannel(inputs.lightmapCg, 1, 13, 4);
}

TEST_F(GlRelighter, framesWithBouncesAgree) {
  for (const LinkKind kind : kLinkKinds) {
    const Bake bake = test::makeSyntheticBake(manySurfels(kind, 4));
    const std::vector<Light> lights = test::someLights();
    LightSetup setup;
    setup.lights = lights;
    setup.skyRadiance = glm::vec3(0.3f);
    Relighter cpu = makeRelighter(bake, BackendKind::cpu), gl = makeRelighter(bake, BackendKind::gl);
    for (int frame = 0; frame < 5; ++frame) {
      EXPECT_TRUE(cpu.relight(setup));
      EXPECT_TRUE(gl.relight(setup));
      EXPECT_LT(coefficientDifference(cpu.cacheCoefficients(), gl.cacheCoefficients(), 48), 0.005) << "frame " << frame;
    }
    gl.reset();
    cpu.reset();
    EXPECT_TRUE(cpu.relight(setup));
    EXPECT_TRUE(gl.relight(setup));
    EXPECT_LT(coefficientDifference(cpu.cacheCoefficients(), gl.cacheCoefficients(), 48), 0.001) << "after reset";
  }
}

TEST_F(GlRelighter, furnaceConvergesToTheSeriesLimit) {
  Relighter gl = makeRelighter(test::makeFurnaceBake(0.6f, 2.0f, 4), BackendKind::gl);
  EXPECT_TRUE(relightUntilConverged(gl, {}));
  const float limit = std::numbers::pi_v<float> * 2.0f / 0.4f;
  EXPECT_NEAR(gl.nodeRadiosity()[0].g, limit, 0.01f * limit);
  EXPECT_NEAR(gl.irradianceOnLightmap({0.5f / 6.0f, 0.5f}, {1, 0, 0}).r, limit, 0.01f * limit);
}

}  // namespace
}  // namespace relume
