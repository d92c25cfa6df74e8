// SPDX-License-Identifier: MIT
#include "bake/reference/path_tracer.h"

#include "relume/bake/context.h"
#include "relume/glossy.h"
#include "tests/cancel_after.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <cmath>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr float kPi = 3.14159265f;

RayTracer tracerOf(const Scene& scene) {
  Context context;
  auto tracer = RayTracer::create(scene, "avx2", context);
  EXPECT_TRUE(tracer);
  return std::move(*tracer);
}

ReferenceImage render(const Scene& scene, const Camera& camera, const std::vector<SceneLight>& lights,
                      const ReferenceOptions& options, int threads = 0) {
  const RayTracer tracer = tracerOf(scene);
  Context context;
  context.threads = threads;
  auto image = renderReference(tracer, camera, lights, options, context);
  EXPECT_TRUE(image) << (image ? "" : image.error().message);
  return std::move(*image);
}

glm::dvec3 meanOf(const std::vector<glm::vec3>& layer) {
  glm::dvec3 sum(0.0);
  for (const glm::vec3& v : layer) sum += glm::dvec3(v);
  return sum / static_cast<double>(layer.size());
}

Scene floorScene() {
  Scene scene;
  addInstance(scene, quad({-10, 0, 10}, {20, 0, 0}, {0, 0, -20}, addMaterial(scene, {0.2f, 0.5f, 0.8f})));
  finish(scene);
  return scene;
}

SceneLight lightAbove(LightKind kind) {
  SceneLight light;
  light.kind = kind;
  light.intensity = {3.0f, 2.0f, 1.0f};
  light.positionWorld = {0.3f, 2.0f, -0.2f};
  light.direction = {0, -1, 0};
  return light;
}

const ReferenceOptions kSmall{24, 16, 4, 4, false, {}, 1};

TEST(Reference, pointLightOverAPlaneGivesICosOverDSquared) {
  const Scene scene = floorScene();
  const auto image = render(scene, lookAt({0, 3, 3}, {0, 0, 0}), {lightAbove(LightKind::point)}, kSmall);
  const std::size_t centre = 8 * 24 + 12;
  // Pixel means of a smooth function against its value at the pixel's centre.
  const glm::vec3 p = image.position[centre], toLight = glm::vec3(0.3f, 2.0f, -0.2f) - p;
  const float d = glm::length(toLight), expected = 3.0f * (toLight.y / d) / (d * d);
  EXPECT_NEAR(image.direct[centre].x * kPi, expected, 0.05f * expected);
  EXPECT_EQ(image.indirect[centre], glm::vec3(0.0f));  // nothing else to reflect
  EXPECT_NEAR(image.albedo[centre].y, 0.5f, 1e-6f);
  EXPECT_NEAR(image.normal[centre].y, 1.0f, 1e-6f);
  EXPECT_NEAR(image.depth[centre], glm::dot(p - glm::vec3(0, 3, 3), glm::normalize(glm::vec3(0, -3, -3))), 1e-4f);
}

