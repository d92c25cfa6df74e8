// SPDX-License-Identifier: MIT
// The grid with bricks and with depths: the shader reads what the CPU reads.
#include "relume/relighter.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"

#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <random>

namespace relume {
namespace {

class GlGrid : public test::GlTest {};

Relighter light(const Bake& bake, BackendKind backend, RelightOptions options = {}) {
  options.backend = backend;
  options.getProcAddress = EglContext::getProcAddress;
  if (options.lumaBands == 0) options.lumaBands = 3, options.chromaBands = 2;
  Result<Relighter> made = Relighter::create(bake, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  const std::array<Light, 2> lights = test::lampAndSun();
  LightSetup setup;
  setup.lights = lights;
  EXPECT_TRUE(made->relight(setup));
  return std::move(*made);
}

// Points inside the room and around it, some on the lattice's own planes.
std::vector<float> gridReceivers(const CacheGrid& grid) {
  std::mt19937 random(8);
  std::uniform_real_distribution<float> uniform(-0.3f, 1.3f);
  std::normal_distribution<float> gauss;
  std::vector<float> in;
  for (int i = 0; i < 600; ++i) {
    glm::vec3 p = grid.originWorld + glm::vec3(uniform(random), uniform(random), uniform(random)) * grid.spacing *
                                         glm::vec3(grid.resolution - 1u);
    if (i % 5 == 0) p = grid.originWorld + grid.spacing * glm::vec3(i % 3, i % 2, i % 4);
    const glm::vec3 n = glm::normalize(glm::vec3(gauss(random), gauss(random), gauss(random)));
    in.insert(in.end(), {p.x, p.y, p.z, n.x, n.y, n.z});
  }
  return in;
}

void expectSame(const Bake& bake) {
  const Relighter cpu = light(bake, BackendKind::cpu), gl = light(bake, BackendKind::gl);
  const std::vector<float> in = gridReceivers(bake.caches.grid);
  const std::size_t count = in.size() / 6;
  gl.gl()->bind();
  const std::vector<float> found =
      test::runCompute(gl.gl()->glsl(),
                       "uint k = 6u * i; vec3 e = relumeIrradianceGrid(vec3(inData[k], inData[k+1u], inData[k+2u]), "
                       "vec3(inData[k+3u], inData[k+4u], inData[k+5u]));\n"
                       "for (int j = 0; j < 3; ++j) outData[3u*i+uint(j)] = e[j];\n",
                       in, count, count * 3);
  double mean = 0.0;
  std::vector<glm::vec3> expected;
  for (std::size_t i = 0; i < count; ++i) {
    const float* q = &in[6 * i];
    expected.push_back(cpu.irradianceInGrid({q[0], q[1], q[2]}, {q[3], q[4], q[5]}));
    mean += static_cast<double>(glm::length(expected.back())) / static_cast<double>(count);
  }
  ASSERT_GT(mean, 0.0);
  double largest = 0.0, square = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    for (int k = 0; k < 3; ++k) {
      const double d = std::abs(static_cast<double>(found[3 * i + static_cast<std::size_t>(k)]) -
                                static_cast<double>(expected[i][k]));
      largest = std::max(largest, d / mean);
      square += d * d / (mean * mean) / static_cast<double>(3 * count);
    }
  }
  // Caches are halves in OpenGL.
  EXPECT_LT(std::sqrt(square), 1e-3);
  EXPECT_LT(largest, 5e-3);
}

std::vector<float> runGrid(const Relighter& gl, const std::string& function, const std::vector<float>& in) {
  const std::size_t count = in.size() / 6;
  return test::runCompute(gl.gl()->glsl(),
                          "uint k = 6u * i; vec3 e = " + function +
                              "(vec3(inData[k], inData[k+1u], inData[k+2u]), "
                              "vec3(inData[k+3u], inData[k+4u], inData[k+5u]));\n"
                              "for (int j = 0; j < 3; ++j) outData[3u*i+uint(j)] = e[j];\n",
                          in, count, count * 3);
}

// The shader's texture reads and those of its read-back on the processor, against the CPU backend.
void expectSameTexture(const Bake& bake, int luma, int chroma, float trust) {
  RelightOptions options;
  options.lumaBands = luma;
  options.chromaBands = chroma;
  options.gridTexture = true;
  options.gridTrust = trust;
  const Relighter cpu = light(bake, BackendKind::cpu, options), gl = light(bake, BackendKind::gl, options);
  ASSERT_GT(cpu.gridTexture().resolution.x, 0u);
  EXPECT_EQ(cpu.gridTexture().openCells, gl.gridTexture().openCells);
  const std::vector<float> in = gridReceivers(bake.caches.grid);
  const std::size_t count = in.size() / 6;
  gl.gl()->bind();
  for (const GridLookup lookup : {GridLookup::texture, GridLookup::smooth}) {
    SCOPED_TRACE(lookup == GridLookup::smooth ? "smooth" : "texture");
    const std::vector<float> found =
        runGrid(gl, lookup == GridLookup::smooth ? "relumeIrradianceGridSmooth" : "relumeIrradianceGridTexture", in);
    std::vector<glm::vec3> expected;
    double mean = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const float* q = &in[6 * i];
      expected.push_back(cpu.irradianceInGrid({q[0], q[1], q[2]}, {q[3], q[4], q[5]}, lookup));
      mean += static_cast<double>(glm::length(expected.back())) / static_cast<double>(count);
    }
    ASSERT_GT(mean, 0.0);
    double largest = 0.0, square = 0.0, readBack = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const float* q = &in[6 * i];
      const glm::vec3 back = gl.irradianceInGrid({q[0], q[1], q[2]}, {q[3], q[4], q[5]}, lookup);
      for (int k = 0; k < 3; ++k) {
        const auto e = static_cast<double>(expected[i][k]);
        const double d = std::abs(static_cast<double>(found[3 * i + static_cast<std::size_t>(k)]) - e);
        readBack = std::max(readBack, std::abs(static_cast<double>(back[k]) - e) / mean);
        largest = std::max(largest, d / mean);
        square += d * d / (mean * mean) / static_cast<double>(3 * count);
      }
    }
    // Caches and texels are halves in OpenGL.
    EXPECT_LT(std::sqrt(square), 2e-3);
    EXPECT_LT(largest, test::isSoftware() ? 1e-2 : 4e-2);
    EXPECT_LT(readBack, 1e-2);
  }
}

