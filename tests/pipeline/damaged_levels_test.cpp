// SPDX-License-Identifier: MIT
// Levels whose numbers are damaged: bytes of vertex data, of indices, of matrices. Whatever they become, the bake ends,
// with a file that is valid or with an error that says what is wrong.
#include "formats/validate.h"
#include "relume/bake/bake.h"
#include "relume/bake_file.h"
#include "tests/import/gltf_builder.h"
#include "tests/long_tests.h"
#include "tests/pipeline/tiny_bake.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

namespace relume {
namespace {

using namespace relume::testing;
using Random = std::mt19937;

// A closed room with a smooth ball on a scaled node, a masked leaf, a lamp's panel and an instanced crate: each with
// every attribute that the baker reads.
struct Level {
  GltfBuilder builder;
  std::vector<int> views;  // of vertex data and indices

  Level() {
    GltfBuilder& b = builder;
    const int picture = b.texture(png(2, 2, {200, 90, 30, 255, 90, 200, 30, 255, 30, 90, 200, 0, 90, 90, 90, 255}));
    const json textured = {{"baseColorTexture", {{"index", picture}}}};
    const int wall = b.material({{"pbrMetallicRoughness", textured}});
    const int leaf = b.material({{"pbrMetallicRoughness", textured}, {"alphaMode", "MASK"}, {"doubleSided", true}});
    const int panel = b.material({{"emissiveFactor", {1, 0.5, 0.25}}});
    b.node({{"name", "room"}, {"mesh", box(wall, -1.0f)}, {"scale", {4, 3, 4}}});
    b.node({{"name", "ball"}, {"mesh", ball(wall)}, {"translation", {2, 1, 2}}, {"rotation", {0, 0.6, 0, 0.8}}});
    b.node({{"name", "leaf"}, {"mesh", quad(leaf)}, {"matrix", {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 1, 3, 1}}});
    b.node(
        {{"name", "panel"}, {"mesh", quad(panel)}, {"translation", {1, 2.5, 1}}, {"rotation", {0.7071, 0, 0, 0.7071}}});
    const int places = track(b.floats({0.3f, 0.1f, 0.3f, 3.2f, 0.1f, 0.4f}, "VEC3"));
    b.node({{"name", "crates"},
            {"mesh", box(wall, 1.0f)},
            {"scale", {0.5, 0.5, 0.5}},
            {"extensions", {{"EXT_mesh_gpu_instancing", {{"attributes", {{"TRANSLATION", places}}}}}}}});
    b.root["cameras"] = json::array({{{"type", "perspective"}, {"perspective", {{"yfov", 1}, {"znear", 0.1}}}}});
    b.node({{"name", "eye"}, {"camera", 0}, {"translation", {2, 1.5, 3.5}}});
    b.node({{"name", "hall"}, {"translation", {2, 1, 2}}, {"extras", {{"relume", {{"volume", {3, 1, 3}}}}}}});
  }

