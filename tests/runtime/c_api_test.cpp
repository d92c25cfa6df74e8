// SPDX-License-Identifier: MIT
// relume.h says and does what relighter.h does, refuses what it should with a text, and allocates nothing in a frame.
#include "relume/relume.h"
#include "relume/relume_live.h"

#include "relume/relighter.h"
#include "tests/runtime/allocations.h"
#include "tests/runtime/c_api_fixture.h"
#include "tests/runtime/hot_reload.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace relume {
namespace {

using test::CApi;
using test::Handles;

TEST_F(CApi, lightIsTheCppApis) {
  Handles h;
  ASSERT_NO_FATAL_FAILURE(open(h));
  Relighter same = cpp();
  LightSetup setup;
  setup.lights = lights_;
  for (int frame = 0; frame < 3; ++frame) {
    ASSERT_EQ(relume_relight(h.relighter, &setup_), RELUME_OK) << relume_relighter_error(h.relighter);
    ASSERT_TRUE(same.relight(setup));
  }
  const std::vector<float> expected = same.cacheCoefficients();
  std::vector<float> found(expected.size());
  EXPECT_EQ(relume_coefficients_per_cache(h.relighter) * bake_.caches.count(), found.size());
  ASSERT_EQ(relume_cache_coefficients(h.relighter, found.data(), found.size() * sizeof(float)), RELUME_OK);
  EXPECT_EQ(found, expected);

  const std::vector<float> uvs = {0.1f, 0.2f, 0.7f, 0.4f}, normals = {0, 1, 0, 1, 0, 0}, positions = {1, 1, 1, 2, 1, 3};
  std::vector<float> onMap(6), inGrid(6);
  ASSERT_EQ(relume_irradiance_on_lightmap(h.relighter, 2, uvs.data(), normals.data(), nullptr, onMap.data()),
            RELUME_OK);
  ASSERT_EQ(relume_irradiance_in_grid(h.relighter, 2, positions.data(), normals.data(), inGrid.data()), RELUME_OK);
  const std::vector<float> exponents{4.0f, 16.0f};
  std::vector<float> glossyOnMap(6, -1.0f), glossyInGrid(6, -1.0f);
  ASSERT_EQ(relume_glossy_on_lightmap(h.relighter, 2, uvs.data(), normals.data(), exponents.data(), glossyOnMap.data()),
            RELUME_OK);
  ASSERT_EQ(relume_glossy_in_grid(h.relighter, 2, positions.data(), normals.data(), normals.data(), exponents.data(),
                                  glossyInGrid.data()),
            RELUME_OK);
  for (std::size_t i = 0; i < 2; ++i) {
    const glm::vec3 n(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]);
    const glm::vec3 map = same.irradianceOnLightmap({uvs[2 * i], uvs[2 * i + 1]}, n);
    const glm::vec3 place(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]);
    const glm::vec3 grid = same.irradianceInGrid(place, n);
    const glm::vec3 glossyMap = same.glossyOnLightmap({uvs[2 * i], uvs[2 * i + 1]}, n, exponents[i]),
                    glossyGrid = same.glossyInGrid(place, n, n, exponents[i]);
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(onMap[3 * i + static_cast<std::size_t>(k)], map[k]);
      EXPECT_EQ(inGrid[3 * i + static_cast<std::size_t>(k)], grid[k]);
      EXPECT_EQ(glossyOnMap[3 * i + static_cast<std::size_t>(k)], glossyMap[k]);
      EXPECT_EQ(glossyInGrid[3 * i + static_cast<std::size_t>(k)], glossyGrid[k]);
    }
  }
}