TEST(Reference, irradianceOfEachKindOfLightIsItsFormula) {
  const glm::vec3 up(0, 1, 0), p(0.8f, 0.0f, 0.3f);
  glm::vec3 toLight;
  float distance = 0.0f;

  SceneLight sun = lightAbove(LightKind::directional);
  sun.direction = glm::normalize(glm::vec3(1, -1, 0));
  EXPECT_NEAR(lightIrradiance(sun, p, up, toLight, distance).x, 3.0f * std::sqrt(0.5f), 1e-6f);
  EXPECT_TRUE(std::isinf(distance));
  EXPECT_EQ(lightIrradiance(sun, p, -up, toLight, distance), glm::vec3(0.0f));

  SceneLight point = lightAbove(LightKind::point);
  const glm::vec3 offset = point.positionWorld - p;
  const float d = glm::length(offset), expected = 3.0f * offset.y / (d * d * d);
  EXPECT_NEAR(lightIrradiance(point, p, up, toLight, distance).x, expected, 1e-6f);
  EXPECT_NEAR(distance, d, 1e-6f);
  point.range = 3.0f;
  const float window = 1.0f - std::pow(d / 3.0f, 4.0f);
  EXPECT_NEAR(lightIrradiance(point, p, up, toLight, distance).x, expected * window, 1e-6f);
  point.range = 2.0f;
  EXPECT_EQ(lightIrradiance(point, p, up, toLight, distance), glm::vec3(0.0f));

  // KHR_lights_punctual: the squared line in the cosine between outer and inner angle.
  SceneLight spot = lightAbove(LightKind::spot);
  spot.innerConeRad = 0.1f;
  spot.outerConeRad = 0.6f;
  const float cosine = offset.y / d;
  const float line = (cosine - std::cos(0.6f)) / (std::cos(0.1f) - std::cos(0.6f));
  ASSERT_GT(line, 0.05f);
  ASSERT_LT(line, 0.95f);
  EXPECT_NEAR(lightIrradiance(spot, p, up, toLight, distance).x, expected * line * line, 1e-6f);
  EXPECT_EQ(lightIrradiance(spot, {5, 0, 0}, up, toLight, distance), glm::vec3(0.0f));
  spot.innerConeRad = spot.outerConeRad;  // a hard edge, no division by zero
  EXPECT_NEAR(lightIrradiance(spot, {0.3f, 0, -0.2f}, up, toLight, distance).x, 0.75f, 1e-5f);
}

TEST(Reference, anOccluderGivesZero) {
  Scene scene = floorScene();
  addInstance(scene, quad({-1, 1, 1}, {2, 0, 0}, {0, 0, -2}));
  finish(scene);
  const RayTracer tracer = tracerOf(scene);
  const std::vector<SceneLight> lights{lightAbove(LightKind::point)};
  EXPECT_EQ(directIrradiance(tracer, lights, {0, 0, 0}, {0, 1, 0}), glm::vec3(0.0f));
  EXPECT_GT(directIrradiance(tracer, lights, {4, 0, 0}, {0, 1, 0}).x, 0.0f);
}

TEST(Reference, manyPointsHaveTheLightOfEach) {
  Scene scene;
  addInstance(scene, quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}));
  addInstance(scene, quad({-0.5f, 1, 0.5f}, {1, 0, 0}, {0, 0, -1}));
  finish(scene);
  const RayTracer tracer = tracerOf(scene);
  std::vector<SceneLight> lights(2);
  lights[0].positionWorld = {0.3f, 3, 0.2f};
  lights[1].kind = LightKind::directional;
  lights[1].direction = glm::normalize(glm::vec3(0.5f, -1, 0.2f));
  std::vector<glm::vec3> position, normal;
  for (int i = 0; i < 400; ++i) {
    position.emplace_back(-1.9f + 0.19f * static_cast<float>(i % 20), 0, -1.9f + 0.19f * static_cast<float>(i / 20));
    normal.emplace_back(glm::normalize(glm::vec3(0.01f * static_cast<float>(i % 7), 1, 0)));
  }
  std::vector<glm::vec3> all(position.size(), glm::vec3(7.0f));
  directIrradiance(tracer, lights, position, normal, all);
  int shadowed = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i], directIrradiance(tracer, lights, position[i], normal[i])) << i;
    shadowed += directIrradiance(tracer, {&lights[0], 1}, position[i], normal[i]) == glm::vec3(0.0f) ? 1 : 0;
  }
  EXPECT_GT(shadowed, 10);
  EXPECT_LT(shadowed, 390);
}

TEST(Reference, constantSkyLightsAnOpenPlaneByItsRadiance) {
  ReferenceOptions options = kSmall;
  options.sky.radiance = {0.5f, 1.0f, 2.0f};
  const auto image = render(floorScene(), lookAt({0, 3, 0.1f}, {0, 0, 0}), {}, options);
  for (const glm::vec3& e : image.direct) {
    EXPECT_NEAR(e.x, 0.5f, 1e-5f);
    EXPECT_NEAR(e.z, 2.0f, 1e-5f);
  }
  EXPECT_TRUE(image.glossyDirect.empty());
  // A lobe sees it too, however much of it lies below the plane.
  for (const float exponent : {0.0f, 1.0f, 30.0f, 1e4f}) {
    options.exponent = exponent;
    const auto glossy = render(floorScene(), lookAt({4, 0.3f, 0.1f}, {0, 0, 0}), {}, options);
    for (std::size_t i = 0; i < glossy.glossyDirect.size(); ++i) {
      if (glossy.depth[i] > 0.0f && glossy.depth[i] < 5.0f) {
        EXPECT_NEAR(glossy.glossyDirect[i].y, 1.0f, 1e-5f) << exponent;
      }
      EXPECT_EQ(glossy.glossyIndirect[i], glm::vec3(0.0f));
    }
  }
}

