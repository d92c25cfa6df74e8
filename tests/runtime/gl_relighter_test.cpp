// SPDX-License-Identifier: MIT
// The OpenGL backend against the CPU backend, pass by pass and over whole frames; its manners toward the host.
#include "relume/relighter.h"

#include "runtime/cpu/light_caches.h"
#include "runtime/cpu/light_surfels.h"
#include "runtime/cpu/pull.h"
#include "runtime/shared/pack_color.h"
#include "runtime/shared/receivers.h"
#include "shaders/shared/layout.h"
#include "tests/runtime/furnace_bake.h"
#include "tests/runtime/gl_test_support.h"
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

constexpr float kPi = std::numbers::pi_v<float>;

using test::coefficientDifference, test::difference;

class GlRelighter : public test::GlTest {};

Relighter make(const Bake& bake, BackendKind backend, int luma = 0, int chroma = 0,
               const std::string& visibility = {}) {
  RelightOptions options;
  options.backend = backend;
  options.getProcAddress = EglContext::getProcAddress;
  options.lumaBands = luma;
  options.chromaBands = chroma;
  options.visibilityGlsl = visibility;
  Result<Relighter> made = Relighter::create(bake, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

std::vector<float> flatten(const std::vector<glm::vec3>& v) {
  std::vector<float> flat;
  for (const glm::vec3& each : v) flat.insert(flat.end(), {each.x, each.y, each.z});
  return flat;
}

test::SyntheticOptions room(LinkKind kind, std::uint32_t bands) {
  // Enough surfels for levels that fill many groups, and sky.
  return {.surfels = 9000, .skyPatches = 48, .linksPerCache = 61, .kind = kind, .bands = bands};
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
  const Bake bake = test::makeSyntheticBake(room(LinkKind::cone, 4));
  const std::vector<Light> lights = test::someLights();
  LightSetup setup;
  setup.lights = lights;
  setup.skyRadiance = {0.5f, 0.7f, 1.0f};
  Relighter cpu = make(bake, BackendKind::cpu), gl = make(bake, BackendKind::gl);
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
    const Bake bake = test::makeSyntheticBake(room(kind, 4));
    strong[0].positionWorld = strong[2].positionWorld = bake.surfels.positionWorld[0];
    Relighter blinded = make(bake, BackendKind::gl), fresh = make(bake, BackendKind::gl);
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
    Bake bake = test::makeSyntheticBake(room(LinkKind::cone, 4));
    // The room's surfels face as their caches do: bend every third.
    std::vector<glm::vec3> normals(bake.surfels.normal.begin(), bake.surfels.normal.end());
    for (std::size_t s = 0; s < normals.size(); s += 3) {
      normals[s] = glm::normalize(normals[s] + (0.3f + static_cast<float>(s % 5)) * glm::vec3(0.3f, 0.5f, -0.2f));
    }
    bake.surfels.normal = normals;
    const std::vector<Light> lights = test::someLights();
    LightSetup setup;
    setup.lights = lights;
    Relighter cpu = make(bake, BackendKind::cpu, luma, chroma), gl = make(bake, BackendKind::gl, luma, chroma);
    for (int frame = 0; frame < 2; ++frame) {
      EXPECT_TRUE(cpu.relight(setup));
      EXPECT_TRUE(gl.relight(setup));
    }
    const std::vector<glm::vec3> expected = cpu.nodeRadiosity(), found = gl.nodeRadiosity();
    std::array<int, 3> ofKind{};
    std::array<glm::dvec3, 3> sum{}, error{};
    for (std::uint32_t s = 0; s < bake.surfels.count(); ++s) {
      const auto kind =
          static_cast<std::size_t>(receiverKind(bake.caches, bake.surfels, s, normalsCount(bake.links.kind, luma)));
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
  Relighter cpu = make(bake, BackendKind::cpu), gl = make(bake, BackendKind::gl);
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
  Relighter gl = make(bake, BackendKind::gl);
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
  Relighter gl = make(bake, BackendKind::gl, luma, chroma);
  EXPECT_TRUE(gl.relight(setup));
  std::vector<std::uint32_t> nodes;
  for (const glm::vec3& each : gl.nodeRadiosity()) nodes.push_back(packColor(each, 0.5f));
  std::vector<float> expected(bake.caches.count() * static_cast<std::size_t>(gl.coefficientsPerCache()));
  cpu::lightCaches(cpu::lightCachesKernel(Simd::best), LinkSet(bake.links, std::pmr::new_delete_resource()), nodes,
                   {luma, chroma}, expected, {}, {}, bake.caches.firstMapCache());
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
  const Bake bake = test::makeSyntheticBake(room(LinkKind::cone, 3));
  Relighter gl = make(bake, BackendKind::gl, 3, 2);
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
    const Bake bake = test::makeSyntheticBake(room(kind, 4));
    const std::vector<Light> lights = test::someLights();
    LightSetup setup;
    setup.lights = lights;
    setup.skyRadiance = glm::vec3(0.3f);
    Relighter cpu = make(bake, BackendKind::cpu), gl = make(bake, BackendKind::gl);
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
  Relighter gl = make(test::makeFurnaceBake(0.6f, 2.0f, 4), BackendKind::gl);
  EXPECT_TRUE(relightUntilConverged(gl, {}));
  const float limit = kPi * 2.0f / 0.4f;
  EXPECT_NEAR(gl.nodeRadiosity()[0].g, limit, 0.01f * limit);
  EXPECT_NEAR(gl.irradianceOnLightmap({0.5f / 6.0f, 0.5f}, {1, 0, 0}).r, limit, 0.01f * limit);
}

TEST_F(GlRelighter, hostsVisibilityIsCompiledInAndItsUniformsReachable) {
  const Bake bake = test::makeFurnaceBake(0.5f, 0.0f, 3);
  Relighter gl =
      make(bake, BackendKind::gl, 0, 0,
           "uniform float hostShadow;\n"
           "float relumeVisibility(uint light, vec3 p, vec3 n) { return light == 1u ? hostShadow : 0.0; }\n");
  std::vector<Light> lights(2);
  for (Light& light : lights) light = {.kind = LightKind::directional, .direction = {-1, 0, 0}};
  LightSetup setup;
  setup.lights = lights;
  glProgramUniform1f(gl.gl()->surfelProgram(), glGetUniformLocation(gl.gl()->surfelProgram(), "hostShadow"), 0.25f);
  EXPECT_TRUE(gl.relight(setup));
  EXPECT_NEAR(gl.nodeRadiosity()[5].r, 0.5f * 0.25f, 1e-3f);
}

TEST_F(GlRelighter, visibilityThatDoesNotCompileGivesItsLog) {
  RelightOptions options;
  options.backend = BackendKind::gl;
  options.getProcAddress = EglContext::getProcAddress;
  options.visibilityGlsl = "float relumeVisibility(uint light, vec3 p, vec3 n) { return noSuchThing; }\n";
  const Result<Relighter> made = Relighter::create(test::makeFurnaceBake(0.5f, 0.0f, 3), options);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().code, ErrorCode::failed);
  EXPECT_NE(made.error().message.find("relumeVisibility"), std::string::npos) << made.error().message;
  EXPECT_GT(context_->errorCount(), 0);
  context_->forgetErrors();
}

TEST_F(GlRelighter, twoRelightersShareABakeAndAContext) {
  const Bake bake = test::makeFurnaceBake(0.5f, 1.0f, 4);
  Relighter one = make(bake, BackendKind::gl), two = make(bake, BackendKind::gl, 2, 1);
  LightSetup dark;
  dark.emissionScale = glm::vec3(0.0f);
  EXPECT_TRUE(one.relight({}));
  EXPECT_TRUE(two.relight(dark));
  EXPECT_NEAR(one.nodeRadiosity()[0].g, kPi, 1e-3f);
  EXPECT_EQ(two.nodeRadiosity()[0], glm::vec3(0.0f));
}

TEST_F(GlRelighter, bakesWithoutLightmapGridOrLinksAreLit) {
  Bake bake = test::makeSyntheticBake({.surfels = 100, .grid = {0, 0, 0}, .lightmapSize = 8, .lightmapCaches = 0});
  Relighter none = make(bake, BackendKind::gl);
  EXPECT_TRUE(none.relight({}));
  EXPECT_TRUE(none.cacheCoefficients().empty());
  EXPECT_EQ(none.irradianceInGrid({0, 0, 0}, {0, 0, 1}), glm::vec3(0.0f));
  bake.caches = Caches{};
  bake.surfels.receiver = std::vector<std::uint32_t>(100, kGridReceiver);
  Relighter empty = make(bake, BackendKind::gl);
  EXPECT_TRUE(empty.relight({}));
  EXPECT_TRUE(empty.relight({}));
}

TEST_F(GlRelighter, timesEachPassWithoutWaiting) {
  Relighter gl = make(test::makeSyntheticBake(room(LinkKind::cone, 4)), BackendKind::gl);
  for (int frame = 0; frame < 6; ++frame) EXPECT_TRUE(gl.relight({}));
  glFinish();
  const std::vector<PassTime> times = gl.passTimes();
  ASSERT_EQ(times.size(), 3u);
  EXPECT_STREQ(times[2].pass, "caches");
  EXPECT_GT(times[2].ms, 0.0);
}

// What SavedState promises, set to something odd and read back.
TEST_F(GlRelighter, bindingsOfTheHostAreAsTheyWere) {
  GLuint buffers[9], textures[2], sampler = 0;
  glGenBuffers(9, buffers);
  glGenTextures(2, textures);
  glGenSamplers(1, &sampler);
  const auto bind = [&] {
    for (GLuint i = 0; i < 7; ++i) {
      glBindBuffer(GL_SHADER_STORAGE_BUFFER, buffers[i]);
      glBufferData(GL_SHADER_STORAGE_BUFFER, 4096, nullptr, GL_STATIC_DRAW);
      glBindBufferRange(GL_SHADER_STORAGE_BUFFER, i, buffers[i], 256, 512);
    }
    glBindBuffer(GL_UNIFORM_BUFFER, buffers[7]);
    glBufferData(GL_UNIFORM_BUFFER, 4096, nullptr, GL_STATIC_DRAW);
    glBindBufferBase(GL_UNIFORM_BUFFER, 7, buffers[7]);
    glBindBuffer(GL_SHADER_STORAGE_BUFFER, buffers[8]);
    glBindBuffer(GL_COPY_READ_BUFFER, buffers[1]);
    glBindBuffer(GL_COPY_WRITE_BUFFER, buffers[2]);
    glActiveTexture(GL_TEXTURE0 + 13);
    glBindTexture(GL_TEXTURE_2D_ARRAY, textures[0]);
    glTexStorage3D(GL_TEXTURE_2D_ARRAY, 1, GL_RGBA16F, 4, 4, 2);
    glBindSampler(13, sampler);
    glActiveTexture(GL_TEXTURE0 + 15);
    glBindTexture(GL_TEXTURE_2D, textures[1]);
    glBindImageTexture(1, textures[0], 0, GL_FALSE, 1, GL_READ_ONLY, GL_RGBA16F);
    glActiveTexture(GL_TEXTURE0 + 3);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
    glPixelStorei(GL_UNPACK_ROW_LENGTH, 77);
    glPixelStorei(GL_PACK_ALIGNMENT, 2);
    glPixelStorei(GL_PACK_ROW_LENGTH, 33);
    glBindBuffer(GL_PIXEL_PACK_BUFFER, buffers[3]);
    glBindBuffer(GL_PIXEL_UNPACK_BUFFER, buffers[4]);
  };
  bind();
  const auto snapshot = [] {
    std::vector<GLint64> state;
    GLint value = 0;
    GLint64 wide = 0;
    for (const GLenum what :
         {GL_CURRENT_PROGRAM, GL_SHADER_STORAGE_BUFFER_BINDING, GL_UNIFORM_BUFFER_BINDING, GL_COPY_READ_BUFFER_BINDING,
          GL_COPY_WRITE_BUFFER_BINDING, GL_ACTIVE_TEXTURE, GL_UNPACK_ALIGNMENT, GL_UNPACK_ROW_LENGTH,
          GL_PIXEL_UNPACK_BUFFER_BINDING, GL_PACK_ALIGNMENT, GL_PACK_ROW_LENGTH, GL_PIXEL_PACK_BUFFER_BINDING}) {
      glGetIntegerv(what, &value);
      state.push_back(value);
    }
    for (GLuint i = 0; i < 8; ++i) {
      glGetIntegeri_v(GL_SHADER_STORAGE_BUFFER_BINDING, i, &value);
      state.push_back(value);
      for (const GLenum what : {GL_SHADER_STORAGE_BUFFER_START, GL_SHADER_STORAGE_BUFFER_SIZE}) {
        glGetInteger64i_v(what, i, &wide);
        state.push_back(wide);
      }
      glGetIntegeri_v(GL_UNIFORM_BUFFER_BINDING, i, &value);
      state.push_back(value);
      for (const GLenum what :
           {GL_IMAGE_BINDING_NAME, GL_IMAGE_BINDING_LAYERED, GL_IMAGE_BINDING_LAYER, GL_IMAGE_BINDING_ACCESS}) {
        glGetIntegeri_v(what, i, &value);
        state.push_back(value);
      }
    }
    for (GLenum unit = 0; unit < 16; ++unit) {
      glActiveTexture(GL_TEXTURE0 + unit);
      for (const GLenum what : {GL_TEXTURE_BINDING_2D, GL_TEXTURE_BINDING_2D_ARRAY, GL_SAMPLER_BINDING}) {
        glGetIntegerv(what, &value);
        state.push_back(value);
      }
    }
    glActiveTexture(static_cast<GLenum>(state[5]));
    return state;
  };
  const std::vector<GLint64> before = snapshot();
  Relighter gl = make(test::makeSyntheticBake(room(LinkKind::sh, 4)), BackendKind::gl);
  EXPECT_EQ(snapshot(), before) << "create()";
  const std::vector<Light> lights = test::someLights();
  LightSetup setup;
  setup.lights = lights;
  EXPECT_TRUE(gl.relight(setup));
  EXPECT_TRUE(gl.relight(setup));
  EXPECT_EQ(snapshot(), before) << "relight()";
  gl.reset();
  EXPECT_FALSE(gl.cacheCoefficients().empty());
  EXPECT_FALSE(gl.nodeRadiosity().empty());
  EXPECT_FALSE(gl.passTimes().empty());
  EXPECT_EQ(snapshot(), before) << "readers";
  glBindBuffer(GL_PIXEL_PACK_BUFFER, 0);
  glBindBuffer(GL_PIXEL_UNPACK_BUFFER, 0);
  for (const GLenum what : {GL_UNPACK_ROW_LENGTH, GL_PACK_ROW_LENGTH}) glPixelStorei(what, 0);
  for (const GLenum what : {GL_UNPACK_ALIGNMENT, GL_PACK_ALIGNMENT}) glPixelStorei(what, 4);
  glDeleteBuffers(9, buffers);
  glDeleteTextures(2, textures);
  glDeleteSamplers(1, &sampler);
}

}  // namespace
}  // namespace relume
