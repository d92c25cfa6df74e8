// SPDX-License-Identifier: MIT
// Moving shapes: what they are bounded by, and which meshes are refused.
#include "relume/moving_shapes.h"
#include "runtime/moving/moving_shape.h"
#include "tests/runtime/ball.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

// Sub-meshes may share a vertex buffer, of which each uses a part.
TEST(MovingShapes, verticesWithoutTrianglesChangeNothing) {
  test::Ball ball(0.5f, 16);
  const glm::vec3 grey(0.5f);
  const auto make = [&] {
    const MovingMesh mesh{ball.position, ball.triangle, {&grey, 1}};
    Result<MovingShapes> made = MovingShapes::create({&mesh, 1});
    EXPECT_TRUE(made) << (made ? "" : made.error().message);
    return std::move(*made);
  };
  const MovingShapes alone = make();
  ball.position.insert(ball.position.begin(), {30, 0, 0});
  ball.position.push_back({0, -20, 0});
  for (glm::uvec3& index : ball.triangle) index += 1u;
  const MovingShapes shared = make();
  const MovingShape &expected = alone.shape(0), &found = shared.shape(0);
  EXPECT_EQ(found.centre, expected.centre);
  EXPECT_EQ(found.radius, expected.radius);
  EXPECT_EQ(found.ball, expected.ball);
  EXPECT_EQ(found.grid.originWorld, expected.grid.originWorld);
  EXPECT_EQ(found.grid.voxel, expected.grid.voxel);
  EXPECT_EQ(found.grid.cells, expected.grid.cells);
  EXPECT_EQ(found.bits, expected.bits);
  EXPECT_EQ(found.patchOf, expected.patchOf);
  ASSERT_EQ(found.patch.size(), expected.patch.size());
  for (std::size_t i = 0; i < found.patch.size(); ++i) EXPECT_EQ(found.patch[i].position, expected.patch[i].position);
}

TEST(MovingShapes, refusesMeshesByName) {
  const test::Ball ball(0.5f, 16);
  const glm::vec3 grey(0.5f), bright(1.5f), nan(std::numeric_limits<float>::quiet_NaN());
  const std::vector<glm::vec3> three(3, grey);
  std::vector<glm::vec3> broken = ball.position;
  broken[7].x = nan.x;
  const glm::uvec3 outside(0, 1, 100000);
  const auto refuses = [&](const MovingMesh& mesh, const std::string& word) {
    const MovingMesh meshes[2] = {{ball.position, ball.triangle, {&grey, 1}}, mesh};
    const Result<MovingShapes> made = MovingShapes::create(meshes);
    ASSERT_FALSE(made) << word;
    EXPECT_EQ(made.error().code, ErrorCode::usage);
    EXPECT_TRUE(made.error().message.starts_with("moving mesh 1: ")) << made.error().message;
    EXPECT_EQ(made.error().message.find("mesh 0"), std::string::npos) << made.error().message;
    EXPECT_NE(made.error().message.find(word), std::string::npos) << made.error().message;
  };
  refuses({ball.position, {}, {&grey, 1}}, "no triangles");
  refuses({ball.position, ball.triangle, {}}, "albedos");
  refuses({ball.position, ball.triangle, three}, "3 albedos");
  refuses({ball.position, ball.triangle, {&grey, 1}, three}, "3 emissions");
  refuses({ball.position, ball.triangle, {&bright, 1}}, ": albedo (1.5");
  std::vector<glm::vec3> each(ball.triangle.size(), grey);
  each[5] = bright;
  refuses({ball.position, ball.triangle, each}, ": triangle 5: albedo (1.5");
  refuses({ball.position, ball.triangle, {&grey, 1}, {&nan, 1}}, "emission");
  refuses({broken, ball.triangle, {&grey, 1}}, "vertex 7");
  refuses({ball.position, {&outside, 1}, {&grey, 1}}, "triangle 0");
  EXPECT_TRUE(MovingShapes::create({}));
}

}  // namespace
}  // namespace relume
