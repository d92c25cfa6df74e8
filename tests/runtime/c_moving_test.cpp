// SPDX-License-Identifier: MIT
// Moving parts through relume.h: the C++ API's light, what is refused and by what text, structs of hosts that were
// built before there were any, and frames that take no memory.
#include "relume/relume.h"
#include "tests/runtime/allocations.h"
#include "tests/runtime/ball.h"
#include "tests/runtime/c_api_fixture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

namespace relume {
namespace {

class CMoving : public test::CApi {
 protected:
  void SetUp() override {
    CApi::SetUp();
    mesh_ = {
        &ball_.position[0].x, ball_.position.size(), &ball_.triangle[0].x, ball_.triangle.size(), grey_, 1, nullptr, 0};
    ASSERT_NO_FATAL_FAILURE(open(h_));
  }
  ~CMoving() override { relume_moving_shapes_destroy(shapes_); }

  void makeShapes() {
    ASSERT_EQ(relume_moving_shapes_create(h_.context, &mesh_, 1, &shapes_), RELUME_OK)
        << relume_context_error(h_.context);
  }
  void makeRelighter(unsigned int parts) {
    relume_relighter_destroy(h_.relighter);
    relume_relighter_desc desc{};
    desc.struct_size = sizeof desc;
    desc.moving_parts = parts;
    ASSERT_EQ(relume_relighter_create(h_.bake, &desc, &h_.relighter), RELUME_OK) << relume_bake_error(h_.bake);
  }
  static relume_moving_part at(float x, float y, float z) { return {0, {1, 0, 0, 0, 1, 0, 0, 0, 1, x, y, z}}; }
  std::vector<float> coefficients() const {
    std::vector<float> all(relume_coefficients_per_cache(h_.relighter) * bake_.caches.count());
    EXPECT_EQ(relume_cache_coefficients(h_.relighter, all.data(), all.size() * sizeof(float)), RELUME_OK);
    return all;
  }

  const test::Ball ball_{0.7f, 16};
  const float grey_[3] = {0.5f, 0.4f, 0.3f};
  relume_moving_mesh mesh_{};
  test::Handles h_;
  relume_moving_shapes* shapes_ = nullptr;
};

TEST_F(CMoving, lightIsTheCppApis) {
  ASSERT_NO_FATAL_FAILURE(makeShapes());
  ASSERT_NO_FATAL_FAILURE(makeRelighter(2));
  const relume_moving_part parts[2] = {at(6, 2, 3), at(2, 1, 1.5f)};
  setup_.moving_parts = parts;
  setup_.moving_part_count = 2;
  setup_.moving_shapes = shapes_;

  const glm::vec3 grey(0.5f, 0.4f, 0.3f);
  const MovingMesh mesh{ball_.position, ball_.triangle, {&grey, 1}};
  const Result<MovingShapes> shapes = MovingShapes::create({&mesh, 1});
  ASSERT_TRUE(shapes);
  RelightOptions options;
  options.movingParts = 2;
  Result<Relighter> same = Relighter::create(bake_, options);
  ASSERT_TRUE(same);
  std::vector<MovingPart> placed(2);
  placed[0].toWorld[3] = {6, 2, 3};
  placed[1].toWorld[3] = {2, 1, 1.5f};
  LightSetup frame;
  frame.lights = lights_;
  frame.movingShapes = &*shapes;
  frame.movingParts = placed;
  std::size_t before = 0;
  for (int i = 0; i < 4; ++i) {
    ASSERT_EQ(relume_relight(h_.relighter, &setup_), RELUME_OK) << relume_relighter_error(h_.relighter);
    if (i == 0) before = test::allocations();
  }
  EXPECT_EQ(test::allocations(), before);
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(same->relight(frame));
  const std::vector<float> with = coefficients();
  EXPECT_EQ(with, same->cacheCoefficients());

  // A host of an older header, whose struct ends before them: without.
  ASSERT_EQ(relume_reset(h_.relighter), RELUME_OK);
  setup_.struct_size = offsetof(relume_light_setup, moving_parts);
  for (int i = 0; i < 4; ++i) ASSERT_EQ(relume_relight(h_.relighter, &setup_), RELUME_OK);
  same->reset();
  frame.movingParts = {};
  for (int i = 0; i < 4; ++i) ASSERT_TRUE(same->relight(frame));
  EXPECT_EQ(coefficients(), same->cacheCoefficients());
  EXPECT_NE(coefficients(), with);
  EXPECT_EQ(relume_gl_moving_program(h_.relighter), 0u);
  EXPECT_EQ(relume_gl_moving_program(nullptr), 0u);
}

TEST_F(CMoving, refusesFramesAndKeepsTheirLight) {
  ASSERT_NO_FATAL_FAILURE(makeShapes());
  ASSERT_NO_FATAL_FAILURE(makeRelighter(2));
  std::vector<relume_moving_part> parts{at(6, 2, 3), at(2, 1, 1.5f), at(1, 1, 1)};
  setup_.moving_parts = parts.data();
  setup_.moving_part_count = 2;
  setup_.moving_shapes = shapes_;
  ASSERT_EQ(relume_relight(h_.relighter, &setup_), RELUME_OK);
  const std::vector<float> before = coefficients();
  const auto refuses = [&](const std::string& word) {
    EXPECT_EQ(relume_relight(h_.relighter, &setup_), RELUME_ERROR_USAGE) << word;
    EXPECT_NE(std::string(relume_relighter_error(h_.relighter)).find(word), std::string::npos)
        << relume_relighter_error(h_.relighter);
    EXPECT_EQ(coefficients(), before);
  };
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), -std::numeric_limits<float>::infinity(), 2e8f}) {
    for (float& number : parts[1].to_world) {
      const float good = number;
      number = bad;
      refuses("movingParts[1].toWorld");
      number = good;
    }
  }
  parts[0].shape = 1;
  refuses("movingParts[0].shape is 1");
  parts[0].shape = 0;
  setup_.moving_part_count = 3;
  refuses("expected at most 2");
  // Far more than there are: none is read.
  setup_.moving_part_count = std::numeric_limits<std::size_t>::max();
  refuses("expected at most 256");
  setup_.moving_part_count = 1;
  setup_.moving_shapes = nullptr;
  refuses("without movingShapes");
  setup_.moving_shapes = shapes_;
  setup_.moving_parts = nullptr;
  refuses("setup.moving_parts is null");
  setup_.moving_part_count = 0;
  setup_.moving_shapes = nullptr;
  EXPECT_EQ(relume_relight(h_.relighter, &setup_), RELUME_OK);

  relume_relighter_desc desc{};
  desc.struct_size = sizeof desc;
  desc.moving_parts = 257;
  relume_relighter* none = nullptr;
  EXPECT_EQ(relume_relighter_create(h_.bake, &desc, &none), RELUME_ERROR_USAGE);
  EXPECT_EQ(none, nullptr);
  EXPECT_NE(std::string(relume_bake_error(h_.bake)).find("movingParts is 257"), std::string::npos);
  desc.moving_parts = 1;
  desc.moving_lag = 3;
  EXPECT_EQ(relume_relighter_create(h_.bake, &desc, &none), RELUME_ERROR_USAGE);
  EXPECT_NE(std::string(relume_bake_error(h_.bake)).find("movingLag is 3"), std::string::npos);
}