TEST_F(CApi, gridTextureIsTheCppApis) {
  Handles h;
  ASSERT_NO_FATAL_FAILURE(open(h));
  const std::vector<float> normals = {0, 1, 0, 1, 0, 0}, positions = {1, 1, 1, 2, 1, 3};
  std::vector<float> found(6), stencil(6);
  relume_grid_texture_info info{};
  info.struct_size = sizeof info;
  // Not asked for: there is none, and all look-ups read the caches around.
  ASSERT_EQ(relume_relight(h.relighter, &setup_), RELUME_OK);
  ASSERT_EQ(relume_grid_texture_get_info(h.relighter, &info), RELUME_OK);
  EXPECT_EQ(info.resolution[0], 0u);
  ASSERT_EQ(relume_irradiance_in_grid(h.relighter, 2, positions.data(), normals.data(), stencil.data()), RELUME_OK);
  ASSERT_EQ(
      relume_irradiance_in_grid_by(h.relighter, RELUME_GRID_SMOOTH, 2, positions.data(), normals.data(), found.data()),
      RELUME_OK);
  EXPECT_EQ(found, stencil);

  relume_relighter_desc desc{};
  desc.struct_size = sizeof desc;
  desc.grid_texture = 1;
  desc.grid_trust = 1.0f;
  relume_relighter* textured = nullptr;
  ASSERT_EQ(relume_relighter_create(h.bake, &desc, &textured), RELUME_OK) << relume_bake_error(h.bake);
  RelightOptions options;
  options.gridTexture = true;
  options.gridTrust = 1.0f;
  Result<Relighter> same = Relighter::create(bake_, options);
  ASSERT_TRUE(same);
  LightSetup setup;
  setup.lights = lights_;
  ASSERT_EQ(relume_relight(textured, &setup_), RELUME_OK);
  ASSERT_TRUE(same->relight(setup));
  ASSERT_EQ(relume_grid_texture_get_info(textured, &info), RELUME_OK);
  const GridTextureInfo expected = same->gridTexture();
  EXPECT_GT(info.resolution[0], 1u);
  EXPECT_EQ(glm::uvec3(info.resolution[0], info.resolution[1], info.resolution[2]), expected.resolution);
  EXPECT_EQ(info.cells, expected.cells);
  EXPECT_EQ(info.open_cells, expected.openCells);
  for (const auto& [c, cpp] :
       {std::pair(RELUME_GRID_STENCIL, GridLookup::stencil), std::pair(RELUME_GRID_TEXTURE, GridLookup::texture),
        std::pair(RELUME_GRID_SMOOTH, GridLookup::smooth)}) {
    ASSERT_EQ(relume_irradiance_in_grid_by(textured, c, 2, positions.data(), normals.data(), found.data()), RELUME_OK);
    for (std::size_t i = 0; i < 2; ++i) {
      const glm::vec3 e = same->irradianceInGrid({positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]},
                                                 {normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]}, cpp);
      for (int k = 0; k < 3; ++k) EXPECT_EQ(found[3 * i + static_cast<std::size_t>(k)], e[k]);
    }
  }
  EXPECT_EQ(relume_irradiance_in_grid_by(textured, static_cast<relume_grid_lookup>(3), 2, positions.data(),
                                         normals.data(), found.data()),
            RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_grid_texture_get_info(textured, nullptr), RELUME_ERROR_USAGE);
  relume_relighter_destroy(textured);
  desc.grid_trust = 1.5f;
  EXPECT_EQ(relume_relighter_create(h.bake, &desc, &textured), RELUME_ERROR_USAGE);
  EXPECT_NE(std::string(relume_bake_error(h.bake)).find("gridTrust is 1.5"), std::string::npos);
}

