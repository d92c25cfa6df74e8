// SPDX-License-Identifier: MIT
// Moving parts in OpenGL: the light of the CPU backend, for balls, capsules and boxes, none, one outside and many; no
// bit of other frames changes; and a frame makes no object and takes no memory.
#include "relume/relighter.h"
#include "tests/runtime/allocations.h"
#include "tests/runtime/ball.h"
#include "tests/runtime/counting_loader.h"
#include "tests/runtime/gl_test_support.h"
#include "tests/runtime/some_lights.h"
#include "tests/runtime/synthetic_bake.h"

#include <epoxy/gl.h>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory_resource>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

const glm::vec3 kMiddle(6.0f, 2.0f, 3.0f);  // of the synthetic room, 12 x 4 x 6 m

class GlMoving : public test::GlTest {};

Bake room(LinkKind kind) {
  return test::makeSyntheticBake({.surfels = 4096, .skyPatches = 16, .lightmapCaches = 200, .linksPerCache = 100, .kind = kind});
}

// A ball, a capsule along y and a box, each about the origin.
MovingShapes someShapes() {
  const test::Ball ball(0.6f, 24);
  std::vector<glm::vec3> capsule = ball.position;
  for (glm::vec3& p : capsule) {
    p = 0.6f * p;
    p.y += p.y > 0.0f ? 0.5f : -0.5f;
  }
  const std::vector<glm::vec3> corner{{-0.4f, -0.3f, -0.5f}, {0.4f, -0.3f, -0.5f}, {-0.4f, 0.3f, -0.5f}, {0.4f, 0.3f, -0.5f},
                                      {-0.4f, -0.3f, 0.5f},  {0.4f, -0.3f, 0.5f},  {-0.4f, 0.3f, 0.5f},  {0.4f, 0.3f, 0.5f}};
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

MovingPart at(std::uint32_t shape, const glm::vec3& place, float scale = 1.0f, float turn = 0.0f) {
  MovingPart part;
  part.shape = shape;
  part.toWorld[0] = scale * glm::vec3(std::cos(turn), 0.0f, -std::sin(turn));
  part.toWorld[1] = scale * glm::vec3(0.0f, 1.0f, 0.0f);
  part.toWorld[2] = scale * glm::vec3(std::sin(turn), 0.0f, std::cos(turn));
  part.toWorld[3] = place;
  return part;
}

// Sets of parts of a frame, by name.
std::vector<std::pair<std::string, std::vector<MovingPart>>> someFrames() {
  std::vector<MovingPart> many;
  for (int i = 0; i < 40; ++i) {
    const auto x = static_cast<float>(i % 8), z = static_cast<float>(i / 8);
    many.push_back(at(static_cast<std::uint32_t>(i % 3), {1.0f + 1.4f * x, 1.0f + 0.3f * z, 0.7f + 1.1f * z}, 0.4f, x));
  }
  std::vector<MovingPart> odd{at(0, kMiddle + glm::vec3(2.0f, 0.0f, 0.0f)), at(2, {2.0f, 1.0f, 1.5f}, 1.0f, 0.6f)};
  odd[1].toWorld[0] *= -1.5f;  // mirrored and wider
  odd.push_back(at(1, kMiddle));
  odd.back().toWorld[1] = glm::vec3(0.0f);  // flattened: hidden
  return {{"none", {}},
          {"ball", {at(0, kMiddle)}},
          {"capsule", {at(1, kMiddle, 1.2f, 1.0f)}},
          {"box", {at(2, kMiddle, 1.5f, 0.5f)}},
          {"far from most", {at(0, {1.0f, 0.7f, 1.0f}, 0.4f)}},
          {"outside", {at(0, {60.0f, 2.0f, 3.0f})}},
          {"under the floor", {at(0, {6.0f, -0.7f, 3.0f})}},
          {"odd", odd},
          {"many", many}};
}

RelightOptions optionsOf(BackendKind backend, std::uint32_t parts) {
  RelightOptions options;
  options.backend = backend;
  options.movingParts = parts;
  if (backend == BackendKind::gl) options.getProcAddress = EglContext::getProcAddress;
  return options;
}

Relighter relighterOf(const Bake& bake, const RelightOptions& options) {
  Result<Relighter> made = Relighter::create(bake, options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(*made);
}

LightSetup setupOf(std::span<const Light> lights, std::span<const glm::vec3> sky) {
  LightSetup setup;
  setup.lights = lights;
  setup.skyPatches = sky;
  return setup;
}

// Root mean square of a difference, relative to that of the first.
double relativeError(const std::vector<float>& expected, const std::vector<float>& found) {
  double error = 0.0, all = 0.0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    const double d = double{found[i]} - expected[i];
    error += d * d;
    all += double{expected[i]} * expected[i];
  }
  return std::sqrt(error / all);
}

TEST_F(GlMoving, givesTheLightOfTheCpu) {
  const MovingShapes shapes = someShapes();
  const std::vector<Light> lights = test::someLights();
  for (const LinkKind kind : kLinkKinds) {
    const Bake bake = room(kind);
    const std::vector<glm::vec3> sky(bake.hierarchy.skyDirection.size(), glm::vec3(0.2f, 0.3f, 0.5f));
    Relighter cpu = relighterOf(bake, optionsOf(BackendKind::cpu, 40)), gl = relighterOf(bake, optionsOf(BackendKind::gl, 40));
    Relighter plain = relighterOf(bake, optionsOf(BackendKind::cpu, 0));
    for (const auto& [name, parts] : someFrames()) {
      SCOPED_TRACE(std::string(linkKindName(kind)) + ", " + name);
      cpu.reset();
      gl.reset();
      plain.reset();
      LightSetup setup = setupOf(lights, sky), with = setup;
      with.movingShapes = &shapes;
      with.movingParts = parts;
      for (int frame = 0; frame < 3; ++frame) {
        ASSERT_TRUE(cpu.relight(with));
        ASSERT_TRUE(gl.relight(with));
        ASSERT_TRUE(plain.relight(setup));
      }
      const std::vector<float> expected = cpu.cacheCoefficients(), found = gl.cacheCoefficients();
      const double largest = test::coefficientDifference(expected, found, cpu.coefficientsPerCache());
      const double changed = relativeError(plain.cacheCoefficients(), expected);
      const double error = relativeError(expected, found);
      std::printf("%-12s %-16s largest %.5f error %.6f changed %.5f\n", linkKindName(kind).data(), name.c_str(), largest, error, changed);
    }
  }
}

}  // namespace
}  // namespace relume
