// SPDX-License-Identifier: MIT
// See provenance_level.h.
#include "tests/pipeline/provenance_level.h"

#include "relume/bake/bake.h"
#include "relume/bake_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>

namespace relume::test {

using relume::testing::GltfBuilder;
using relume::testing::png;
using Json = nlohmann::json;

namespace {

// A grid of quads over [0,1]² at y = 0, facing up, with every attribute the baker reads.
Json sheet(GltfBuilder& b, int side) {
  std::vector<float> position, normal, uv, uv1, color;
  std::vector<std::uint16_t> index;
  for (int z = 0; z <= side; ++z) {
    for (int x = 0; x <= side; ++x) {
      const float u = static_cast<float>(x) / static_cast<float>(side),
                  v = static_cast<float>(z) / static_cast<float>(side);
      position.insert(position.end(), {u, 0.05f * std::sin(7.0f * u), v});
      normal.insert(normal.end(), {-0.1f, 0.99f, 0.05f * v});
      uv.insert(uv.end(), {u, v});
      uv1.insert(uv1.end(), {v, u});
      color.insert(color.end(), {1.0f - 0.5f * u, 1.0f, 0.5f + 0.5f * v});
    }
  }
  const int row = side + 1;
  for (int z = 0; z < side; ++z) {
    for (int x = 0; x < side; ++x) {
      const int a = z * row + x;
      for (const int i : {a, a + row, a + 1, a + 1, a + row, a + row + 1})
        index.push_back(static_cast<std::uint16_t>(i));
    }
  }
  return {{"attributes",
           {{"POSITION", b.floats(position, "VEC3")},
            {"NORMAL", b.floats(normal, "VEC3")},
            {"TEXCOORD_0", b.floats(uv, "VEC2")},
            {"TEXCOORD_1", b.floats(uv1, "VEC2")},
            {"COLOR_0", b.floats(color, "VEC3")}}},
          {"indices", b.indices(index)}};
}

}  // namespace

BakeOptions tinyOptions() {
  BakeOptions options = presetOptions(Preset::draft);
  options.playSpace.walks = 1000;
  options.surfels.count = 64;
  options.caches.gridCaches = 8;
  options.caches.lightmapCaches = 32;
  options.links.raysPerCache = 32;
  return options;
}

GltfBuilder makeBase() {
  GltfBuilder b;
  std::vector<std::uint8_t> rgba;
  for (int i = 0; i < 64; ++i)
    rgba.insert(rgba.end(), {static_cast<std::uint8_t>(3 * i), static_cast<std::uint8_t>(200 - i), 90,
                             static_cast<std::uint8_t>(i % 3 == 0 ? 0 : 255)});
  const int texture = b.texture(png(8, 8, rgba), {{"wrapS", 10497}, {"wrapT", 33071}, {"magFilter", 9729}});
  b.root["extensionsUsed"] = {"KHR_lights_punctual", "KHR_texture_transform", "KHR_materials_emissive_strength",
                              "EXT_mesh_gpu_instancing"};
  const Json colour = {
      {"index", texture},
      {"extensions", {{"KHR_texture_transform", {{"offset", {0.1, 0.2}}, {"scale", {2, 3}}, {"rotation", 0.3}}}}}};
  const int floor =
      b.material({{"name", "floor"},
                  {"pbrMetallicRoughness", {{"baseColorFactor", {0.8, 0.7, 0.6, 1.0}}, {"baseColorTexture", colour}}}});
  const int screen =
      b.material({{"name", "screen"},
                  {"alphaMode", "MASK"},
                  {"alphaCutoff", 0.4},
                  {"doubleSided", true},
                  {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}, {"texCoord", 1}}}}},
                  {"emissiveFactor", {0.5, 0.4, 0.3}},
                  {"emissiveTexture", {{"index", texture}}},
                  {"extensions", {{"KHR_materials_emissive_strength", {{"emissiveStrength", 3.0}}}}}});
  b.material({{"name", "unused"},
              {"alphaMode", "MASK"},
              {"pbrMetallicRoughness", {{"baseColorTexture", {{"index", texture}}}}}});
  Json one = sheet(b, 3), two = sheet(b, 2);
  one["material"] = floor;
  two["material"] = screen;
  b.node({{"name", "Floor"},
          {"mesh", b.mesh(one)},
          {"scale", {4, 1, 4}},
          {"extras", {{"relume", {{"texelDensity", 1.5}}}}}});
  b.node({{"name", "Screen"},
          {"mesh", b.mesh(two)},
          {"translation", {1, 1, 1}},
          {"rotation", {0.6, 0, 0, 0.8}},
          {"scale", {2, 1, 2}}});
  b.root["cameras"] = {
      {{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"znear", 0.1}, {"aspectRatio", 1.5}}}}};
  b.node({{"name", "Eye"}, {"camera", 0}, {"translation", {2, 1.5, 3.5}}});
  b.root["extensions"] = {{"KHR_lights_punctual",
                           {{"lights",
                             {{{"type", "spot"},
                               {"intensity", 5.0},
                               {"color", {1, 0.9, 0.8}},
                               {"range", 20.0},
                               {"spot", {{"innerConeAngle", 0.2}, {"outerConeAngle", 0.6}}}}}}}}};
  b.node({{"name", "Lamp"}, {"translation", {2, 2, 2}}, {"extensions", {{"KHR_lights_punctual", {{"light", 0}}}}}});
  return b;
}

std::optional<Baked> bakeLevel(const Scene& scene) {
  Context context;
  Result<Bake> baked = bake(scene, tinyOptions(), context);
  if (!baked) {
    ADD_FAILURE() << baked.error().message;
    return std::nullopt;
  }
  Result<std::vector<std::byte>> bytes = serializeBake(*baked);
  EXPECT_TRUE(bytes) << bytes.error().message;
  return Baked{std::move(*baked), std::move(*bytes)};
}

bool sameButCameras(Bake a, const Baked& b) {
  a.provenance.cameraHash = b.bake.provenance.cameraHash;
  const Result<std::vector<std::byte>> bytes = serializeBake(a);
  return bytes && *bytes == b.bytes;
}

Mesh withNoise(Mesh mesh, double metres, double ofNormal, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (std::size_t i = 0; i < mesh.position.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      mesh.position[i][k] = static_cast<float>(mesh.position[i][k] + metres * unit(random));
      mesh.normal[i][k] = static_cast<float>(mesh.normal[i][k] + ofNormal * unit(random));
    }
  }
  return mesh;
}

}  // namespace relume::test
