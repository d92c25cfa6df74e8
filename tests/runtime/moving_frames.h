// SPDX-License-Identifier: MIT
// A room in which parts move: a ball, a capsule and a box, frames of them that every backend must give the same light
// of, and how far that is apart.
#pragma once

#include "relume/lights.h"
#include "relume/moving_shapes.h"
#include "tests/runtime/ball.h"
#include "tests/runtime/synthetic_bake.h"

#include <gtest/gtest.h>

#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume::test {

// Beside that of the synthetic room, 12 x 4 x 6 m: in it rays meet edges between voxels, where rounding decides.
inline const glm::vec3 kMiddle(6.0137f, 2.0071f, 2.9887f);

inline Bake room(LinkKind kind) {
  return test::makeSyntheticBake(
      {.surfels = 4096, .skyPatches = 16, .lightmapCaches = 200, .linksPerCache = 100, .kind = kind});
}

// A ball, a capsule along y and a box, each about the origin.
inline MovingShapes someShapes() {
  const test::Ball ball(0.6f, 24);
  std::vector<glm::vec3> capsule = ball.position;
  for (glm::vec3& p : capsule) {
    p = 0.6f * p;
    p.y += p.y > 0.0f ? 0.5f : -0.5f;
  }
  const std::vector<glm::vec3> corner{{-0.4f, -0.3f, -0.5f}, {0.4f, -0.3f, -0.5f}, {-0.4f, 0.3f, -0.5f},
                                      {0.4f, 0.3f, -0.5f},   {-0.4f, -0.3f, 0.5f}, {0.4f, -0.3f, 0.5f},
                                      {-0.4f, 0.3f, 0.5f},   {0.4f, 0.3f, 0.5f}};
  const std::vector<glm::uvec3> side{{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                                     {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  const glm::vec3 red(0.8f, 0.2f, 0.1f), grey(0.5f), blue(0.1f, 0.2f, 0.9f), glow(0.0f, 2.0f, 1.0f);
  const MovingMesh meshes[] = {{ball.position, ball.triangle, {&red, 1}},
                               {capsule, ball.triangle, {&grey, 1}},
                               {corner, side, {&blue, 1}, {&glow, 1}}};
  Result<MovingShapes> made = MovingShapes::create(meshes);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

inline MovingPart at(std::uint32_t shape, const glm::vec3& place, float scale = 1.0f, float turn = 0.0f) {
  MovingPart part;
  part.shape = shape;
  part.toWorld[0] = scale * glm::vec3(std::cos(turn), 0.0f, -std::sin(turn));
  part.toWorld[1] = scale * glm::vec3(0.0f, 1.0f, 0.0f);
  part.toWorld[2] = scale * glm::vec3(std::sin(turn), 0.0f, std::cos(turn));
  part.toWorld[3] = place;
  return part;
}

// Sets of parts of a frame, by name.
inline std::vector<std::pair<std::string, std::vector<MovingPart>>> someFrames() {
  std::vector<MovingPart> many;
  for (int i = 0; i < 16; ++i) {
    const auto x = static_cast<float>(i % 8), z = static_cast<float>(i / 8);
    many.push_back(at(static_cast<std::uint32_t>(i % 3), {1.0f + 1.4f * x, 1.0f + 0.3f * z, 0.7f + 1.1f * z}, 0.4f, x));
  }
  std::vector<MovingPart> odd{at(0, kMiddle + glm::vec3(2.0f, 0.0f, 0.0f)), at(2, {2.0f, 1.0f, 1.5f}, 1.0f, 0.6f)};
  odd[1].toWorld[0] *= -1.5f;  // mirrored and wider
  odd.push_back(at(1, kMiddle));
  odd.back().toWorld[1] = glm::vec3(0.0f);  // flattened: hidden
  return {
      {"none", {}},
      {"ball", {at(0, kMiddle)}},
      {"capsule", {at(1, kMiddle, 1.2f, 1.0f)}},
      {"box", {at(2, kMiddle, 1.5f, 0.5f)}},
      {"far from most", {at(0, {1.0f, 0.7f, 1.0f}, 0.4f)}},
      {"outside", {at(0, {60.0f, 2.0f, 3.0f})}},
      {"under the floor", {at(0, {6.0f, -0.7f, 3.0f})}},
      {"a ball and lamps", {at(0, kMiddle), at(2, {2.0f, 3.0f, 2.0f}, 0.2f), at(2, {9.0f, 1.0f, 4.0f}, 0.1f, 0.3f)}},
      {"odd", odd},
      {"many", many}};
}

inline LightSetup setupOf(std::span<const Light> lights, std::span<const glm::vec3> sky) {
  LightSetup setup;
  setup.lights = lights;
  setup.skyPatches = sky;
  return setup;
}

// Root mean square of a difference, relative to that of the first.
inline double relativeError(const std::vector<float>& expected, const std::vector<float>& found) {
  double error = 0.0, all = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const double d = double{found[i]} - expected[i];
    error += d * d;
    all += double{expected[i]} * expected[i];
  }
  return std::sqrt(error / all);
}

}  // namespace relume::test
