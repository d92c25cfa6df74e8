// SPDX-License-Identifier: MIT
// Every pair of luma and chroma bands on both backends: coefficients, the layers they take, and the resolve with its
// guessed third band and its window.
#include "relume/relighter.h"
#include "runtime/shared/bands.h"

#include "tests/long_tests.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>

namespace relume {
namespace {

using test::difference, test::makeRelighter;

class GlBands : public test::GlTest {};

// Lights of opposed colours from opposed sides: chroma has a direction of its own.
std::vector<Light> opposedLights() {
  std::vector<Light> lights = test::someLights();
  lights[1].intensity = {60, 1, 1};
  lights[2].intensity = {1, 90, 3};
  return lights;
}

// Points and normals: on the map's valid texels and their borders, in the room and outside of it.
std::vector<float> receivers(int count) {
  std::vector<float> in;
  for (int i = 0; i < count; ++i) {
    const auto fraction = [i](float step) { return std::fmod(static_cast<float>(i) * step, 1.0f); };
    const glm::vec3 n = glm::normalize(glm::vec3(fraction(0.377f), fraction(0.619f), fraction(0.791f)) * 2.0f - 0.99f);
    const glm::vec3 p = glm::vec3(fraction(0.131f), fraction(0.273f), fraction(0.417f)) * glm::vec3(14, 6, 8) - 1.0f;
    in.insert(in.end(), {fraction(0.618034f), fraction(0.754878f), n.x, n.y, n.z, p.x, p.y, p.z});
  }
  return in;
}

// Irradiance and glossy light at receivers, on the light map and in the grid, by the shader or by the CPU's resolve.
struct Resolved {
  std::vector<float> map, grid, glossyMap, glossyGrid;

