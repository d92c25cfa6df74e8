// SPDX-License-Identifier: MIT
// Reflective shadow maps by rays: the light that they reflect, and where their texels stand. Depths of a view.
#include "tools/render/rsm_maps.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace relume {
namespace {

using namespace test;

constexpr double kPi = std::numbers::pi;

struct Level {
  Scene scene;
  Context context;
  std::optional<RayTracer> tracer;

  explicit Level(Mesh mesh, const glm::vec3& albedo) {
    mesh.material = addMaterial(scene, albedo);
    addInstance(scene, std::move(mesh));
    finish(scene);
    auto made = RayTracer::create(scene, "", context);
    EXPECT_TRUE(made);
    tracer.emplace(std::move(*made));
  }
  RsmMap map(const SceneLight& light, std::uint32_t side) {
    RsmMap made = renderRsm(*tracer, light, side, context);
    const RsmImage image = made.image();
    const Status ok = checkRsm({&image, 1});
    EXPECT_TRUE(ok) << ok.error().message;
    return made;
  }
};

glm::dvec3 fluxOf(const RsmMap& map) {
  glm::dvec3 sum(0.0);
  for (const RsmTexel& texel : map.texel) sum += texel.flux;
  return sum;
}

double areaOf(const RsmMap& map) {
  double sum = 0.0;
  for (const RsmTexel& texel : map.texel) sum += texel.area;
  return sum;
}

// Of I = 1 over all directions, by KHR_lights_punctual.
double spotFlux(double inner, double outer) {
  double sum = 0.0;
  constexpr int kSteps = 100000;
  for (int i = 0; i < kSteps; ++i) {
    const double angle = (i + 0.5) * outer / kSteps;
    const double s =
        std::clamp((std::cos(angle) - std::cos(outer)) / std::max(std::cos(inner) - std::cos(outer), 1e-3), 0.0, 1.0);
    sum += s * s * 2.0 * kPi * std::sin(angle) * outer / kSteps;
  }
  return sum;
}

TEST(RsmMaps, fluxIsTheAlbedoTimesTheLight) {
  Level room(box({-1, -1.5f, -2}, {2, 1, 1.5f}, true), {0.6f, 0.3f, 0.0f});
  SceneLight light;
  light.positionWorld = {0.3f, 0.2f, -0.4f};
  light.intensity = {2, 1, 3};
  light.kind = LightKind::point;
  const RsmMap point = room.map(light, 64);
  EXPECT_EQ(point.faces, 6u);
  EXPECT_NEAR(fluxOf(point).x, 0.6 * 2.0 * 4.0 * kPi, 0.01 * 0.6 * 2.0 * 4.0 * kPi);
  EXPECT_NEAR(fluxOf(point).y, 0.3 * 4.0 * kPi, 0.01 * 0.3 * 4.0 * kPi);
  EXPECT_EQ(fluxOf(point).z, 0.0);
  // It sees every wall.
  const double walls = 2.0 * (3 * 2.5 + 3 * 3.5 + 2.5 * 3.5);
  EXPECT_NEAR(areaOf(point), walls, 0.01 * walls);

  light.kind = LightKind::spot;
  light.direction = glm::normalize(glm::vec3(0.4f, -1, 0.3f));
  for (const auto& [inner, outer] : {std::pair(0.3f, 0.5f), std::pair(0.0f, 1.2f), std::pair(0.5f, 1.5f)}) {
    light.innerConeRad = inner;
    light.outerConeRad = outer;
    const RsmMap spot = room.map(light, 128);
    EXPECT_EQ(spot.faces, outer > 1.4f ? 6u : 1u);
    const double expected = 0.6 * 2.0 * spotFlux(inner, outer);
    EXPECT_NEAR(fluxOf(spot).x, expected, 0.01 * expected) << outer;
  }
  // A range ends the light.
  light.kind = LightKind::point;
  light.range = 0.5f;
  EXPECT_EQ(fluxOf(room.map(light, 16)).x, 0.0);
}

TEST(RsmMaps, aDirectionalLightLightsWhatItMeets) {
  Level plate(quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}), glm::vec3(0.5f));
  SceneLight sun;
  sun.kind = LightKind::directional;
  sun.intensity = glm::vec3(3.0f);
  sun.direction = glm::normalize(glm::vec3(0.5f, -1, 0.2f));
  const RsmMap map = plate.map(sun, 512);
  const double across = 4.0 * -sun.direction.y;
  EXPECT_NEAR(fluxOf(map).x, 0.5 * 3.0 * across, 0.01 * 0.5 * 3.0 * across);
  EXPECT_NEAR(areaOf(map), 4.0, 0.04);
  for (const RsmTexel& texel : map.texel) {
    if (texel.area == 0.0f) continue;
    EXPECT_GT(texel.normal.y, 0.99f);
    EXPECT_NEAR(texel.positionWorld.y, 0.0f, 1e-5f);
  }
}