TEST_F(CMoving, refusesMeshesByName) {
  ASSERT_NO_FATAL_FAILURE(makeShapes());
  const auto refuses = [&](const relume_moving_mesh& mesh, const std::string& word) {
    const relume_moving_mesh meshes[2] = {mesh_, mesh};
    relume_moving_shapes* made = shapes_;
    EXPECT_EQ(relume_moving_shapes_create(h_.context, meshes, 2, &made), RELUME_ERROR_USAGE) << word;
    EXPECT_EQ(made, nullptr);
    EXPECT_NE(std::string(relume_context_error(h_.context)).find(word), std::string::npos)
        << relume_context_error(h_.context);
  };
  const auto with = [&](auto change) {
    relume_moving_mesh mesh = mesh_;
    change(mesh);
    return mesh;
  };
  refuses(with([](auto& m) { m.positions = nullptr; }), "meshes[1].positions is null");
  refuses(with([](auto& m) { m.triangles = nullptr; }), "meshes[1].triangles is null");
  refuses(with([](auto& m) { m.albedo = nullptr; }), "meshes[1].albedo is null");
  refuses(with([](auto& m) { m.emission_count = 1; }), "meshes[1].emission is null");
  refuses(with([](auto& m) { m.triangle_count = 0; }), "no triangles");
  refuses(with([](auto& m) { m.albedo_count = 0; }), "0 albedos");
  std::vector<glm::vec3> broken = ball_.position;
  broken[3].z = std::nanf("");
  refuses(with([&](auto& m) { m.positions = &broken[0].x; }), "vertex 3");
  refuses(with([](auto& m) { m.position_count = 5; }), "triangle");
  const float negative[3] = {0.5f, -0.1f, 0.5f}, nan[3] = {0, 0, std::nanf("")};
  refuses(with([&](auto& m) { m.albedo = negative; }), "albedo");
  refuses(with([&](auto& m) {
            m.emission = nan;
            m.emission_count = 1;
          }),
          "emission");
  relume_moving_shapes* made = nullptr;
  EXPECT_EQ(relume_moving_shapes_create(h_.context, nullptr, 1, &made), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_moving_shapes_create(h_.context, &mesh_, 1, nullptr), RELUME_ERROR_USAGE);
  EXPECT_EQ(relume_moving_shapes_create(nullptr, &mesh_, 1, &made), RELUME_ERROR_USAGE);
  ASSERT_EQ(relume_moving_shapes_create(h_.context, nullptr, 0, &made), RELUME_OK);
  relume_moving_shapes_destroy(made);
  relume_moving_shapes_destroy(nullptr);
}

// Shapes outlive the context they were made with.
TEST_F(CMoving, handlesMayGoInAnyOrder) {
  ASSERT_NO_FATAL_FAILURE(makeShapes());
  ASSERT_NO_FATAL_FAILURE(makeRelighter(1));
  relume_context_destroy(h_.context);
  h_.context = nullptr;
  const relume_moving_part part = at(6, 2, 3);
  setup_.moving_parts = &part;
  setup_.moving_part_count = 1;
  setup_.moving_shapes = shapes_;
  EXPECT_EQ(relume_relight(h_.relighter, &setup_), RELUME_OK);
}

}  // namespace
}  // namespace relume
