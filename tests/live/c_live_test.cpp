// SPDX-License-Identifier: MIT
// relume_live_... of relume_live.h say and do what live_light.h does, and refuse what they should with a text.
#include "relume/live_light.h"
#include "relume/relume_live.h"

#include "tests/runtime/allocations.h"
#include "tests/runtime/c_handles.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/voxels/boxes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

namespace relume {
namespace {

using test::VoxelLevel;

class CLive : public test::GlTest {
 protected:
  void SetUp() override {
    GlTest::SetUp();
    relume_context_desc describe{};
    describe.struct_size = sizeof describe;
    describe.api_version = RELUME_API_VERSION;
    ASSERT_EQ(relume_context_create(&describe, &host_), RELUME_OK);
    level_.surfaces = {{glm::vec3(0.6f, 0.5f, 0.4f)}, {glm::vec3(0.5f), glm::vec3(2.0f, 1.0f, 0.5f), 1.0f, true}};
    level_.addBox({0, 0, 0}, {5, 3, 4}, true);
    level_.addBox({2, 0, 1}, {2.2f, 3, 3}, false);
    level_.addBox({-0.3f, -0.3f, -0.3f}, {0.3f, 0.3f, 0.3f}, false, 1);
    level_.parts.back().moves = true;
    level_.parts.back().toWorld[3] = {1, 1, 1};
    for (const VoxelSurface& s : level_.surfaces)
      surfaces_.push_back({{s.albedo.x, s.albedo.y, s.albedo.z},
                           {s.emission.x, s.emission.y, s.emission.z},
                           s.coverage,
                           s.doubleSided ? 1 : 0});
    for (const VoxelLevel::Mesh& m : level_.meshes)
      meshes_.push_back({&m.position[0].x, m.position.size(), &m.triangle[0].x, m.triangle.size(), m.surface.data()});
    for (const VoxelPart& p : level_.parts) {
      relume_live_part part{p.mesh, {}, p.moves ? 1 : 0};
      std::memcpy(part.to_world, &p.toWorld[0].x, sizeof part.to_world);
      parts_.push_back(part);
    }
    desc_.struct_size = sizeof desc_;
    desc_.surfaces = surfaces_.data();
    desc_.surface_count = surfaces_.size();
    desc_.meshes = meshes_.data();
    desc_.mesh_count = meshes_.size();
    desc_.parts = parts_.data();
    desc_.part_count = parts_.size();
    desc_.cells = 16;
    relume_light_setup_default(&setup_, sizeof setup_);
    lamp_.kind = RELUME_POINT;
    const float position[] = {4, 2, 2}, intensity[] = {5, 6, 7};
    std::copy_n(position, 3, lamp_.position);
    std::copy_n(intensity, 3, lamp_.intensity);
    setup_.lights = &lamp_;
    setup_.light_count = 1;
    setup_.visibility = [](void*, unsigned int, unsigned int count, const float* at, const float*, float* visible) {
      for (unsigned int i = 0; i < count; ++i) visible[i] = at[3 * i] > 2.1f ? 1.0f : 0.0f;
    };
  }
  void TearDown() override {
    relume_context_destroy(host_);
    GlTest::TearDown();
  }
  // The text is that of `live`, or of the context.
  void expectRefused(relume_status status, const char* what, const relume_live* live = nullptr) {
    EXPECT_EQ(status, RELUME_ERROR_USAGE);
    const std::string text = live != nullptr ? relume_live_error(live) : relume_context_error(host_);
    EXPECT_NE(text.find(what), std::string::npos) << text;
  }