TEST(RsmMaps, aDirectionalMapStandsAtWholeTexels) {
  SceneLight sun;
  sun.kind = LightKind::directional;
  sun.direction = glm::vec3(0, -1, 0);
  const auto firstOf = [&](const glm::vec3& shift) {
    Level plate(quad(glm::vec3(-1, 0, 1) + shift, {2, 0, 0}, {0, 0, -2}), glm::vec3(0.5f));
    const RsmMap map = plate.map(sun, 64);
    for (const RsmTexel& texel : map.texel) {
      if (texel.area > 0.0f) return texel.positionWorld;
    }
    return glm::vec3(0.0f);
  };
  // The sphere's radius is that of the plate; a texel is its width over 64.
  const float texel = 2.0f * std::sqrt(2.0f) * (1.0f + 2.0f / 64.0f) / 64.0f;
  const glm::vec3 first = firstOf(glm::vec3(0.0f));
  for (const float shift : {0.1f, 0.37f, 1.0f}) {
    const glm::vec3 moved = (firstOf({shift, 0, 0.5f * shift}) - first) / texel;
    EXPECT_NEAR(moved.x, std::round(moved.x), 1e-3f) << shift;
    EXPECT_NEAR(moved.z, std::round(moved.z), 1e-3f) << shift;
  }
}

TEST(RsmMaps, depthsOfAViewLieOnWhatItSees) {
  Level room(box({-1, -1.5f, -2}, {2, 1, 1.5f}, true), glm::vec3(0.5f));
  for (const bool orthographic : {false, true}) {
    Camera camera;
    camera.toWorld = glm::rotate(glm::translate(glm::mat4(1.0f), {0.2f, 0.1f, 0.3f}), 0.4f, glm::vec3(0.2f, 1, 0.1f));
    camera.orthographic = orthographic;
    camera.yMag = 0.5f;
    const DepthPicture seen = renderDepth(*room.tracer, camera, 80, 60, room.context);
    ASSERT_TRUE(checkDepthView(seen.view));
    int places = 0;
    for (std::uint32_t i = 0; i < 80 * 60; ++i) {
      const float depth = seen.depth[i];
      if (depth == 0.0f) continue;
      const float w = orthographic ? 1.0f : depth;
      const glm::vec4 pixel(static_cast<float>(i % 80) * w, static_cast<float>(i / 80) * w, depth, 1.0f);
      const glm::vec3 at = seen.view.worldFromPixel * pixel;
      // On a wall of the room.
      const glm::vec3 off = glm::min(glm::abs(at - glm::vec3(-1, -1.5f, -2)), glm::abs(at - glm::vec3(2, 1, 1.5f)));
      EXPECT_LT(std::min({off.x, off.y, off.z}), 1e-4f);
      ++places;
    }
    EXPECT_EQ(places, 8 * 6);
  }
}

}  // namespace
}  // namespace relume