TEST_F(GlGrid, textureAgreesWithTheCpu) {
  const Bake bricks = test::makeBakeWithBricks({4, 3, 4}, true, true);
  expectSameTexture(bricks, 3, 2, 1.0f);
  expectSameTexture(bricks, 3, 2, 0.6f);
  expectSameTexture(test::makeBakeWithBricks({4, 3, 4}, false, false), 3, 2, 0.35f);
}

TEST_F(GlGrid, textureOfAnyBandsAgreesWithTheCpu) {
  const Bake bake = test::makeBakeWithBricks({3, 4, 2}, false, false);
  for (const auto& [luma, chroma] :
       {std::pair(1, 1), std::pair(2, 1), std::pair(2, 2), std::pair(4, 3), std::pair(7, 1)}) {
    SCOPED_TRACE(std::to_string(luma) + " " + std::to_string(chroma));
    expectSameTexture(bake, luma, chroma, 1.0f);
  }
}

TEST_F(GlGrid, textureOfOnePointAlongAnAxisAgreesWithTheCpu) {
  expectSameTexture(test::makeBakeWithBricks({3, 1, 2}, false, false), 3, 2, 1.0f);
}

// Without a texture, and where no cell is open, the shader reads the caches around, as it does without asking.
TEST_F(GlGrid, withoutATextureTheCachesAroundAreRead) {
  const Bake bake = test::makeBakeWithBricks({4, 3, 4}, true, true);
  const std::vector<float> in = gridReceivers(bake.caches.grid);
  RelightOptions none, closed, tiny;
  closed.gridTexture = tiny.gridTexture = true;
  closed.gridTrust = 0.0f;
  tiny.gridTextureBytes = 71;
  for (const RelightOptions& options : {none, closed, tiny}) {
    const Relighter gl = light(bake, BackendKind::gl, options);
    EXPECT_EQ(gl.gridTexture().openCells, 0u);
    gl.gl()->bind();
    const std::vector<float> expected = runGrid(gl, "relumeIrradianceGrid", in);
    EXPECT_EQ(runGrid(gl, "relumeIrradianceGridTexture", in), expected);
    EXPECT_EQ(runGrid(gl, "relumeIrradianceGridSmooth", in), expected);
  }
}