TEST_F(CApi, visibilityInBatchesIsVisibilityOneByOne) {
  Handles h;
  ASSERT_NO_FATAL_FAILURE(open(h));
  setup_.visibility = [](void* calls, unsigned int light, unsigned int count, const float* positions,
                         const float* normals, float* visible) {
    ++*static_cast<int*>(calls);
    EXPECT_GT(count, 0u);
    EXPECT_LE(count, 256u);
    for (unsigned int i = 0; i < count; ++i) {
      EXPECT_EQ(visible[i], 0.0f);
      EXPECT_NEAR(normals[3 * i] * normals[3 * i] + normals[3 * i + 1] * normals[3 * i + 1] +
                      normals[3 * i + 2] * normals[3 * i + 2],
                  1.0f, 1e-3f);
      visible[i] = light == 1 ? 0.0f : (positions[3 * i] < 1.5f ? 1.0f : 0.25f);
    }
  };
  int calls = 0;
  setup_.visibility_user = &calls;
  Relighter same = cpp();
  LightSetup setup;
  setup.lights = lights_;
  setup.visibility = [](std::uint32_t light, const glm::vec3& position, const glm::vec3&) {
    return light == 1 ? 0.0f : (position.x < 1.5f ? 1.0f : 0.25f);
  };
  for (int frame = 0; frame < 2; ++frame) {
    ASSERT_EQ(relume_relight(h.relighter, &setup_), RELUME_OK);
    ASSERT_TRUE(same.relight(setup));
  }
  EXPECT_GT(calls, 0);
  const std::vector<float> expected = same.cacheCoefficients();
  std::vector<float> found(expected.size());
  ASSERT_EQ(relume_cache_coefficients(h.relighter, found.data(), found.size() * sizeof(float)), RELUME_OK);
  EXPECT_EQ(found, expected);
}

TEST_F(CApi, hostsThreadsGiveTheSameLight) {
  Handles one, several;
  ASSERT_NO_FATAL_FAILURE(open(one));
  ASSERT_NO_FATAL_FAILURE(open(several, test::runInTwo));
  std::vector<std::vector<std::uint16_t>> maps;
  for (Handles* h : {&one, &several}) {
    ASSERT_EQ(relume_relight(h->relighter, &setup_), RELUME_OK);
    relume_bake_info info{};
    info.struct_size = sizeof info;
    ASSERT_EQ(relume_bake_get_info(h->bake, &info), RELUME_OK);
    std::vector<std::uint16_t> map(4 * info.lightmap_width * info.lightmap_height);
    ASSERT_EQ(relume_irradiance_map(h->relighter, map.data(), map.size() * 2), RELUME_OK);
    maps.push_back(map);
  }
  EXPECT_EQ(maps[0], maps[1]);
}

TEST_F(CApi, smallerStructsKeepDefaults) {
  Handles h, whole;
  ASSERT_NO_FATAL_FAILURE(open(h));
  ASSERT_NO_FATAL_FAILURE(open(whole));
  relume_light_setup small = setup_;
  small.struct_size = offsetof(relume_light_setup, visibility);
  small.bounce_scale = -7.0f;  // unseen
  std::vector<std::vector<float>> light;
  for (const auto& [handles, setup] : {std::pair{&h, &small}, {&whole, &setup_}}) {
    ASSERT_EQ(relume_relight(handles->relighter, setup), RELUME_OK) << relume_relighter_error(handles->relighter);
    light.emplace_back(relume_coefficients_per_cache(handles->relighter) * bake_.caches.count());
    ASSERT_EQ(relume_cache_coefficients(handles->relighter, light.back().data(), light.back().size() * sizeof(float)),
              RELUME_OK);
  }
  EXPECT_EQ(light[0], light[1]);
}