// A wall beside a floor hides (1 - cos) / 2 of the angle that it fills, what is far away less.
TEST(Reference, aWallHidesItsFormFactor) {
  Scene scene = floorScene();
  const auto grey = addMaterial(scene, glm::vec3(0.5f));
  addInstance(scene, quad({1, 0, 10}, {0, 0, -20}, {0, 9, 0}, grey));
  finish(scene);
  ReferenceOptions options{8, 8, 512, 0, false, {}, 1};
  EXPECT_TRUE(render(scene, lookAt({0, 0.1f, 0.01f}, {0, 0, 0}), {}, options).open.empty());
  const auto at = [&](float falloff) {
    options.occlusionFalloff = falloff;
    const auto image = render(scene, lookAt({0, 0.1f, 0.01f}, {0, 0, 0}), {}, options);
    double sum = 0.0;
    for (const float o : image.open) sum += static_cast<double>(o) / 64.0;
    return 1.0 - sum;
  };
  EXPECT_NEAR(at(0.0f), 0.5 * (1.0 - std::cos(std::atan2(9.0, 1.0))), 0.02);
  EXPECT_LT(at(4.0f), 0.15);
  EXPECT_GT(at(4.0f), 0.02);
  // What is not seen is not hidden.
  for (const float o : render(scene, lookAt({-3, 3, 0}, {-9, 3, 0}), {}, options).open) {
    EXPECT_GE(o, 0.0f);
    EXPECT_LE(o, 1.0f);
  }
  EXPECT_EQ(render(scene, lookAt({-3, 3, 0}, {-9, 9, 0}), {}, options).open.front(), 1.0f);
}

// A mirror's lobe sees what the mirrored ray meets: here an emitter.
TEST(Reference, aSharpLobeSeesTheReflectedDirectionAlone) {
  Scene scene = floorScene();
  const auto glow = addMaterial(scene, glm::vec3(0.0f), glm::vec3(3.0f));
  addInstance(scene, box({-2, 3, -5}, {2, 7, -4.9f}, false, glow));
  finish(scene);
  ReferenceOptions options = kSmall;
  options.emissive = true;
  options.exponent = 1e4f;
  // From (0, 5, 5) toward the origin, on toward (0, 5, -5): into the emitter's middle.
  const auto image = render(scene, lookAt({0, 5, 5}, {0, 0, 0}), {}, options);
  const std::size_t middle = std::size_t{kSmall.height / 2} * kSmall.width + kSmall.width / 2;
  EXPECT_NEAR(image.glossyDirect[middle].x, 3.0f, 0.05f);
  EXPECT_EQ(image.glossyDirect.front().x, 0.0f);
}