// Before the first frame and after reset() there is no light, and frames that follow are those of a fresh relighter.
TEST_F(GlGrid, textureForgetsWithReset) {
  const Bake bake = test::makeBakeWithBricks({4, 3, 4}, false, false);
  const std::vector<float> in = gridReceivers(bake.caches.grid);
  RelightOptions options;
  options.gridTexture = true;
  options.gridTrust = 1.0f;
  Relighter gl = light(bake, BackendKind::gl, options);
  gl.gl()->bind();
  const std::vector<float> lit = runGrid(gl, "relumeIrradianceGridTexture", in);
  gl.reset();
  for (const float e : runGrid(gl, "relumeIrradianceGridTexture", in)) ASSERT_EQ(e, 0.0f);
  for (const GridLookup lookup : {GridLookup::texture, GridLookup::smooth})
    EXPECT_EQ(gl.irradianceInGrid(bake.caches.grid.originWorld, {0, 1, 0}, lookup), glm::vec3(0.0f));
  const Relighter fresh = light(bake, BackendKind::gl, options);
  fresh.gl()->bind();
  EXPECT_EQ(runGrid(fresh, "relumeIrradianceGridTexture", in), lit);
}

// The shader answers for any bits that a host may hand over as the CPU does, on the grid and on the light map.
TEST_F(GlGrid, receiversThatAreNowhereReadNothing) {
  const Bake bake = test::makeBakeWithBricks({4, 3, 4}, true, true);
  const Relighter cpu = light(bake, BackendKind::cpu), gl = light(bake, BackendKind::gl);
  const std::vector<test::WeirdReceiver> receivers = test::weirdReceivers();
  std::vector<float> in;
  for (const test::WeirdReceiver& r : receivers)
    in.insert(in.end(), {r.position.x, r.position.y, r.position.z, r.normal.x, r.normal.y, r.normal.z});
  gl.gl()->bind();
  const std::vector<float> found = test::runCompute(
      gl.gl()->glsl(),
      "uint k = 6u * i; vec3 n = vec3(inData[k+3u], inData[k+4u], inData[k+5u]);\n"
      "vec3 e = relumeIrradianceGrid(vec3(inData[k], inData[k+1u], inData[k+2u]), n);\n"
      "vec3 m = relumeIrradianceLightmap(vec2(inData[k], inData[k+1u]), n, vec3(0, 1, 0));\n"
      "for (int j = 0; j < 3; ++j) { outData[6u*i+uint(j)] = e[j]; outData[6u*i+3u+uint(j)] = m[j]; }\n",
      in, receivers.size(), receivers.size() * 6);
  for (std::size_t i = 0; i < receivers.size(); ++i) {
    const test::WeirdReceiver& r = receivers[i];
    const glm::vec3 grid = cpu.irradianceInGrid(r.position, r.normal);
    const glm::vec3 map = cpu.irradianceOnLightmap(glm::vec2(r.position), r.normal, {0, 1, 0});
    const auto same = [&](int at, const glm::vec3& expected, bool whole) {
      for (int k = 0; k < 3; ++k) {
        const float v = found[6 * i + static_cast<std::size_t>(at + k)];
        ASSERT_TRUE(std::isfinite(v) && v >= 0.0f) << i << ": " << v;
        if (whole) {
          ASSERT_NEAR(v, expected[k], 0.02f * expected[k] + 0.02f) << i;
        } else {
          ASSERT_EQ(v, 0.0f) << i;
        }
      }
    };
    same(0, grid, r.isInGrid());
    same(3, map, r.isOnMap());
  }
}

TEST_F(GlGrid, latticeAgreesWithTheCpu) { expectSame(test::makeBakeWithBricks({4, 3, 4}, false, false)); }
TEST_F(GlGrid, bricksAgreeWithTheCpu) { expectSame(test::makeBakeWithBricks({4, 3, 4}, true, false)); }
TEST_F(GlGrid, depthsAgreeWithTheCpu) { expectSame(test::makeBakeWithBricks({4, 3, 4}, false, true)); }
TEST_F(GlGrid, bricksAndDepthsAgreeWithTheCpu) { expectSame(test::makeBakeWithBricks({3, 4, 2}, true, true)); }
TEST_F(GlGrid, gridsOfOnePointAlongAnAxisAgreeWithTheCpu) {
  expectSame(test::makeBakeWithBricks({3, 1, 2}, true, true));
}

}  // namespace
}  // namespace relume
