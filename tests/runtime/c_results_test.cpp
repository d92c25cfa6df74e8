// SPDX-License-Identifier: MIT
// What relume.h hands over of a frame for shaders and engines: maps, volumes, textures, coordinates.
#include "tests/runtime/c_api_fixture.h"

#include <cstring>
#include <string>
#include <vector>

namespace relume {
namespace {

using test::CApi;
using test::Handles;

TEST_F(CApi, texturesToResolveWithAreThoseOfTheCppApi) {
  Handles h;
  Relighter same = cpp();
  ASSERT_NO_FATAL_FAILURE(light(h, same));
  const Result<TextureResolve> expected = same.textureResolve();
  ASSERT_TRUE(expected);
  unsigned int count = 0;
  ASSERT_EQ(relume_resolve_texture_count(h.relighter, &count), RELUME_OK);
  ASSERT_EQ(count, expected->textures.size());
  for (unsigned int i = 0; i < count; ++i) {
    relume_resolve_texture info{};
    info.struct_size = sizeof info;
    ASSERT_EQ(relume_resolve_texture_get_info(h.relighter, i, &info), RELUME_OK);
    const ResolveTexture& texture = expected->textures[i];
    EXPECT_STREQ(info.sampler, texture.sampler);
    EXPECT_EQ(glm::uvec3(info.width, info.height, info.depth), texture.size);
    EXPECT_EQ(info.filtered != 0, texture.isFiltered);
    EXPECT_EQ(info.light != 0, texture.isLight);
    EXPECT_EQ(static_cast<int>(info.shape), static_cast<int>(texture.shape));
    EXPECT_EQ(static_cast<int>(info.format), static_cast<int>(texture.format));
    ASSERT_EQ(info.bytes, texture.bytes);
    std::vector<std::byte> texels(info.bytes), wanted(info.bytes);
    ASSERT_EQ(relume_resolve_texture_write(h.relighter, i, texels.data(), texels.size()), RELUME_OK);
    ASSERT_TRUE(same.writeResolveTexture(i, wanted));
    EXPECT_EQ(texels, wanted) << texture.sampler;
    EXPECT_EQ(relume_resolve_texture_write(h.relighter, i, texels.data(), texels.size() - 1), RELUME_ERROR_USAGE);
    EXPECT_EQ(relume_resolve_texture_write(h.relighter, i, nullptr, texels.size()), RELUME_ERROR_USAGE);
  }
  relume_resolve_texture info{};
  EXPECT_EQ(relume_resolve_texture_get_info(h.relighter, 0, &info), RELUME_ERROR_USAGE) << "no struct_size";
  info.struct_size = sizeof info;
  EXPECT_EQ(relume_resolve_texture_get_info(h.relighter, 99, &info), RELUME_ERROR_USAGE);
  EXPECT_NE(std::string(relume_relighter_error(h.relighter)).find("texture is 99"), std::string::npos);
  float grid[24];
  ASSERT_EQ(relume_resolve_uniforms(h.relighter, grid), RELUME_OK);
  EXPECT_EQ(std::memcmp(grid, expected->grid.data(), sizeof grid), 0);

  const std::string glsl = *same.textureResolveGlsl();
  std::size_t length = 0;
  ASSERT_EQ(relume_resolve_glsl(h.relighter, nullptr, 0, &length), RELUME_OK);
  EXPECT_EQ(length, glsl.size());
  std::vector<char> text(length + 1, 'x');
  ASSERT_EQ(relume_resolve_glsl(h.relighter, text.data(), text.size(), nullptr), RELUME_OK);
  EXPECT_EQ(text.data(), glsl);
  ASSERT_EQ(relume_resolve_glsl(h.relighter, text.data(), 5, nullptr), RELUME_OK);
  EXPECT_EQ(std::string(text.data()), glsl.substr(0, 4));
}

TEST_F(CApi, plainMapsAreWhatReceiversRead) {
  Handles h;
  Relighter same = cpp();
  ASSERT_NO_FATAL_FAILURE(light(h, same));
  const Lightmap& lightmap = bake_.caches.lightmap;
  const std::size_t texels = lightmap.cache.size();
  std::vector<std::uint16_t> map(4 * texels), l1(16 * texels);
  ASSERT_EQ(relume_irradiance_map(h.relighter, map.data(), 8 * texels), RELUME_OK);
  ASSERT_EQ(relume_irradiance_map_l1(h.relighter, l1.data(), 32 * texels), RELUME_OK);
  int held = 0;
  for (std::size_t t = 0; t < texels; ++t) {
    const std::uint32_t cache = lightmap.cache[t];
    EXPECT_EQ(unpackHalf(map[4 * t + 3]), cache == kNoCache ? 0.0f : 1.0f);
    if (cache == kNoCache) continue;
    ++held;
    const glm::vec3 n = bake_.caches.normal[cache];
    const glm::vec2 uv((static_cast<float>(t % lightmap.width) + 0.5f) / static_cast<float>(lightmap.width),
                       (static_cast<float>(t / lightmap.width) + 0.5f) / static_cast<float>(lightmap.height));
    const glm::vec3 expected = same.irradianceOnLightmap(uv, n);
    for (std::size_t k = 0; k < 3; ++k) {
      const float e = expected[static_cast<int>(k)];
      EXPECT_NEAR(unpackHalf(map[4 * t + k]), e, 1e-3f * e + 1e-6f);
      float fitted = 0.0f;
      for (std::size_t layer = 0; layer < 4; ++layer) {
        const float c = unpackHalf(l1[4 * (layer * texels + t) + k]);
        fitted += layer == 0 ? c : c * n[static_cast<int>(layer) - 1];
      }
      EXPECT_NEAR(fitted, e, 4e-3f * e + 1e-5f) << "texel " << t;
    }
  }
  EXPECT_GT(held, 10);
}

TEST_F(CApi, ambientVolumesAreWhatTheGridGives) {
  Handles h;
  ASSERT_NO_FATAL_FAILURE(open(h));
  ASSERT_EQ(relume_relight(h.relighter, &setup_), RELUME_OK);
  const float origin[3] = {0.5f, 0.5f, 0.5f}, spacing[3] = {1.0f, 0.5f, 2.0f};
  const unsigned int resolution[3] = {3, 4, 2};
  std::vector<float> cubes(18 * 24);
  ASSERT_EQ(relume_ambient_volume(h.relighter, origin, spacing, resolution, cubes.data(), cubes.size() * sizeof(float)),
            RELUME_OK)
      << relume_relighter_error(h.relighter);
  // Point (2, 1, 1), normal -y.
  const float position[3] = {2.5f, 1.0f, 2.5f}, normal[3] = {0, -1, 0};
  float expected[3];
  ASSERT_EQ(relume_irradiance_in_grid(h.relighter, 1, position, normal, expected), RELUME_OK);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(cubes[18 * (2 + 3 * (1 + 4 * 1)) + 3 * 3 + k], expected[k]);
  const unsigned int huge[3] = {65536, 65536, 65536};
  EXPECT_EQ(relume_ambient_volume(h.relighter, origin, spacing, huge, cubes.data(), cubes.size() * sizeof(float)),
            RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_ambient_volume(h.relighter, origin, spacing, resolution, cubes.data(), 4), RELUME_ERROR_USAGE);
}

// An output that is a few bytes too small is not written past its end.
TEST_F(CApi, sizesOfOutputsAreExact) {
  Handles h;
  ASSERT_NO_FATAL_FAILURE(open(h));
  ASSERT_EQ(relume_relight(h.relighter, &setup_), RELUME_OK);
  const float origin[3] = {0.5f, 0.5f, 0.5f}, spacing[3] = {1.0f, 1.0f, 1.0f};
  const unsigned int resolution[3] = {2, 1, 1};
  std::vector<float> cubes(36, -1.0f);
  for (std::size_t bytes = 0; bytes < 2 * 144; ++bytes) {
    if (bytes == 144) continue;
    EXPECT_EQ(relume_ambient_volume(h.relighter, origin, spacing, resolution, cubes.data(), bytes), RELUME_ERROR_USAGE)
        << bytes;
  }
  EXPECT_EQ(cubes, std::vector<float>(36, -1.0f));
  ASSERT_EQ(relume_ambient_volume(h.relighter, origin, spacing, resolution, cubes.data(), 143), RELUME_ERROR_USAGE);
  EXPECT_NE(std::string(relume_relighter_error(h.relighter)).find("bytes is 143, expected 72 for each point"),
            std::string::npos)
      << relume_relighter_error(h.relighter);
  const std::size_t texels = bake_.caches.lightmap.cache.size();
  std::vector<std::uint16_t> map(4 * texels);
  for (const std::size_t less : {1u, 2u, 7u})
    EXPECT_EQ(relume_irradiance_map(h.relighter, map.data(), 8 * texels - less), RELUME_ERROR_USAGE) << less;
}

TEST_F(CApi, lightMapCoordinatesOfInstances) {
  Handles h;
  ASSERT_NO_FATAL_FAILURE(open(h));
  relume_bake_info info{};
  info.struct_size = sizeof info;
  ASSERT_EQ(relume_bake_get_info(h.bake, &info), RELUME_OK);
  EXPECT_EQ(info.surfels, bake_.surfels.count());
  EXPECT_EQ(info.caches, bake_.caches.count());
  EXPECT_EQ(std::string(info.scene_hash).size(), 16u);
  std::size_t all = 0;
  for (unsigned int i = 0; i < info.instances; ++i) {
    std::size_t corners = 0;
    ASSERT_EQ(relume_bake_lightmap_coordinates(h.bake, i, 0, nullptr, &corners), RELUME_OK);
    std::vector<float> uv(2 * corners + 1);
    ASSERT_EQ(relume_bake_lightmap_coordinates(h.bake, i, 0, uv.data(), &corners), RELUME_OK);
    for (std::size_t k = 0; k < corners; ++k) {
      const std::uint32_t packed = bake_.caches.lightmap.cornerUv[bake_.caches.lightmap.parts[i].firstCorner + k];
      EXPECT_EQ(uv[2 * k], packed == kGridLit ? -1.0f : unpackUnorm16x2(packed).x);
    }
    all += corners;
    EXPECT_EQ(relume_bake_instance_name(h.bake, i), bake_.instances[i].node);
  }
  EXPECT_EQ(all, bake_.caches.lightmap.cornerUv.size());
  std::size_t corners = 1u << 30;
  EXPECT_EQ(relume_bake_lightmap_coordinates(h.bake, info.instances, 0, nullptr, &corners), RELUME_ERROR_USAGE);
}

// Older hosts know fewer fields: what they do not have keeps its default.

}  // namespace
}  // namespace relume
