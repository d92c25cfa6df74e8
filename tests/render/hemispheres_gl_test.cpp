// SPDX-License-Identifier: MIT
// Hemispheres that OpenGL draws (RCS 5.2), against closed forms and against rays through the same pixels.
#include "tools/render/hemispheres_gl.h"

#include "bake/preview/gather.h"
#include "bake/preview/receivers.h"
#include "relume/bake/context.h"
#include "tests/caches/meshes.h"
#include "tests/rays/make_scene.h"
#include "tests/render/pictures.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>

#include <cmath>
#include <limits>

#ifdef RELUME_RENDER_GL
namespace relume {
namespace {

using namespace test;

const Sky kDark;

SceneLight pointLight(const glm::vec3& position, const glm::vec3& intensity) {
  SceneLight light;
  light.name = "point";
  light.intensity = intensity;
  light.positionWorld = position;
  return light;
}

PreviewOptions withPlane(Hemisphere mode) {
  PreviewOptions options;
  options.hemisphere = mode;
  return options;
}

// A scene, its rays, its light by rays and by OpenGL.
struct Surroundings {
  Surroundings(const Scene& scene, std::vector<SceneLight> on)
      : lights(std::move(on)),
        tracer(std::move(*RayTracer::create(scene, "avx2", context, RayStructure::bundles))),
        withDynamic(std::move(*RayTracer::create(scene, "avx2", context, RayStructure::thorough, RayGeometry::drawn))),
        light(directRadiance(tracer, withDynamic, lights, nullptr, kDark, 1)),
        made(drawHemispheresByGl(scene, lights, PreviewOptions{}, 2048)) {}

  RecordGatherer gatherer(const RecordGatherer::Options& options) const { return {tracer, light, kDark, options}; }

  Record byRays(const PixelReceiver& at, const RecordGatherer::Options& options) const {
    return gatherer(options).gather(at, 1, scratch);
  }
  Record drawn(const PixelReceiver& at, const RecordGatherer::Options& options) const {
    const RecordGatherer by = gatherer(options);
    picture(by.poseOf(at), by.cells().count());
    return by.gatherDrawn(at, radiance, distance, scratch);
  }
  void picture(const glm::mat4& pose, std::size_t pixels) const {
    radiance.resize(pixels);
    distance.resize(pixels);
    made->draw(std::span(&pose, 1), radiance, distance);
  }