  VoxelLevel level_;
  std::vector<relume_live_surface> surfaces_;
  std::vector<relume_live_mesh> meshes_;
  std::vector<relume_live_part> parts_;
  relume_context* host_ = nullptr;
  relume_live_desc desc_{};
  relume_light_setup setup_{};
  relume_light lamp_{};
};

TEST_F(CLive, volumesFollowTheEye) {
  const float eye[3] = {1, 1, 2}, there[3] = {5, 1, 2}, nowhere[3] = {0, std::numeric_limits<float>::quiet_NaN(), 0};
  desc_.get_proc_address = [](void*, const char* name) -> relume_gl_proc { return EglContext::getProcAddress(name); };
  desc_.cascades = 2;
  desc_.eye = eye;
  relume_live* live = nullptr;
  for (const relume_backend backend : {RELUME_BACKEND_CPU, RELUME_BACKEND_GL}) {
    desc_.backend = backend;
    ASSERT_EQ(relume_live_create(host_, &desc_, &live), RELUME_OK) << relume_context_error(host_);
    ASSERT_EQ(relume_live_update(live, &setup_, nullptr), RELUME_OK) << relume_live_error(live);
    int moved = 7;
    EXPECT_EQ(relume_live_centre(live, eye, &moved), RELUME_OK);
    EXPECT_EQ(moved, 0);
    EXPECT_EQ(relume_live_centre(live, there, &moved), RELUME_OK);
    EXPECT_EQ(moved, 1);
    EXPECT_EQ(relume_live_centre(live, eye, nullptr), RELUME_OK);
    expectRefused(relume_live_centre(live, nowhere, &moved), "the eye has a coordinate beyond 1e+09 m", live);
    expectRefused(relume_live_centre(live, nullptr, &moved), "eye", live);
    relume_live_destroy(live);
  }
  desc_.cascades = 5;
  expectRefused(relume_live_create(host_, &desc_, &live), "5 cascades");
}

TEST_F(CLive, lightIsTheCppApis) {
  for (const relume_backend backend : {RELUME_BACKEND_CPU, RELUME_BACKEND_GL}) {
    const bool onGl = backend == RELUME_BACKEND_GL;
    desc_.backend = backend;
    desc_.visibility_glsl =
        onGl ? "float relumeVisibility(uint l, vec3 p, vec3 n) { return p.x > 2.1 ? 1.0 : 0.0; }\n" : nullptr;
    desc_.get_proc_address = [](void*, const char* name) -> relume_gl_proc { return EglContext::getProcAddress(name); };
    relume_live* live = nullptr;
    ASSERT_EQ(relume_live_create(host_, &desc_, &live), RELUME_OK) << relume_context_error(host_);
    LiveLightOptions options;
    options.cells = 16;
    if (onGl) {
      options.backend = BackendKind::gl;
      options.visibilityGlsl = desc_.visibility_glsl;
      options.getProcAddress = EglContext::getProcAddress;
    }
    auto same = LiveLight::create(level_.geometry(), options);
    ASSERT_TRUE(same);
    Light lamp;
    lamp.positionWorld = {4, 2, 2};
    lamp.intensity = {5, 6, 7};
    LightSetup setup;
    setup.lights = {&lamp, 1};
    setup.visibility = [](std::uint32_t, const glm::vec3& p, const glm::vec3&) { return p.x > 2.1f ? 1.0f : 0.0f; };
    const float sky[3] = {1, 1, 1};
    relume_live_frame sideless;
    relume_live_frame_default(&sideless, sizeof sideless);
    sideless.sky_map = sky;
    EXPECT_EQ(relume_live_update(live, &setup_, &sideless), RELUME_ERROR_USAGE);
    EXPECT_NE(std::string(relume_live_error(live)).find("sky_side"), std::string::npos);
    for (unsigned int f = 0; f < 4; ++f) {
      relume_live_frame frame;
      relume_live_frame_default(&frame, sizeof frame);
      frame.ray_set = f;
      frame.keep = f > 1 ? 0.5f : 0.0f;
      frame.sky_radiance[1] = 0.25f;
      LiveFrame expected;
      expected.raySet = f;
      expected.keep = frame.keep;
      expected.sky.radiance.y = 0.25f;
      if (f == 2) {
        const float to[12] = {1, 0, 0, 0, 1, 0, 0, 0, 1, 3, 0.5f, 3};
        ASSERT_EQ(relume_live_move(live, to, 1), RELUME_OK);
        const relume_live_edit gone{1, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}, 0};
        ASSERT_EQ(relume_live_edit_parts(live, &gone, 1), RELUME_OK) << relume_live_error(live);
        glm::mat4x3 moved(1.0f);
        moved[3] = {3, 0.5f, 3};
        ASSERT_TRUE(same->move({&moved, 1}));
        ASSERT_TRUE(same->edit(std::vector<PartEdit>{{1, glm::mat4x3(1.0f), false}}));
      }
      ASSERT_EQ(relume_live_update(live, &setup_, &frame), RELUME_OK) << relume_live_error(live);
      ASSERT_TRUE(same->update(setup, expected));
    }
    const float at[6] = {1, 0, 2, 4.5f, 1, 0}, normals[6] = {0, 1, 0, 0, 0, 1};
    float found[6] = {};
    ASSERT_EQ(relume_live_irradiance(live, 2, at, normals, found), RELUME_OK);
    for (std::size_t i = 0; i < 2; ++i) {
      const glm::vec3 e = same->irradiance({at[3 * i], at[3 * i + 1], at[3 * i + 2]},
                                           {normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]});
      EXPECT_GT(e.y, 0.01f);
      for (glm::length_t k = 0; k < 3; ++k) EXPECT_EQ(found[3 * i + static_cast<std::size_t>(k)], e[k]);
    }
    relume_live_info info{};
    info.struct_size = sizeof info;
    ASSERT_EQ(relume_live_get_info(live, &info), RELUME_OK);
    EXPECT_EQ(info.voxels, same->voxels().occupied);
    EXPECT_EQ(info.caches, same->caches());
    EXPECT_EQ(relume_live_gl_glsl(live) != nullptr, onGl);
    EXPECT_EQ(relume_live_gl_direct_program(live) != 0, onGl);
    expectRefused(relume_live_gl_bind(live, 0), onGl ? "program 0 is not a linked program" : "RELUME_BACKEND_GL", live);
    ASSERT_EQ(relume_live_reset(live), RELUME_OK);
    ASSERT_EQ(relume_live_irradiance(live, 2, at, normals, found), RELUME_OK);
    EXPECT_EQ(*std::max_element(found, found + 6), 0.0f);
    relume_live_destroy(live);
  }
}