TEST(Reference, closedFurnaceGivesEmissionOverOneMinusAlbedo) {
  // Every wall emits Le and reflects rho: the radiance is Le / (1 - rho) everywhere; light that was reflected at most n
  // times gives the partial sum.
  const float rho = 0.5f, le = 2.0f;
  Scene scene;
  addInstance(scene, box({-1, -1, -1}, {1, 1, 1}, true, addMaterial(scene, glm::vec3(rho), glm::vec3(le))));
  finish(scene);
  ReferenceOptions options = kSmall;
  options.emissive = true;
  options.samplesPerPixel = 256;
  options.exponent = 5.0f;
  for (const std::uint32_t bounces : {0u, 1u, 3u, 64u}) {
    options.maxBounces = bounces;
    const auto image = render(scene, lookAt({0.2f, 0.1f, 0.3f}, {1, 0.2f, 0}), {}, options);
    // Irradiance / pi: Le straight, Le (rho + rho² + ...) reflected.
    const double reflected = le * rho * (1.0 - std::pow(rho, bounces)) / (1.0 - rho);
    EXPECT_NEAR(meanOf(image.direct).x, le, 0.01 * le) << bounces;
    EXPECT_NEAR(meanOf(image.indirect).x, reflected, 0.01 * le) << bounces;
    EXPECT_NEAR(meanOf(image.emission).x, le, 1e-5);
    EXPECT_NEAR(meanOf(image.glossyDirect).x, le, 1e-5);
    EXPECT_NEAR(meanOf(image.glossyIndirect).x, reflected, 0.01 * le) << bounces;
    const double radiance = meanOf(image.emission).x + rho * (meanOf(image.direct).x + meanOf(image.indirect).x);
    if (bounces == 64) {
      EXPECT_NEAR(radiance, le / (1.0 - rho), 0.01 * le);
    }
  }
}

TEST(Reference, whiteSurfacesOfAnyMaterialShineLikeTheSkyAroundThem) {
  // A white furnace: a floor alone under a sky of 1 reflects what it gets, whatever its metalness and roughness.
  for (const float metalness : {0.0f, 0.3f, 1.0f}) {
    for (const float roughness : {0.0f, 0.3f, 0.6f, 1.0f}) {
      Scene scene;
      addInstance(scene, quad({-10, 0, 10}, {20, 0, 0}, {0, 0, -20}, addMaterial(scene, glm::vec3(1.0f))));
      scene.materials[0].gloss.metalness = metalness;
      scene.materials[0].gloss.roughness = roughness;
      finish(scene);
      ReferenceOptions options;
      options.width = 24;
      options.height = 16;
      options.samplesPerPixel = 4;
      options.sky.radiance = glm::vec3(1.0f);
      options.gloss = true;
      const auto image = render(scene, lookAt({4, 2.0f, 0.1f}, {0, 0, 0}), {}, options);
      for (std::size_t i = 0; i < image.depth.size(); ++i) {
        const glm::vec3 radiance = (image.direct[i] + image.indirect[i]) * image.albedo[i] + image.glossyDirect[i] +
                                   image.glossyIndirect[i] + image.emission[i];
        EXPECT_NEAR(radiance.x, 1.0f, 1e-4f) << metalness << ' ' << roughness;
      }
    }
  }
}

TEST(Reference, highlightsOfPunctualLightsAreThoseOfTheLobe) {
  // Straight above a floor of metal, the eye beside the light: n + 1 over 2 pi of the irradiance, times the colour.
  Scene scene;
  addInstance(scene, quad({-10, 0, 10}, {20, 0, 0}, {0, 0, -20}, addMaterial(scene, glm::vec3(1.0f))));
  scene.materials[0].gloss = {1.0f, 0.5f, {}, {}, 1.0f};
  finish(scene);
  SceneLight light;
  light.kind = LightKind::directional;
  light.intensity = {3.0f, 2.0f, 1.0f};
  light.direction = {0, -1, 0};
  ReferenceOptions options;
  options.width = options.height = 3;
  options.samplesPerPixel = 64;
  options.gloss = true;
  const auto image = render(scene, lookAt({0, 5, 0.001f}, {0, 0, 0}, 0.02f), {light}, options);
  const float expected = (glossyExponent(0.5f) + 1.0f) / (2.0f * kPi);  // a white metal mirrors all
  EXPECT_NEAR(image.glossyDirect[4].x, 3.0f * expected, 0.01f * expected);
  EXPECT_NEAR(image.glossyDirect[4].z, 1.0f * expected, 0.01f * expected);
  EXPECT_EQ(image.albedo[4], glm::vec3(0.0f));
}