TEST_F(CApi, refusesAndSaysWhy) {
  std::string log;
  relume_context_desc desc{};
  desc.struct_size = sizeof desc;
  desc.api_version = RELUME_API_VERSION + 1;
  desc.user = &log;
  desc.log = [](void* user, relume_severity severity, const char* text) {
    EXPECT_EQ(severity, RELUME_ERROR);
    *static_cast<std::string*>(user) = text;
  };
  Handles h;
  EXPECT_EQ(relume_context_create(&desc, &h.context), RELUME_ERROR_USAGE);
  EXPECT_EQ(h.context, nullptr);
  const std::string own = std::to_string(RELUME_API_VERSION), other = std::to_string(RELUME_API_VERSION + 1);
  EXPECT_NE(log.find("api_version is " + other + ", this library's is " + own + ":"), std::string::npos) << log;
  desc.api_version = RELUME_API_VERSION;
  ASSERT_EQ(relume_context_create(&desc, &h.context), RELUME_OK);
  EXPECT_STREQ(relume_context_error(h.context), "");

  EXPECT_EQ(relume_bake_load(h.context, "/nowhere/at/all.relume", &h.bake), RELUME_ERROR_IO);
  EXPECT_NE(std::string(relume_context_error(h.context)).find("/nowhere/at/all.relume"), std::string::npos);
  EXPECT_EQ(log, relume_context_error(h.context));
  EXPECT_EQ(relume_bake_load(h.context, nullptr, &h.bake), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_bake_load(nullptr, "x", &h.bake), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_bake_from_memory(h.context, "no bake", 8, nullptr, nullptr, nullptr), RELUME_ERROR_USAGE);

  int released = 0;
  const auto release = [](void* count) { ++*static_cast<int*>(count); };
  std::vector<std::byte> broken = bytes_;
  broken[broken.size() / 2] ^= std::byte{1};
  EXPECT_EQ(relume_bake_from_memory(h.context, broken.data(), broken.size(), release, &released, &h.bake),
            RELUME_ERROR_INVALID_FILE);
  EXPECT_EQ(released, 1);
  EXPECT_EQ(relume_bake_from_memory(nullptr, broken.data(), broken.size(), release, &released, &h.bake),
            RELUME_ERROR_USAGE);
  EXPECT_EQ(released, 2);
  ASSERT_EQ(relume_bake_from_memory(h.context, bytes_.data(), bytes_.size(), release, &released, &h.bake), RELUME_OK);

  relume_relighter_desc options{};
  options.struct_size = sizeof options;
  options.luma_bands = 9;
  EXPECT_EQ(relume_relighter_create(h.bake, &options, &h.relighter), RELUME_ERROR_USAGE);
  EXPECT_NE(std::string(relume_bake_error(h.bake)).find("lumaBands is 9"), std::string::npos);
  options.luma_bands = 0;
  const int none = 7;  // no enumerator's, as C may hand over
  std::memcpy(&options.backend, &none, sizeof none);
  EXPECT_EQ(relume_relighter_create(h.bake, &options, &h.relighter), RELUME_ERROR_USAGE);
  EXPECT_STREQ(relume_bake_error(h.bake), "desc.backend is 7, expected CPU 0 or GL 1");
  options.backend = RELUME_BACKEND_CPU;
  const relume_driven_image images[2] = {{"screen", 1, 1}, {nullptr, 1, 1}};
  options.driven_images = images;
  options.driven_image_count = 2;
  EXPECT_EQ(relume_relighter_create(h.bake, &options, &h.relighter), RELUME_ERROR_USAGE);
  EXPECT_STREQ(relume_bake_error(h.bake), "desc.driven_images[1].material is null");
  options.driven_image_count = 0;
  ASSERT_EQ(relume_relighter_create(h.bake, &options, &h.relighter), RELUME_OK);

  // The relighter lives on without its bake and context; the bytes are released with the last of them.
  relume_context_destroy(std::exchange(h.context, nullptr));
  relume_bake_destroy(std::exchange(h.bake, nullptr));
  EXPECT_EQ(released, 2);
  ASSERT_EQ(relume_relight(h.relighter, &setup_), RELUME_OK);
  cLights_[0].intensity[1] = -1.0f;
  EXPECT_EQ(relume_relight(h.relighter, &setup_), RELUME_ERROR_USAGE);
  EXPECT_NE(std::string(relume_relighter_error(h.relighter)).find("lights[0].intensity"), std::string::npos);
  std::memcpy(&cLights_[0].kind, &none, sizeof none);
  EXPECT_EQ(relume_relight(h.relighter, &setup_), RELUME_ERROR_USAGE);
  EXPECT_NE(std::string(relume_relighter_error(h.relighter)).find("lights[0].kind is 7"), std::string::npos);
  cLights_[0] = test::cLights(lights_)[0];
  relume_material_emission emissions[2] = {};
  emissions[1].texel_count = 4;
  setup_.material_emissions = emissions;
  setup_.material_emission_count = 2;
  EXPECT_EQ(relume_relight(h.relighter, &setup_), RELUME_ERROR_USAGE);
  EXPECT_STREQ(relume_relighter_error(h.relighter), "setup.material_emissions[1].image is null");
  float out[3];
  EXPECT_EQ(relume_irradiance_map(h.relighter, out, sizeof out), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_irradiance_in_grid(h.relighter, 1, nullptr, out, out), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_glossy_on_lightmap(h.relighter, 1, out, out, nullptr, out), RELUME_ERROR_USAGE);
  EXPECT_NE(std::string(relume_relighter_error(h.relighter)).find("exponents"), std::string::npos);
  EXPECT_EQ(relume_glossy_in_grid(h.relighter, 1, out, out, nullptr, out, out), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_glossy_in_grid(h.relighter, 0, nullptr, nullptr, nullptr, nullptr, nullptr), RELUME_OK);
  EXPECT_EQ(relume_gl_bind_resolve(h.relighter), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_gl_resolve_glsl(h.relighter), nullptr);
  relume_relighter_destroy(std::exchange(h.relighter, nullptr));
  EXPECT_EQ(released, 3);
}