  Context context;
  std::vector<SceneLight> lights;
  RayTracer tracer, withDynamic;
  HitRadiance light;
  Result<GlHemispheres> made;
  mutable RecordGatherer::Scratch scratch;
  mutable std::vector<glm::vec3> radiance;
  mutable std::vector<float> distance;
};

#define SKIP_WITHOUT_GL(s)                                                                                    \
  if (!(s).made && (s).made.error().code == ErrorCode::unsupported) GTEST_SKIP() << (s).made.error().message; \
  ASSERT_TRUE((s).made) << (s).made.error().message

RecordGatherer::Options planeOf(Hemisphere mode) {
  RecordGatherer::Options options;
  options.hemisphere = mode;
  return options;
}

glm::vec3 irradianceOf(const Record& record) { return record.normal * record.reflected.vector; }

// Lit from its middle, the inside of a sphere reflects I / (pi r²) everywhere: a furnace. `plane` sees what it covers.
TEST(HemispheresGl, aFurnaceGivesPiLButForWhatAPlaneMisses) {
  Scene scene;
  addInstance(scene, sphere(2.0f, 96, 192), "sphere");
  const glm::vec3 intensity(4.0f, 8.0f, 2.0f);
  const Surroundings s(scene, {pointLight(glm::vec3(0.0f), intensity)});
  SKIP_WITHOUT_GL(s);
  const glm::vec3 e = intensity / 4.0f, n = glm::normalize(glm::vec3(1, 2, -1));
  const PixelReceiver at{{0.5f, -0.3f, 0.9f}, n, n, 0.01f};
  const std::pair<Hemisphere, float> kinds[] = {
      {Hemisphere::plane, 1.0f - 0.169f}, {Hemisphere::scaled, 1.0f}, {Hemisphere::border, 1.0f}};
  for (const auto& [mode, share] : kinds) {
    const Record record = s.drawn(at, planeOf(mode));
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(irradianceOf(record)[c], share * e[c], 0.01f * e[c]);
    EXPECT_NEAR(record.reflected.gradient[1].x, 0.0f, 0.02f * e.y) << "uniform light has no gradient";
  }
}

// Distances to the walls of a box are known pixel by pixel, and which pixel looks where.
TEST(HemispheresGl, pixelsLookWhereCellsSay) {
  Scene scene;
  addInstance(scene, box({-1, -2, -3}, {1, 2, 3}, true));
  finish(scene);
  const Surroundings s(scene, {pointLight({0, 0, 0}, glm::vec3(1.0f))});
  SKIP_WITHOUT_GL(s);
  const glm::vec3 n = glm::normalize(glm::vec3(0.3f, -0.5f, 0.8f)), origin(0.2f, 0.7f, -1.1f);
  const RecordGatherer gatherer = s.gatherer(planeOf(Hemisphere::border));
  const glm::mat4 pose = gatherer.poseOf({origin, n, n, 0.01f});
  s.picture(pose, gatherer.cells().count());
  for (std::uint32_t i = 0; i < gatherer.cells().count(); ++i) {
    const glm::vec3 d = glm::mat3(pose) * gatherer.cells().direction[i];
    float expected = std::numeric_limits<float>::infinity();
    for (int axis = 0; axis < 3; ++axis)
      expected = std::min(expected,
                          ((d[axis] > 0.0f ? 1.0f : -1.0f) * static_cast<float>(axis + 1) - pose[3][axis]) / d[axis]);
    ASSERT_NEAR(s.distance[i], expected, 1e-3f * expected) << i;
  }
}

// Each has a context of its own, which it finds again.
TEST(HemispheresGl, twoLevelsCanBeDrawnInTurn) {
  Scene near, far;
  addInstance(near, box({-1, -1, -1}, {1, 1, 1}, true));
  addInstance(far, box({-3, -3, -3}, {3, 3, 3}, true));
  finish(near);
  finish(far);
  const Surroundings a(near, {pointLight(glm::vec3(0.5f), glm::vec3(1.0f))}),
      b(far, {pointLight(glm::vec3(0.5f), glm::vec3(1.0f))});
  SKIP_WITHOUT_GL(a);
  SKIP_WITHOUT_GL(b);
  const glm::vec3 up(0, 1, 0);
  const PixelReceiver at{{0, 0, 0}, up, up, 0.01f};
  const auto options = planeOf(Hemisphere::border);
  for (int turn = 0; turn < 2; ++turn) {
    EXPECT_NEAR(a.drawn(at, options).nearest, 1.0f, 0.01f);
    EXPECT_NEAR(b.drawn(at, options).nearest, 3.0f, 0.03f);
  }
}

// What is not there is infinitely far and dark.
TEST(HemispheresGl, emptinessIsDarkAndInfinitelyFar) {
  Scene scene;
  addInstance(scene, quad({-1, -1, -1}, {2, 0, 0}, {0, 2, 0}));
  finish(scene);
  const Surroundings s(scene, {pointLight({0, 0, 0}, glm::vec3(1.0f))});
  SKIP_WITHOUT_GL(s);
  const glm::vec3 up(0, 0, 1);
  const Record record = s.drawn({{0, 0, 0}, up, up, 0.01f}, planeOf(Hemisphere::border));
  EXPECT_EQ(irradianceOf(record), glm::vec3(0.0f));
  EXPECT_TRUE(std::isinf(record.distance));
}

// The shipped level: the same pixels by rays and by OpenGL, with shadow maps in place of shadow rays.
TEST(HemispheresGl, agreeWithRaysThroughTheSamePixels) {
  const Scene& scene = level();
  const Surroundings s(scene, scene.lights);
  SKIP_WITHOUT_GL(s);
  Context context;
  double square = 0.0, sum = 0.0, energy = 0.0, total = 0.0;
  std::size_t far = 0, pixels = 0, points = 0;
  for (const Camera& camera : scene.cameras) {
    const auto seen = findReceivers(s.tracer, CameraRays(camera, 16, 9), context);
    for (const PixelReceiver& at : seen) {
      if (at.normal == glm::vec3(0.0f)) continue;
      const glm::dvec3 rays(irradianceOf(s.byRays(at, planeOf(Hemisphere::border))));
      const std::vector<float> truth = s.scratch.distance;
      const glm::dvec3 drawn(irradianceOf(s.drawn(at, planeOf(Hemisphere::border))));
      for (std::size_t i = 0; i < truth.size(); ++i) {
        const float found = s.scratch.distance[i];
        far += !(truth[i] == found || std::abs(truth[i] - found) < 2e-3f * truth[i]) ? 1 : 0;
      }
      pixels += truth.size();
      square += glm::dot(drawn - rays, drawn - rays);
      sum += glm::dot(rays, rays);
      energy += drawn.x + drawn.y + drawn.z;
      total += rays.x + rays.y + rays.z;
      ++points;
    }
  }
  ASSERT_GT(points, 200u);
  EXPECT_LT(static_cast<double>(far) / static_cast<double>(pixels), 0.01) << "pixels on edges alone";
  EXPECT_LT(std::sqrt(square / sum), 0.03);
  EXPECT_NEAR(energy / total, 1.0, 0.01);
  RecordProperty("rms", std::to_string(std::sqrt(square / sum)));
}

// The gradient of translation by OpenGL's pixels is that by rays of the whole hemisphere, under a patch of light that
// the plane sees all of.
TEST(HemispheresGl, gradientsAreThoseOfRays) {
  Scene scene;
  addInstance(scene, box({-2, -1, -2}, {2, 1, 2}, true));
  finish(scene);
  const Surroundings s(scene, {pointLight({0.9f, 0.7f, 0.2f}, glm::vec3(3.0f))});
  SKIP_WITHOUT_GL(s);
  const glm::vec3 up(0, 1, 0);
  RecordGatherer::Options rays;
  rays.rays = 65536;
  rays.secondLook = false;
  for (const glm::vec3& p : {glm::vec3(0.2f, -1, 0.3f), glm::vec3(0.6f, -1, -0.5f), glm::vec3(-0.3f, -1, 0.8f)}) {
    const PixelReceiver at{p, up, up, 0.01f};
    const Record truth = s.byRays(at, rays), drawn = s.drawn(at, planeOf(Hemisphere::border));
    const glm::vec3 a = truth.reflected.gradient[1], b = drawn.reflected.gradient[1];
    EXPECT_LT(glm::distance(a, b), 0.05f * glm::length(a)) << a.x << ' ' << a.z << " and " << b.x << ' ' << b.z;
    EXPECT_GT(glm::length(a), 0.05f * irradianceOf(truth).y);
  }
}

// A whole picture: records that OpenGL looks around for, and records whose rays do.
TEST(HemispheresGl, picturesAgreeWithThoseByRays) {
  const Scene& scene = level();
  const Surroundings s(scene, scene.lights);
  SKIP_WITHOUT_GL(s);
  PreviewOptions options = withPlane(Hemisphere::border);
  options.width = 64;
  options.height = 36;
  options.samples = 1;
  double found[2] = {0.0, 0.0};
  for (const bool drawn : {false, true}) {
    std::vector<Record> cache;
    Context context;
    const PreviewScene view{s.tracer, s.withDynamic, scene.cameras.front(),          s.lights,
                            false,    kDark,         drawn ? &s.made->draw : nullptr};
    const auto frame = renderPreview(view, s.light, options, cache, context);
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->rays, std::uint64_t{frame->records} * 64 * 64);
    for (const glm::vec3& v : frame->bounced) found[drawn ? 1 : 0] += v.x + v.y + v.z;
  }
  EXPECT_NEAR(found[1] / found[0], 1.0, 0.02);
  options.hemisphere = Hemisphere::fan;
  std::vector<Record> cache;
  Context context;
  const auto refused =
      renderPreview({s.tracer, s.withDynamic, scene.cameras.front(), s.lights, false, kDark, &s.made->draw}, s.light,
                    options, cache, context);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::usage);
  EXPECT_NE(refused.error().message.find("fan"), std::string::npos);
}

}  // namespace
}  // namespace relume
#endif