TEST(Reference, emitterOverAFloorGivesItsFormFactorAndNothingBehindIt) {
  // A 1 x 1 m emitter of radiance 5, 1 m above the floor, facing down. Point below its centre: four corner rectangles
  // of form factor F(a, b, h); E = L pi 4 F.
  Scene scene;
  addInstance(scene, quad({-10, 0, 10}, {20, 0, 0}, {0, 0, -20}, addMaterial(scene, glm::vec3(0.5f))));
  addInstance(scene,
              quad({-0.5f, 1, -0.5f}, {1, 0, 0}, {0, 0, 1}, addMaterial(scene, glm::vec3(0.0f), glm::vec3(5.0f))));
  finish(scene);
  ReferenceOptions options = kSmall;
  options.emissive = true;
  options.samplesPerPixel = 2048;
  options.width = options.height = 1;
  const auto image = render(scene, lookAt({0, 0.5f, 0}, {0, 0, 0}, 0.01f, {1, 0, 0}), {}, options);
  const double a = 0.5, root = std::sqrt(1 + a * a);
  const double corner = (a / root * std::atan(a / root) * 2) / (2 * kPi);
  EXPECT_NEAR(image.direct[0].x, 5.0 * 4 * corner, 0.02 * 5.0 * 4 * corner);
  const auto above = render(scene, lookAt({0, 3, 0}, {0, 1.5f, 0}, 0.01f, {1, 0, 0}), {}, options);
  EXPECT_EQ(above.emission[0], glm::vec3(0.0f));  // its back is dark
  scene.materials[1].doubleSided = true;
  const auto both = render(scene, lookAt({0, 3, 0}, {0, 1.5f, 0}, 0.01f, {1, 0, 0}), {}, options);
  EXPECT_NEAR(both.emission[0].x, 5.0f, 1e-5f);
}

TEST(Reference, bothSidesOfAFaceReflect) {
  const Scene scene = floorScene();
  SceneLight light = lightAbove(LightKind::point);
  light.positionWorld.y = -2.0f;
  const auto image = render(scene, lookAt({0, -3, 3}, {0, 0, 0}), {light}, kSmall);
  EXPECT_GT(image.direct[8 * 24 + 12].x, 0.1f);
  EXPECT_NEAR(image.normal[8 * 24 + 12].y, -1.0f, 1e-6f);
}

TEST(Reference, halvesEstimateTheNoise) {
  Scene scene;
  addInstance(scene, box({-1, -1, -1}, {1, 1, 1}, true, addMaterial(scene, glm::vec3(0.6f))));
  finish(scene);
  SceneLight light = lightAbove(LightKind::point);
  light.positionWorld = {0.3f, 0.4f, 0.2f};
  ReferenceOptions options = kSmall;
  options.samplesPerPixel = 64;
  const Camera camera = lookAt({-0.5f, 0, 0.5f}, {1, 0, -1});
  const auto a = render(scene, camera, {light}, options);
  options.seed = 2;
  const auto b = render(scene, camera, {light}, options);
  double estimated = 0, found = 0;
  for (std::size_t i = 0; i < a.indirect.size(); ++i) {
    estimated += glm::dot(a.indirectError[i], a.indirectError[i]) + glm::dot(b.indirectError[i], b.indirectError[i]);
    const glm::vec3 difference = a.indirect[i] - b.indirect[i];
    found += glm::dot(difference, difference);
  }
  EXPECT_NEAR(estimated / found, 1.0, 0.3);
}

TEST(Reference, sameImageAtAnyThreadCountAnotherForAnotherSeed) {
  const Scene scene = floorScene();
  ReferenceOptions options = kSmall;
  options.sky.radiance = glm::vec3(1.0f);
  const Camera camera = lookAt({0, 3, 3}, {0, 0, 0});
  const std::vector<SceneLight> lights{lightAbove(LightKind::point)};
  const auto one = render(scene, camera, lights, options, 1), many = render(scene, camera, lights, options, 4);
  EXPECT_EQ(one.direct, many.direct);
  EXPECT_EQ(one.directError, many.directError);
  options.seed = 2;
  EXPECT_NE(render(scene, camera, lights, options).direct, one.direct);
}