// A host in C++ may throw in its callbacks, on any of its threads: a status comes of it.
TEST_F(CApi, noExceptionCrosses) {
  setup_.visibility = [](void*, unsigned int, unsigned int, const float*, const float*, float*) {
    throw std::runtime_error("no shadows today");
  };
  for (const relume_parallel_for threads : {relume_parallel_for{}, relume_parallel_for{test::runInTwo}}) {
    relume_context_desc desc{};
    desc.struct_size = sizeof desc;
    desc.api_version = RELUME_API_VERSION;
    desc.log = [](void*, relume_severity, const char*) { throw 1; };
    desc.parallel_for = threads;
    Handles h;
    ASSERT_EQ(relume_context_create(&desc, &h.context), RELUME_OK);
    EXPECT_EQ(relume_bake_load(h.context, "/nowhere.relume", &h.bake), RELUME_ERROR_IO);
    ASSERT_EQ(relume_bake_from_memory(h.context, bytes_.data(), bytes_.size(), nullptr, nullptr, &h.bake), RELUME_OK);
    ASSERT_EQ(relume_relighter_create(h.bake, nullptr, &h.relighter), RELUME_OK);
    EXPECT_EQ(relume_relight(h.relighter, &setup_), RELUME_ERROR_FAILED);
    EXPECT_STREQ(relume_relighter_error(h.relighter), "no shadows today");
  }
}

// Also where the handle to make it with is the null of a failure before.
TEST_F(CApi, handlesAreNullAfterEveryFailure) {
  const auto stale = [](auto*& handle) {
    handle = reinterpret_cast<std::remove_reference_t<decltype(handle)>>(&handle);
  };
  relume_bake *loaded, *read;
  relume_relighter* relighter;
  relume_live* live;
  relume_edit_blend* blend;
  relume_moving_shapes* shapes;
  stale(loaded), stale(read), stale(relighter), stale(live), stale(blend), stale(shapes);
  bool released = false;
  const auto release = [](void* user) { *static_cast<bool*>(user) = true; };
  EXPECT_EQ(relume_bake_load(nullptr, "level.relume", &loaded), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_bake_from_memory(nullptr, bytes_.data(), bytes_.size(), release, &released, &read),
            RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_relighter_create(nullptr, nullptr, &relighter), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_live_create(nullptr, nullptr, &live), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_edit_blend_create(nullptr, nullptr, &blend), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_moving_shapes_create(nullptr, nullptr, 0, &shapes), RELUME_ERROR_USAGE);
  EXPECT_EQ(loaded, nullptr);
  EXPECT_EQ(read, nullptr);
  EXPECT_TRUE(released);
  EXPECT_EQ(relighter, nullptr);
  EXPECT_EQ(live, nullptr);
  EXPECT_EQ(blend, nullptr);
  EXPECT_EQ(shapes, nullptr);

  Handles h;
  ASSERT_NO_FATAL_FAILURE(open(h));
  released = false;
  EXPECT_EQ(relume_bake_from_memory(h.context, bytes_.data(), bytes_.size(), release, &released, nullptr),
            RELUME_ERROR_USAGE);
  EXPECT_TRUE(released);
  EXPECT_STREQ(relume_context_error(h.context), "bake is null");
}

