// SPDX-License-Identifier: MIT
// The shaders' libraries against their C++ twins, and all shaders against the reference compiler.
#include "runtime/passes/programs.h"
#include "runtime/shared/pack_color.h"
#include "runtime/shared/resolve_defines.h"
#include "runtime/shared/shader_text.h"
#include "runtime/shared/texture_resolve.h"
#include "tests/runtime/gl_test_support.h"

#include "formats/color.h"
#include "formats/compact_links.h"
#include "formats/pack.h"
#include "formats/sh.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>

#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

namespace relume {
namespace {

using test::runCompute;

class GlLibrary : public test::GlTest {};

std::string library(const char* file, int bands = 1) {
  const std::vector<std::pair<std::string, std::string>> defines = {{"RELUME_SH_BANDS", std::to_string(bands)}};
  Result<std::string> text = expandShader(file, defines);
  EXPECT_TRUE(text) << (text ? "" : text.error().message);
  return text ? *text : std::string();
}

std::vector<float> randomDirections(std::size_t count) {
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  std::vector<float> all = {0, 0, 1, 0, 0, -1, 1, 0, 0, 0, -1, 0};
  while (all.size() < 3 * count) {
    const float x = normal(random), y = normal(random), z = normal(random);
    const glm::vec3 d = glm::normalize(glm::vec3(x, y, z));
    all.insert(all.end(), {d.x, d.y, d.z});
  }
  return all;
}

float bitsAsFloat(std::uint32_t bits) { return std::bit_cast<float>(bits); }

TEST_F(GlLibrary, sphericalHarmonicsAgreeInAllBands) {
  const std::size_t count = 300;
  const std::vector<float> in = randomDirections(count);
  for (int bands = 1; bands <= 8; ++bands) {
    const auto n = static_cast<std::size_t>(bands * bands), words = (n + 3) / 4 * 4;
    const std::vector<float> out =
        runCompute(library("lib/sh.glsl", bands),
                   "vec4 y[RELUME_SH_WORDS]; float scale[RELUME_SH_BANDS];\n"
                   "for (int l = 0; l < RELUME_SH_BANDS; ++l) scale[l] = 1.0;\n"
                   "relumeEvaluateSh(vec3(inData[3u*i], inData[3u*i+1u], inData[3u*i+2u]), scale, y);\n"
                   "for (int k = 0; k < 4 * RELUME_SH_WORDS; ++k) outData[i * uint(4 * RELUME_SH_WORDS) + uint(k)] = "
                   "y[k >> 2][k & 3];\n",
                   in, count, count * words);
    for (std::size_t i = 0; i < count; ++i) {
      std::array<float, kMaxCoefficients> y;
      evaluateSh(bands, {in[3 * i], in[3 * i + 1], in[3 * i + 2]}, y);
      for (std::size_t k = 0; k < words; ++k) {
        ASSERT_NEAR(out[i * words + k], k < n ? y[k] : 0.0f, 2e-5f) << "bands " << bands << " index " << k;
      }
    }
  }
}

TEST_F(GlLibrary, coneRatiosAgree) {
  std::vector<float> in;
  for (int i = 0; i <= 200; ++i) in.push_back(-1.0f + 0.01f * static_cast<float>(i));
  const std::vector<float> out = runCompute(library("lib/sh.glsl", 8),
                                            "float r[8]; relumeConeBandRatios(inData[i], 2.0, r); for (int k = 0; k < "
                                            "8; ++k) outData[i * 8u + uint(k)] = r[k];\n",
                                            in, in.size(), in.size() * 8);
  for (std::size_t i = 0; i < in.size(); ++i) {
    std::array<float, 8> ratio;
    coneBandRatios(8, in[i], ratio);
    for (std::size_t k = 0; k < 8; ++k) ASSERT_NEAR(out[8 * i + k], 2.0f * ratio[k], 2e-5f);
  }
}

TEST_F(GlLibrary, cosineFactorsAgree) {
  const std::vector<float> out =
      runCompute(library("lib/sh.glsl", 8), "outData[i] = kRelumeCosine[i];\n", {0.0f}, 8, 8);
  for (std::size_t l = 0; l < 8; ++l) ASSERT_NEAR(out[l], clampedCosineFactors()[l], 1e-6f);
}

TEST_F(GlLibrary, packedDirectionsAndPointsAgree) {
  const std::vector<float> directions = randomDirections(500);
  std::vector<float> in;
  for (std::size_t i = 0; i < 500; ++i) {
    in.push_back(bitsAsFloat(packOctahedral({directions[3 * i], directions[3 * i + 1], directions[3 * i + 2]})));
  }
  in.push_back(bitsAsFloat(kNoDirection));
  const std::vector<float> out =
      runCompute(library("lib/pack.glsl"),
                 "uint bits = floatBitsToUint(inData[i]); vec3 d = relumeUnpackOctahedral(bits);\n"
                 "outData[5u*i] = d.x; outData[5u*i+1u] = d.y; outData[5u*i+2u] = d.z;\n"
                 "vec2 p = relumeUnpackUnorm16x2(bits); outData[5u*i+3u] = p.x; outData[5u*i+4u] = p.y;\n",
                 in, in.size(), in.size() * 5);
  for (std::size_t i = 0; i < in.size(); ++i) {
    const auto bits = std::bit_cast<std::uint32_t>(in[i]);
    const glm::vec3 d = unpackOctahedral(bits);
    const glm::vec2 p = unpackUnorm16x2(bits);
    for (int k = 0; k < 3; ++k) ASSERT_NEAR(out[5 * i + static_cast<std::size_t>(k)], d[k], 2e-6f);
    for (int k = 0; k < 2; ++k) ASSERT_NEAR(out[5 * i + 3 + static_cast<std::size_t>(k)], p[k], 1e-6f);
  }
}

TEST_F(GlLibrary, partsOfCompactLinksAgree) {
  std::vector<float> in;
  std::mt19937 random(6);
  for (int i = 0; i < 2000; ++i) in.push_back(bitsAsFloat(static_cast<std::uint32_t>(random())));
  // NaNs may change on the way: keep the exponent's lowest bit clear.
  for (float& each : in) each = bitsAsFloat(std::bit_cast<std::uint32_t>(each) & ~0x00800000u);
  const std::vector<float> out =
      runCompute(library("lib/pack.glsl"),
                 "uint b = floatBitsToUint(inData[i]); vec3 d = relumeUnpackDirection(b, 12);\n"
                 "vec3 e = relumeUnpackDirection(b & 0xFFFFu, 6); uint o = 9u * i;\n"
                 "outData[o] = d.x; outData[o+1u] = d.y; outData[o+2u] = d.z;\n"
                 "outData[o+3u] = e.x; outData[o+4u] = e.y; outData[o+5u] = e.z;\n"
                 "outData[o+6u] = relumeUnpackCone(b, 24, 8);\n"
                 "outData[o+7u] = relumeUnpackCone(b & 0xFFFFu, 12, 4);\n"
                 "outData[o+8u] = relumeUnpackTransfer(b);\n",
                 in, in.size(), in.size() * 9);
  for (std::size_t i = 0; i < in.size(); ++i) {
    const auto bits = std::bit_cast<std::uint32_t>(in[i]);
    const LinkDirection eight = unpackShape8(bits), six = unpackShape6(bits & 0xFFFFu);
    for (int k = 0; k < 3; ++k) {
      ASSERT_NEAR(out[9 * i + static_cast<std::size_t>(k)], eight.direction[k], 2e-6f);
      ASSERT_NEAR(out[9 * i + 3 + static_cast<std::size_t>(k)], six.direction[k], 2e-6f);
    }
    ASSERT_NEAR(out[9 * i + 6], eight.cosAlpha, 1e-6f);
    ASSERT_NEAR(out[9 * i + 7], six.cosAlpha, 1e-6f);
    ASSERT_NEAR(out[9 * i + 8], unpackTransfer(bits >> 20), 1e-9f);
  }
}

TEST_F(GlLibrary, packedColorsAgreeAndKeepAnyUnit) {
  std::mt19937 random(9);
  std::vector<float> in = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (int i = 0; i < 400; ++i) {
    const float scale = std::pow(10.0f, static_cast<float>(random() % 18) - 9.0f);
    for (int k = 0; k < 3; ++k) in.push_back(scale * static_cast<float>(random() % 10001) / 10000.0f);
  }
  const std::size_t count = in.size() / 3;
  const std::vector<float> out =
      runCompute(library("lib/pack.glsl") + library("lib/color.glsl"),
                 "uint p = relumePackColor(vec3(inData[3u*i], inData[3u*i+1u], inData[3u*i+2u]), relumeDither(i));\n"
                 "vec3 c = relumeUnpackColor(p);\n"
                 "for (int k = 0; k < 3; ++k) outData[3u*i+uint(k)] = c[k];\n",
                 in, count, in.size());
  for (std::size_t i = 0; i < count; ++i) {
    const glm::vec3 color(in[3 * i], in[3 * i + 1], in[3 * i + 2]);
    const glm::vec3 back = unpackColor(packColor(color, ditherOf(static_cast<std::uint32_t>(i))));
    const float step = std::max(color.r, std::max(color.g, color.b)) / 128.0f;
    for (int k = 0; k < 3; ++k) {
      ASSERT_NEAR(back[k], color[k], step + 1e-11f);
      ASSERT_EQ(out[3 * i + static_cast<std::size_t>(k)], back[k]);
    }
  }
}

// Names of the host's stand in one text with Relume's own, of which it has to know only what they begin with.
TEST_F(GlLibrary, namesOfTheHostsMeetNoneOfThePasses) {
  const std::string host =
      "const float kPi = 3.0;\n"
      "uniform float light[4], host[2];\n"
      "uniform int surfel, node, part, texelColor, emissionColor, surfelLight, movingLight, shapeWord, leafNode, "
      "sampleWord, voxelWord, ownSum, bouncedSum;\n"
      "layout(binding = 0) uniform Lights { vec4 lamp; };\n"
      "layout(binding = 1) uniform Host { vec4 shade; };\n"
      "struct Surfels { int a; }; struct Nodes { int a; }; struct Texels { int a; }; struct Emission { int a; };\n"
      "struct SurfelLight { int a; }; struct LeafNode { int a; }; struct Shapes { int a; }; struct Parts { int a; };\n"
      "struct MovingLight { int a; }; struct Samples { int a; }; struct Voxels { int a; }; struct Direct { int a; };\n"
      "vec3 direct(vec3 a, vec3 b) { return a; }\n"
      "vec3 direct(uint i, vec3 a, vec3 b) { return a; }\n"
      "vec3 flatBounce(vec2 a) { return vec3(a, 0.0); }\n"
      "vec3 radiosityOfSurfel(uint a, uint b) { return vec3(0.0); }\n"
      "vec3 shapeVector(uint a) { return vec3(0.0); }\n"
      "vec3 directionOfView(uint a) { return vec3(0.0); }\n"
      "ivec4 bytesOf(uint a) { return ivec4(0); }\n"
      "vec3 lightAt(uvec2 a, vec3 b) { return b; }\n"
      "float relumeVisibility(uint i, vec3 p, vec3 n) { return kPi * light[0] * host[1] * lamp.x * shade.x; }\n";
  const auto defines = gpu::partLightProgram({4, 2, false}).allDefines();
  for (const char* path : {"light_surfels.comp", "light_parts.comp", "live_direct.comp"}) {
    const Result<std::string> text = expandShader(path, defines, host);
    ASSERT_TRUE(text) << text.error().message;
    const GLuint program = glCreateProgram();
    EXPECT_TRUE(test::linkCompute(program, "#version 430 core\n" + *text)) << path;
    glDeleteProgram(program);
  }
}

// Every pass in every shape that the runtime compiles, through the reference compiler.
TEST(Shaders, passTheReferenceCompiler) {
#if !defined(RELUME_GLSLANG_VALIDATOR)
  GTEST_SKIP() << "glslangValidator was not found when this test was built";
#else
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / ("relume_shaders_" + std::to_string(std::random_device{}()));
  fs::create_directories(folder);
  std::string command = std::string(RELUME_GLSLANG_VALIDATOR);
  int files = 0;
  const auto add = [&](const char* shader, const char* stage, Defines defines, const std::string& tail = "") {
    Result<std::string> text = expandShader(shader, defines);
    ASSERT_TRUE(text) << text.error().message;
    const fs::path path = folder / (std::to_string(files++) + "." + stage);
    std::ofstream(path) << "#version 430 core\n" << *text << tail;
    command += " " + path.string();
  };
  for (const char* threads : {"8", "128"}) {
    for (const char* top : {"0", "1"}) {
      const std::array<std::pair<std::string, std::string>, 2> defines{
          {{"RELUME_PULL_THREADS", threads}, {"RELUME_PULL_TOP", top}}};
      add("pull.comp", "comp", defines);
    }
  }
  add("light_surfels.comp", "comp", {});
  add("live_clear.comp", "comp", {});
  add("live_voxelise.comp", "comp", {});
  for (const char* lanes : {"8", "64"}) {
    const std::array<std::pair<std::string, std::string>, 1> defines{{{"RELUME_LANES", lanes}}};
    add("live_voxelise_large.comp", "comp", defines);
  }
  // Those that follow cones, through one volume and through several.
  for (const char* directions : {"1", "6"}) {
    for (const char* halves : {"0", "1"}) {
      const std::array<std::pair<std::string, std::string>, 3> defines{
          {{"RELUME_CONE_DIRECTIONS", directions}, {"RELUME_CONE_HALVES", halves}, {"RELUME_LIVE_NESTED", "1"}}};
      for (const std::size_t count : {2u, 3u}) {
        for (const char* shader : {"cone_hemisphere.comp", "cone_lobe.comp"})
          add(shader, "comp", std::span(defines).first(count));
      }
      for (const char* shader : {"cone_inject.comp", "cone_brightest.comp", "cone_first.comp", "cone_level.comp"})
        add(shader, "comp", std::span(defines).first(2));
    }
  }
#ifdef RELUME_SPLAT_SHADERS
  for (const char* stage : {"vert", "frag"}) {
    add((std::string("splat_records.") + stage).c_str(), stage, {});
    add((std::string("splat_picture.") + stage).c_str(), stage, {});
  }
  const std::array<std::pair<std::string, std::string>, 1> packed{{{"RELUME_SPLAT_PACKED", ""}}};
  add("splat_picture.frag", "frag", packed);
  for (const char* order : {"1", "2", "10"}) {
    const std::array<std::pair<std::string, std::string>, 1> mirrors{{{"RELUME_SPLAT_ORDER", order}}};
    add("splat_records.vert", "vert", mirrors);
    for (const char* fragment : {"splat_mirrors.frag", "splat_picture.frag"}) add(fragment, "frag", mirrors);
  }
#endif
  add("live_raster.glsl", "frag", {}, "in vec3 p; void main() { relumeVoxelWrite(p); }\n");
  for (const auto& [luma, chroma] : {std::pair{1, 1}, {2, 1}, {3, 3}, {4, 2}, {8, 8}}) {
    for (const bool irradianceOnMap : {false, true}) {
      const auto bands = bandDefines({luma, chroma, irradianceOnMap});
      for (const char* grid : {"0", "1"}) {
        auto bounce = bands;
        bounce.emplace_back("RELUME_BOUNCE_GRID", grid);
        add("bounce_surfels.comp", "comp", bounce);
      }
      add("resolve.glsl", "frag", resolveDefines({luma, chroma, irradianceOnMap}),
          "in vec3 p; out vec3 c; void main() { c = relumeIrradianceLightmap(p.xy, p) + relumeIrradianceGrid(p, p) + "
          "relumeGlossyLightmap(p.xy, p, p.x) + relumeGlossyGrid(p, p, p, p.x); }\n");
      // By textures alone, in the oldest versions that it is meant for.
      for (const bool gridTexture : {false, true}) {
        for (const char* version : {"330 core", "300 es"}) {
          const Result<std::string> text = textureResolveGlsl({luma, chroma, irradianceOnMap}, gridTexture);
          ASSERT_TRUE(text) << text.error().message;
          const fs::path path = folder / (std::to_string(files++) + ".frag");
          std::ofstream(path) << "#version " << version << "\n"
                              << *text
                              << "in vec3 p; out vec4 c; void main() { c.rgb = relumeIrradianceLightmap(p.xy, p) + "
                                 "relumeIrradianceGridTexture(p, p) + relumeIrradianceGridSmooth(p, p) + "
                                 "relumeGlossyLightmap(p.xy, p, p.x) + relumeGlossyGrid(p, p, p, p.x); c.a = 1.0; }\n";
          command += " " + path.string();
        }
      }
    }
    add("light_parts.comp", "comp", gpu::partLightProgram({luma, chroma, false}).allDefines());
    for (const LinkKind kind : kLinkKinds) {
      for (const auto threads : {gpu::GroupThreads::serial, gpu::GroupThreads::parallel}) {
        const CacheBands bands{luma, chroma, kind == LinkKind::irradiance};
        const gpu::CacheGroup group = gpu::chooseCacheGroup(threads, bands);
        const auto addProgram = [&](const gpu::ProgramSource& source) {
          add(source.path, "comp", source.allDefines());
        };
        for (const int steps : {-1, 0, 5}) {
          if (steps >= 0 && kind != LinkKind::oct6) continue;
          for (const bool map : {false, true}) {
            for (const bool moving : {false, true})
              addProgram(gpu::cacheProgram(bands, kind, group, steps, map, moving));
          }
          if (luma == 1) addProgram(gpu::occludeProgram(kind, gpu::chooseOccludeGroup(threads, 1), steps));
        }
      }
    }
  }
  const fs::path log = folder / "log";
  const int status = std::system((command + " > " + log.string() + " 2>&1").c_str());
  std::ifstream in(log);
  EXPECT_EQ(status, 0) << std::string(std::istreambuf_iterator<char>(in), {});
  fs::remove_all(folder);
#endif
}

TEST(Shaders, unknownIncludesAreNamed) {
  const Result<std::string> text = expandShader("no_such.comp", {});
  ASSERT_FALSE(text);
  EXPECT_NE(text.error().message.find("no_such.comp"), std::string::npos);
}

}  // namespace
}  // namespace relume