  void add(const glm::vec3& a, const glm::vec3& b, const glm::vec3& c, const glm::vec3& d) {
    map.insert(map.end(), {a.x, a.y, a.z});
    grid.insert(grid.end(), {b.x, b.y, b.z});
    glossyMap.insert(glossyMap.end(), {c.x, c.y, c.z});
    glossyGrid.insert(glossyGrid.end(), {d.x, d.y, d.z});
  }
};

Resolved byShader(const Relighter& gl, const std::vector<float>& in) {
  gl.gl()->bind();
  const std::size_t count = in.size() / 8;
  const std::vector<float> found = test::runCompute(
      gl.gl()->glsl(),
      "uint k = 8u * i; vec3 n = vec3(inData[k+2u], inData[k+3u], inData[k+4u]);\n"
      "vec3 plane = normalize(n + vec3(0.4, -0.3, 0.2));\n"
      "vec3 a = relumeIrradianceLightmap(vec2(inData[k], inData[k+1u]), n, plane);\n"
      "vec3 b = relumeIrradianceGrid(vec3(inData[k+5u], inData[k+6u], inData[k+7u]), n);\n"
      "float exponent = float(1u << (i % 8u));\n"
      "vec3 c = relumeGlossyLightmap(vec2(inData[k], inData[k+1u]), plane, exponent);\n"
      "vec3 d = relumeGlossyGrid(vec3(inData[k+5u], inData[k+6u], inData[k+7u]), n, plane, exponent);\n"
      "for (int j = 0; j < 3; ++j) {\n"
      "  outData[12u*i+uint(j)] = a[j]; outData[12u*i+3u+uint(j)] = b[j];\n"
      "  outData[12u*i+6u+uint(j)] = c[j]; outData[12u*i+9u+uint(j)] = d[j];\n"
      "}\n",
      in, count, count * 12);
  Resolved e;
  const auto at = [&found](std::size_t i) { return glm::vec3(found[i], found[i + 1], found[i + 2]); };
  for (std::size_t i = 0; i < found.size(); i += 12) e.add(at(i), at(i + 3), at(i + 6), at(i + 9));
  return e;
}

Resolved byCpu(const Relighter& relighter, const std::vector<float>& in) {
  Resolved e;
  for (std::size_t i = 0; i < in.size() / 8; ++i) {
    const float* q = &in[8 * i];
    const glm::vec3 n(q[2], q[3], q[4]), plane = glm::normalize(n + glm::vec3(0.4f, -0.3f, 0.2f));
    const float exponent = static_cast<float>(1u << (i % 8));
    e.add(relighter.irradianceOnLightmap({q[0], q[1]}, n, plane), relighter.irradianceInGrid({q[5], q[6], q[7]}, n),
          relighter.glossyOnLightmap({q[0], q[1]}, plane, exponent),
          relighter.glossyInGrid({q[5], q[6], q[7]}, n, plane, exponent));
  }
  return e;
}

double coefficientDifference(const Relighter& a, const Relighter& b) {
  return test::coefficientDifference(a.cacheCoefficients(), b.cacheCoefficients(), a.coefficientsPerCache());
}

void expectLayers(GLuint texture, int bands, bool glossy) {
  GLint layers = 0;
  glBindTexture(GL_TEXTURE_2D_ARRAY, texture);
  glGetTexLevelParameteriv(GL_TEXTURE_2D_ARRAY, 0, GL_TEXTURE_DEPTH, &layers);
  glBindTexture(GL_TEXTURE_2D_ARRAY, 0);
  // Bands 3, 5 and 7 of the clamped cosine are zero.
  const int read = !glossy && (bands == 4 || bands == 6 || bands == 8) ? bands - 1 : bands;
  EXPECT_EQ(layers, (read * read + 3) / 4);
}

TEST_F(GlBands, allPairsAgreeWithTheCpuAndTakeOnlyTheirLayers) {
  Bake bake = test::makeSyntheticBake({.surfels = 400, .skyPatches = 12, .linksPerCache = 32, .kind = LinkKind::oct6});
  test::addSight(bake);
  const std::vector<Light> lights = opposedLights();
  LightSetup setup;
  setup.lights = lights;
  setup.skyRadiance = {0.2f, 0.3f, 0.4f};
  const std::vector<float> in = receivers(300);
  // A software driver takes a second or two to compile the shaders of many bands: the default run takes a part of the
  // pairs.
  const bool all = test::longTests();
  for (int luma = 1; luma <= 8; ++luma) {
    for (int chroma = 1; chroma <= luma; ++chroma) {
      if (!all && luma > 3 && chroma != 1 + luma % 5) continue;
      SCOPED_TRACE("Y" + std::to_string(luma) + "Co" + std::to_string(chroma) + "Cg" + std::to_string(chroma));
      const bool glossy = (luma + chroma) % 2 == 0;
      Relighter cpu = makeRelighter(bake, BackendKind::cpu, luma, chroma, "", glossy),
                gl = makeRelighter(bake, BackendKind::gl, luma, chroma, "", glossy);
      ASSERT_EQ(gl.coefficientsPerCache(), luma * luma + 2 * chroma * chroma);
      for (int frame = 0; frame < 2; ++frame) {
        EXPECT_TRUE(cpu.relight(setup));
        EXPECT_TRUE(gl.relight(setup));
      }
      EXPECT_LT(coefficientDifference(cpu, gl), 0.005);
      const GlResolveInputs inputs = gl.gl()->inputs();
      expectLayers(inputs.lightmapY, luma, glossy);
      expectLayers(inputs.lightmapCo, chroma, glossy);
      expectLayers(inputs.lightmapCg, chroma, glossy);
      const Resolved shader = byShader(gl, in), same = byCpu(gl, in);
      // Texture filters weigh with 8 bits, and the map's normals have 8.
      EXPECT_LT(difference(same.map, shader.map), 0.06);
      EXPECT_LT(difference(same.grid, shader.grid), 1e-3);
      EXPECT_LT(difference(same.glossyMap, shader.glossyMap), 0.06);
      EXPECT_LT(difference(same.glossyGrid, shader.glossyGrid), 1e-3);
    }
  }
}

TEST(BandNames, goBothWaysForAllPairsAndNothingElse) {
  int pairs = 0;
  for (int luma = 0; luma < 10; ++luma) {
    for (int chroma = 0; chroma < 10; ++chroma) {
      const std::optional<Bands> found = bandsByName(bandsName({luma, chroma}));
      const bool valid = chroma >= 1 && luma >= chroma && luma <= 8;
      ASSERT_EQ(found.has_value(), valid) << bandsName({luma, chroma});
      if (!valid) continue;
      EXPECT_EQ(found->luma, luma);
      EXPECT_EQ(found->chroma, chroma);
      pairs += 1;
    }
  }
  EXPECT_EQ(pairs, 36);
  for (const char* name : {"", "Y3Co1Cg2", "y3Co1Cg1", "Y3Co1Cg", "Y3Co1Cg11", "Y3Cg1Co1", "Y3Co1Cx1"})
    EXPECT_FALSE(bandsByName(name)) << name;
}

}  // namespace
}  // namespace relume