TEST_F(CApi, skyDirectionsAreTheBakes) {
  Handles h;
  ASSERT_NO_FATAL_FAILURE(open(h));
  const auto& patches = bake_.hierarchy.skyDirection;
  ASSERT_GT(patches.size(), 0u);
  std::vector<float> directions(3 * patches.size());
  ASSERT_EQ(relume_bake_sky_directions(h.bake, directions.data()), RELUME_OK);
  for (std::size_t i = 0; i < patches.size(); ++i)
    EXPECT_EQ(glm::vec3(directions[3 * i], directions[3 * i + 1], directions[3 * i + 2]), patches[i]);
  EXPECT_EQ(relume_bake_sky_directions(h.bake, nullptr), RELUME_ERROR_USAGE);
}

TEST_F(CApi, aFrameAllocatesNothing) {
  if (!test::countsAllocations()) GTEST_SKIP() << "sanitizers count no allocations";
  Handles h;
  ASSERT_NO_FATAL_FAILURE(open(h, [](void*, unsigned int tasks, relume_task task, void* data) {
    for (unsigned int i = 0; i < tasks; ++i) task(data, i);
  }));
  setup_.visibility = [](void*, unsigned int, unsigned int count, const float*, const float*, float* visible) {
    for (unsigned int i = 0; i < count; ++i) visible[i] = 0.5f;
  };
  std::vector<float> sky(3 * bake_.hierarchy.skyDirection.size(), 0.2f), uv = {0.3f, 0.3f}, n = {0, 1, 0}, e(3);
  setup_.sky_patches = sky.empty() ? nullptr : sky.data();
  std::vector<std::uint16_t> map(4 * bake_.caches.lightmap.cache.size());
  const auto frame = [&] {
    EXPECT_EQ(relume_relight(h.relighter, &setup_), RELUME_OK);
    EXPECT_EQ(relume_irradiance_on_lightmap(h.relighter, 1, uv.data(), n.data(), nullptr, e.data()), RELUME_OK);
    EXPECT_EQ(relume_irradiance_in_grid(h.relighter, 1, n.data(), n.data(), e.data()), RELUME_OK);
    EXPECT_EQ(relume_irradiance_map(h.relighter, map.data(), 2 * map.size()), RELUME_OK);
  };
  frame();  // scratch memory grows to the number of lights once
  const std::size_t before = test::allocations();
  for (int i = 0; i < 5; ++i) frame();
  EXPECT_EQ(test::allocations(), before);
}

TEST(HotReload, handsTheLightOver) { test::expectLightIsHandedOver(BackendKind::cpu); }

TEST_F(CApi, hotReloadHandsTheLightOver) {
  Handles old, fresh, heir;
  for (Handles* h : {&old, &fresh, &heir}) ASSERT_NO_FATAL_FAILURE(open(*h));
  for (int frame = 0; frame < 16; ++frame) ASSERT_EQ(relume_relight(old.relighter, &setup_), RELUME_OK);
  ASSERT_EQ(relume_inherit(heir.relighter, heir.bake, old.relighter), RELUME_OK);
  std::vector<double> totals;
  for (Handles* h : {&old, &fresh, &heir}) {
    ASSERT_EQ(relume_relight(h->relighter, &setup_), RELUME_OK);
    std::vector<float> all(relume_coefficients_per_cache(h->relighter) * bake_.caches.count());
    ASSERT_EQ(relume_cache_coefficients(h->relighter, all.data(), all.size() * sizeof(float)), RELUME_OK);
    double total = 0.0;
    for (std::size_t i = 0; i < all.size(); i += relume_coefficients_per_cache(h->relighter)) total += all[i];
    totals.push_back(total);
  }
  EXPECT_LT(std::abs(totals[2] - totals[0]), 0.35 * std::abs(totals[1] - totals[0]));
  EXPECT_EQ(relume_inherit(heir.relighter, nullptr, old.relighter), RELUME_ERROR_USAGE);
}

}  // namespace
}  // namespace relume