// A dynamic plate over a floor, under a sky and a lamp, seen from between the two and from above.
TEST(Reference, dynamicInstancesAreSolidOrReceiversOnly) {
  Scene scene = floorScene();
  const std::uint32_t plate = addInstance(scene, box({-4, 1, -4}, {4, 1.1f, 4}, false));
  scene.instances[plate].mode = BakeMode::dynamic;
  finish(scene);
  Context context;
  const RayTracer fixed = tracerOf(scene);
  const auto drawn = RayTracer::create(scene, "avx2", context, RayStructure::thorough, RayGeometry::drawn);
  ASSERT_TRUE(drawn);
  const Camera below = lookAt({0, 0.9f, 0.2f}, {0, 0, 0}), above = lookAt({0, 3, 3}, {0, 1.1f, 0});
  ReferenceOptions options = kSmall;
  options.samplesPerPixel = 16;

  // Sky: a solid plate keeps nearly all of it from the floor below; as a receiver it keeps nothing.
  options.sky.radiance = glm::vec3(1.0f);
  const auto skyOf = [&](const RayTracer& tracer, const RayTracer* seen) {
    const auto image = renderReference(tracer, below, {}, options, context, seen);
    EXPECT_TRUE(image);
    return meanOf(image->direct).x;
  };
  EXPECT_LT(skyOf(*drawn, nullptr), 0.2);
  EXPECT_NEAR(skyOf(fixed, &*drawn), 1.0, 1e-5);
  // It is seen and lit itself, and casts the lamp's shadow.
  options.sky.radiance = glm::vec3(0.0f);
  const std::vector<SceneLight> lamp{lightAbove(LightKind::point)};
  const auto seen = renderReference(fixed, above, lamp, options, context, &*drawn);
  ASSERT_TRUE(seen);
  EXPECT_NEAR(seen->position[8 * 24 + 12].y, 1.1f, 1e-4f);
  EXPECT_GT(seen->direct[8 * 24 + 12].x, 0.0f);
  const auto shadow = renderReference(fixed, below, lamp, options, context, &*drawn);
  ASSERT_TRUE(shadow);
  EXPECT_EQ(meanOf(shadow->direct).x, 0.0);
}

TEST(Reference, optionsOutOfRangeAreRefused) {
  const Scene scene = floorScene();
  const RayTracer tracer = tracerOf(scene);
  Context context;
  for (const auto& change :
       {+[](ReferenceOptions& o) { o.width = 0; }, +[](ReferenceOptions& o) { o.height = 16385; },
        +[](ReferenceOptions& o) { o.samplesPerPixel = 0; }, +[](ReferenceOptions& o) { o.maxBounces = 1025; },
        +[](ReferenceOptions& o) { o.exponent = -1.0f; }, +[](ReferenceOptions& o) { o.exponent = std::nanf(""); },
        +[](ReferenceOptions& o) { o.exponent = 10001.0f; }, +[](ReferenceOptions& o) { o.occlusionFalloff = -1.0f; },
        +[](ReferenceOptions& o) { o.occlusionFalloff = std::nanf(""); }}) {
    ReferenceOptions options = kSmall;
    change(options);
    const auto image = renderReference(tracer, lookAt({0, 3, 3}, {0, 0, 0}), {}, options, context);
    ASSERT_FALSE(image);
    EXPECT_EQ(image.error().code, ErrorCode::usage);
  }
  context.cancel();
  EXPECT_FALSE(renderReference(tracer, lookAt({0, 3, 3}, {0, 0, 0}), {}, kSmall, context));
}

// One pixel of very many paths.
TEST(Reference, aCancelIsHeardWithinAPixel) {
  const Scene scene = floorScene();
  const RayTracer tracer = tracerOf(scene);
  const ReferenceOptions options{1, 1, 200000, 12, false, {}, 1};
  const std::vector<SceneLight> lights(50, lightAbove(LightKind::point));
  const CancelledWork work([&](Context& context) {
    const auto image = renderReference(tracer, lookAt({0, 3, 3}, {0, 0, 0}), lights, options, context);
    if (!image) {
      EXPECT_EQ(image.error().message, "cancelled");
    }
    return static_cast<bool>(image);
  });
  EXPECT_LT(work.shareAfterCancel(0.3), 0.5);
}

}  // namespace
}  // namespace relume