// Two lights of names and units of their own, bound at once.
// Voxels are made by tasks on the host's threads, where there may be no memory either.
TEST_F(CLive, memoryMayRunOutOnTheHostsThreads) {
  if (!test::countsAllocations()) GTEST_SKIP() << "the sanitizer's operator new";
  relume_context_desc describe{};
  describe.struct_size = sizeof describe;
  describe.api_version = RELUME_API_VERSION;
  describe.parallel_for = test::runInTwo;
  relume_context* host = nullptr;
  ASSERT_EQ(relume_context_create(&describe, &host), RELUME_OK);
  relume_live* live = nullptr;
  const std::size_t before = test::allocations();
  ASSERT_EQ(relume_live_create(host, &desc_, &live), RELUME_OK) << relume_context_error(host);
  const std::size_t taken = test::allocations() - before;
  relume_live_destroy(live);
  ASSERT_GT(taken, 60u);
  for (std::size_t n = 1; n < taken / 2; n += taken / 60) {
    test::refuseAllocation(n);
    const relume_status status = relume_live_create(host, &desc_, &live);
    EXPECT_TRUE(test::refuseAllocation(0)) << n;
    EXPECT_EQ(status, RELUME_ERROR_MEMORY) << n << " of " << taken;
    EXPECT_EQ(live, nullptr);
    relume_live_destroy(live);
  }
  EXPECT_EQ(relume_live_create(host, &desc_, &live), RELUME_OK) << relume_context_error(host);
  relume_live_destroy(live);
  relume_context_destroy(host);
}