 private:
  int track(int accessor) {
    views.push_back(builder.root["accessors"][static_cast<std::size_t>(accessor)]["bufferView"].get<int>());
    return accessor;
  }
  int mesh(const std::vector<float>& position, const std::vector<float>& normal, const std::vector<float>& uv,
           const std::vector<std::uint16_t>& index, int material) {
    GltfBuilder& b = builder;
    const std::vector<float> color(position.size(), 0.8f);
    return b.mesh({{"attributes",
                    {{"POSITION", track(b.floats(position, "VEC3"))},
                     {"NORMAL", track(b.floats(normal, "VEC3"))},
                     {"TEXCOORD_0", track(b.floats(uv, "VEC2"))},
                     {"TEXCOORD_1", track(b.floats(uv, "VEC2"))},
                     {"COLOR_0", track(b.floats(color, "VEC3"))}}},
                   {"indices", track(b.indices(index))},
                   {"material", material}});
  }
  int quad(int material) {
    return mesh({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, {0, 1, 1, 1, 1, 0, 0, 0},
                {0, 1, 2, 0, 2, 3}, material);
  }
  // A unit cube; side -1: seen from inside.
  int box(int material, float side) {
    std::vector<float> position, normal, uv;
    std::vector<std::uint16_t> index;
    for (int face = 0; face < 6; ++face) {
      const int axis = face / 2;
      const float at = static_cast<float>(face % 2);
      const auto first = static_cast<std::uint16_t>(position.size() / 3);
      for (int corner = 0; corner < 4; ++corner) {
        std::array<float, 3> p{}, n{};
        p[static_cast<std::size_t>(axis)] = at;
        p[static_cast<std::size_t>((axis + 1) % 3)] = corner == 1 || corner == 2 ? 1.0f : 0.0f;
        p[static_cast<std::size_t>((axis + 2) % 3)] = corner >= 2 ? 1.0f : 0.0f;
        n[static_cast<std::size_t>(axis)] = side * (2.0f * at - 1.0f);
        position.insert(position.end(), p.begin(), p.end());
        normal.insert(normal.end(), n.begin(), n.end());
        uv.insert(uv.end(), {corner == 1 || corner == 2 ? 1.0f : 0.0f, corner >= 2 ? 1.0f : 0.0f});
      }
      const bool outward = (at > 0.5f) == (side > 0.0f);
      const std::array<std::uint16_t, 6> order =
          outward ? std::array<std::uint16_t, 6>{0, 1, 2, 0, 2, 3} : std::array<std::uint16_t, 6>{0, 2, 1, 0, 3, 2};
      for (const std::uint16_t i : order) index.push_back(static_cast<std::uint16_t>(first + i));
    }
    return mesh(position, normal, uv, index, material);
  }
  int ball(int material) {
    constexpr int kRings = 6, kSegments = 8;
    std::vector<float> position, normal, uv;
    std::vector<std::uint16_t> index;
    for (int r = 0; r <= kRings; ++r) {
      for (int s = 0; s <= kSegments; ++s) {
        const float polar = 3.14159265f * static_cast<float>(r) / kRings;
        const float azimuth = 2.0f * 3.14159265f * static_cast<float>(s) / kSegments;
        const std::array<float, 3> n{std::sin(polar) * std::cos(azimuth), std::cos(polar),
                                     std::sin(polar) * std::sin(azimuth)};
        normal.insert(normal.end(), n.begin(), n.end());
        for (const float v : n) position.push_back(0.5f * v);
        uv.insert(uv.end(), {static_cast<float>(s) / kSegments, static_cast<float>(r) / kRings});
        if (r == kRings || s == kSegments) continue;
        const auto a = static_cast<std::uint16_t>(r * (kSegments + 1) + s);
        const auto b = static_cast<std::uint16_t>(a + kSegments + 1);
        for (const int i : {a + 0, a + 1, b + 0, a + 1, b + 1, b + 0}) index.push_back(static_cast<std::uint16_t>(i));
      }
    }
    return mesh(position, normal, uv, index, material);
  }
};

// Import and bake; the error's message where either refuses.
std::string bakeOf(const GltfBuilder& level) {
  Context context;
  const Result<Scene> scene = importGltf(level.write(), context);
  if (!scene) return scene.error().message;
  const Result<Bake> baked = bake(*scene, test::tinyBakeOptions(), context);
  if (!baked) return baked.error().message;
  for (const Finding& finding : validateBake(*baked)) {
    EXPECT_NE(finding.severity, FindingSeverity::error) << toString(finding);
  }
  const Result<std::vector<std::byte>> bytes = serializeBake(*baked);
  EXPECT_TRUE(bytes && parseBake(*bytes, nullptr));
  return {};
}

// An error for a damaged level names the level and a place in it, and blames nobody else.
void expectEnds(const GltfBuilder& level, int seed, int& baked) {
  SCOPED_TRACE("seed " + std::to_string(seed));
  const std::string refused = bakeOf(level);
  if (refused.empty()) {
    ++baked;
    return;
  }
  EXPECT_NE(refused.find("test.glb"), std::string::npos) << refused;
  EXPECT_EQ(refused.find("fault of the baker"), std::string::npos) << refused;
  EXPECT_EQ(refused.find("memory"), std::string::npos) << refused;
}

// RELUME_LONG_TESTS tries many more.
int seeds(int few) { return test::longTests() ? 10 * few : few; }

TEST(DamagedLevels, theLevelItselfBakes) { EXPECT_EQ(bakeOf(Level().builder), ""); }

// The fewest rays, most of them aimed at emitters: their weights spread widely, and yet no cache sees more than all
// around.
TEST(FewRays, giveBakesThatAreValid) {
  Context context;
  const Result<Scene> scene = importGltf(Level().builder.write(), context);
  ASSERT_TRUE(scene);
  BakeOptions options = test::tinyBakeOptions();
  options.links.raysPerCache = 16;
  options.links.emitterRays = 1.0f;
  for (options.seed = 1; options.seed <= 20; ++options.seed) {
    const Result<Bake> baked = bake(*scene, options, context);
    EXPECT_TRUE(baked) << "seed " << options.seed << ": " << baked.error().message;
  }
}

TEST(DamagedLevels, randomBytesOfVertexDataAndIndices) {
  const Level whole;
  int baked = 0;
  for (int seed = 0; seed < seeds(60); ++seed) {
    Random random(static_cast<std::uint32_t>(seed));
    GltfBuilder level = whole.builder;
    const json& view = level.root["bufferViews"][static_cast<std::size_t>(whole.views[random() % whole.views.size()])];
    const auto begin = view["byteOffset"].get<std::size_t>(), size = view["byteLength"].get<std::size_t>();
    for (std::uint32_t left = 1 + random() % 6; left > 0; --left)
      level.binary[begin + random() % size] = static_cast<std::uint8_t>(random());
    expectEnds(level, seed, baked);
  }
  EXPECT_GT(baked, seeds(60) / 4);
}

// Floats at the ends of what floats can say, in any attribute.
TEST(DamagedLevels, extremeNumbersOfVertexData) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNan = std::numeric_limits<float>::quiet_NaN();
  constexpr std::array<float, 18> kValues = {0.0f,   -0.0f,   1e-45f, 1e-38f, -1e-20f, 1e-10f, 1e-5f, 1e3f,      1e5f,
                                             9.9e7f, -9.9e7f, 1e8f,   1e12f,  1e20f,   -3e38f, 3e38f, kInfinity, kNan};
  const Level whole;
  int baked = 0;
  for (int seed = 0; seed < seeds(60); ++seed) {
    Random random(static_cast<std::uint32_t>(seed));
    GltfBuilder level = whole.builder;
    const json& view = level.root["bufferViews"][static_cast<std::size_t>(whole.views[random() % whole.views.size()])];
    const auto begin = view["byteOffset"].get<std::size_t>(), size = view["byteLength"].get<std::size_t>();
    for (std::uint32_t left = 1 + random() % 4; left > 0; --left) {
      const float value = kValues[random() % kValues.size()];
      std::memcpy(&level.binary[begin + 4 * (random() % (size / 4))], &value, sizeof value);
    }
    expectEnds(level, seed, baked);
  }
  EXPECT_GT(baked, seeds(60) / 4);
}

TEST(DamagedLevels, extremeTransformsLensesAndVolumes) {
  constexpr std::array<double, 16> kValues = {0,   1e-300, 1e-30, -1e-10, 1e-4, -1,    7,     1e3,
                                              1e6, 9e7,    1e8,   1e9,    1e20, -1e38, 1e300, -1e300};
  const Level whole;
  int baked = 0;
  for (int seed = 0; seed < seeds(60); ++seed) {
    Random random(static_cast<std::uint32_t>(seed));
    const auto value = [&] { return kValues[random() % kValues.size()]; };
    GltfBuilder level = whole.builder;
    json& node = level.root["nodes"][random() % level.root["nodes"].size()];
    switch (random() % 5) {
      case 0:
        node.erase("matrix");
        node["scale"] = {value(), value(), 1};
        break;
      case 1:
        node.erase("matrix");
        node["translation"] = {0, value(), value()};
        break;
      case 2:
        for (const char* name : {"translation", "rotation", "scale"}) node.erase(name);
        node["matrix"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
        for (int left = 0; left < 3; ++left) node["matrix"][random() % 15] = value();
        break;
      case 3:
        node["extras"]["relume"]["volume"] = {1, std::abs(value()), 1};
        break;
      default:
        level.root["cameras"][0] = {
            {"type", "orthographic"},
            {"orthographic", {{"xmag", value()}, {"ymag", value()}, {"znear", 0}, {"zfar", 9}}}};
    }
    expectEnds(level, seed, baked);
  }
  EXPECT_GT(baked, seeds(60) / 4);
}

}  // namespace
}  // namespace relume