TEST_F(CLive, namesAndTextureUnitsAreTheHosts) {
  desc_.backend = RELUME_BACKEND_GL;
  desc_.get_proc_address = [](void*, const char* name) -> relume_gl_proc { return EglContext::getProcAddress(name); };
  const unsigned int units[2][3] = {{19, 20, 21}, {24, 23, 22}};
  relume_live *lights[2] = {}, *third = nullptr;
  desc_.gl_prefix = "relumeThird";
  desc_.gl_texture_units = units[0];
  ASSERT_EQ(relume_live_create(host_, &desc_, &third), RELUME_OK) << relume_context_error(host_);
  for (std::size_t i = 0; i < 2; ++i) {
    desc_.gl_prefix = i == 0 ? "relumeBefore" : nullptr;
    desc_.gl_texture_units = units[i];
    ASSERT_EQ(relume_live_create(host_, &desc_, &lights[i]), RELUME_OK) << relume_context_error(host_);
    ASSERT_EQ(relume_live_update(lights[i], &setup_, nullptr), RELUME_OK) << relume_live_error(lights[i]);
    const std::string glsl = relume_live_gl_glsl(lights[i]);
    EXPECT_EQ(glsl.find("vec3 relumeBeforeIrradiance(") != std::string::npos, i == 0);
    EXPECT_EQ(glsl.find("relumeLive") == std::string::npos, i == 0);
  }
  const std::vector<float> found = test::runCompute(
      std::string(relume_live_gl_glsl(lights[0])) + relume_live_gl_glsl(lights[1]),
      "vec3 p = vec3(inData[0], inData[1], inData[2]), n = vec3(0.0, 1.0, 0.0);\n"
      "outData[0] = relumeBeforeIrradiance(p, n).r; outData[1] = relumeLiveIrradiance(p, n).r;\n",
      {1, 0, 2}, 1, 2, [&](unsigned int program) {
        for (const relume_live* light : lights) ASSERT_EQ(relume_live_gl_bind(light, program), RELUME_OK);
        expectRefused(relume_live_gl_bind(third, program),
                      "relumeBeforeCells has texture unit 19, which is that of relumeThirdCells", third);
      });
  EXPECT_GT(found[0], 0.0f);
  EXPECT_EQ(found[0], found[1]);
  for (relume_live* light : {lights[0], lights[1], third}) relume_live_destroy(light);
  desc_.gl_prefix = "gl_Live";
  expectRefused(relume_live_create(host_, &desc_, &lights[0]), "gl_Live");
  const unsigned int twice[3] = {1, 2, 2};
  desc_.gl_prefix = nullptr;
  desc_.gl_texture_units = twice;
  expectRefused(relume_live_create(host_, &desc_, &lights[0]), "unit 2 twice");
}

TEST_F(CLive, whatIsRefusedHasAText) {
  relume_live* live = nullptr;
  const auto refused = [&](const char* what) {
    live = reinterpret_cast<relume_live*>(this);
    expectRefused(relume_live_create(host_, &desc_, &live), what);
    EXPECT_EQ(live, nullptr);
  };
  EXPECT_EQ(relume_live_create(nullptr, &desc_, &live), RELUME_ERROR_USAGE);
  desc_.cells = 5;
  refused("5 cells");
  desc_.cells = 16;
  meshes_[1].surfaces = nullptr;
  refused("meshes[1].surfaces");
  meshes_[1].surfaces = level_.meshes[1].surface.data();
  parts_[2].to_world[4] = std::numeric_limits<float>::quiet_NaN();
  refused("part 2");
  parts_[2].to_world[4] = 1.0f;
  desc_.struct_size = 3;
  refused("struct_size");
  desc_.struct_size = sizeof desc_;
  const int none = 7;  // no enumerator's, as C may hand over
  std::memcpy(&desc_.backend, &none, sizeof none);
  refused("desc.backend is 7");
  desc_.backend = RELUME_BACKEND_CPU;
  ASSERT_EQ(relume_live_create(host_, &desc_, &live), RELUME_OK) << relume_context_error(host_);
  std::memcpy(&lamp_.kind, &none, sizeof none);
  expectRefused(relume_live_update(live, &setup_, nullptr), "kind is 7", live);
  lamp_.kind = RELUME_POINT;
  EXPECT_EQ(relume_live_update(live, &setup_, nullptr), RELUME_OK);
  expectRefused(relume_live_move(live, nullptr, 1), "to_world", live);
  const relume_live_edit moving{2, {}, 1};
  expectRefused(relume_live_edit_parts(live, &moving, 1), "part 2", live);
  expectRefused(relume_live_irradiance(live, 1, nullptr, nullptr, nullptr), "positions", live);
  relume_live_destroy(live);
  relume_live_destroy(nullptr);
}

}  // namespace
}  // namespace relume
