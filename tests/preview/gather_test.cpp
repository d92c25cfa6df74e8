// SPDX-License-Identifier: MIT
// Records against closed forms. Light comes from functions of the hit, so that every answer is known.
#include "bake/preview/gather.h"

#include "tests/preview/known_light.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

namespace relume {
namespace {

using namespace test;

Record gatherAt(const Scene& scene, const glm::vec3& position, const glm::vec3& normal, const HitRadiance& light,
                const RecordGatherer::Options& options, const Sky& sky = {}) {
  const RayTracer tracer = tracerOf(scene);
  const RecordGatherer gatherer(tracer, light, sky, options);
  RecordGatherer::Scratch scratch;
  return gatherer.gather({position, normal, normal, 0.01f}, 1, scratch);
}

RecordGatherer::Options withRays(std::uint32_t rays) {
  RecordGatherer::Options options;
  options.rays = rays;
  return options;
}

RecordGatherer::Options withPlane(Hemisphere mode, std::uint32_t side = 64) {
  RecordGatherer::Options options;
  options.hemisphere = mode;
  options.planeSide = side;
  return options;
}

Scene room() {
  Scene scene;
  addInstance(scene, box({-1, -1, -1}, {1, 1, 1}, true));
  finish(scene);
  return scene;
}

// A ceiling at height h over the origin, so wide that what lies beside it adds next to nothing.
Scene ceiling(float h) {
  Scene scene;
  addInstance(scene, quad({-200, -200, h}, {0, 400, 0}, {400, 0, 0}));
  finish(scene);
  return scene;
}

glm::vec3 irradianceOf(const RecordLight& light, const glm::vec3& n) { return n * light.vector; }

TEST(Gather, aFurnaceGivesPiLAndNoGradient) {
  const glm::vec3 radiance(0.5f, 1.0f, 2.0f), n = glm::normalize(glm::vec3(1, 2, 3));
  for (const RecordGatherer::Options& options :
       {withRays(1024), withPlane(Hemisphere::scaled), withPlane(Hemisphere::border)}) {
    const Record r =
        gatherAt(room(), {0.2f, -0.3f, 0.1f}, n, lightAt([&](const glm::vec3&) { return radiance; }), options);
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(irradianceOf(r.reflected, n)[c], std::numbers::pi_v<float> * radiance[c],
                  1e-4f * std::numbers::pi_v<float> * radiance[c]);
      EXPECT_EQ(r.reflected.gradient[c], glm::vec3(0.0f));
      // n x I, the gradient of rotation, is 0 as well.
      EXPECT_LT(glm::length(glm::cross(n, r.reflected.vector[c])), 1e-3f * radiance[c]);
    }
    EXPECT_EQ(r.noise, 0.0f);
  }
  const Record plane =
      gatherAt(room(), {0, 0, 0}, n, lightAt([&](const glm::vec3&) { return radiance; }), withPlane(Hemisphere::plane));
  EXPECT_NEAR(irradianceOf(plane.reflected, n).x, (1.0f - 0.169f) * std::numbers::pi_v<float> * radiance.x, 2e-3f);
}

// What a rasteriser would draw, taken from the rays' own pixels: the same record. Pixels below the surface, which an
// interpolated normal's plane has, count as nothing whatever was drawn there.
TEST(Gather, aDrawnRecordIsThatOfTheSamePixelsByRays) {
  const Scene scene = room();
  const RayTracer tracer = tracerOf(scene);
  const HitRadiance light = lightAt([](const glm::vec3& p) { return glm::vec3(2.0f + p.x, 1.0f - p.y, 0.5f); });
  const Sky sky;
  const glm::vec3 up(0, 0, 1), leaning = glm::normalize(glm::vec3(0.6f, 0, 1));
  const PixelReceiver receiver{{0.1f, 0.2f, -1.0f}, leaning, up, 0.01f};
  for (const Hemisphere mode : {Hemisphere::plane, Hemisphere::scaled, Hemisphere::border}) {
    const RecordGatherer gatherer(tracer, light, sky, withPlane(mode));
    RecordGatherer::Scratch scratch;
    const Record rays = gatherer.gather(receiver, 1, scratch);
    std::vector<glm::vec3> radiance = scratch.reflected;
    std::vector<float> distance = scratch.distance;
    std::size_t below = 0;
    for (std::size_t i = 0; i < distance.size(); ++i) {
      if (distance[i] >= 0.0f) continue;
      radiance[i] = glm::vec3(1e6f);
      distance[i] = 0.5f;
      below += 1;
    }
    EXPECT_GT(below, 100u);
    const Record drawn = gatherer.gatherDrawn(receiver, radiance, distance, scratch);
    EXPECT_EQ(drawn.reflected.vector, rays.reflected.vector);
    EXPECT_EQ(drawn.reflected.gradient, rays.reflected.gradient);
    EXPECT_EQ(drawn.distance, rays.distance);
    EXPECT_EQ(drawn.noise, rays.noise);
    const glm::mat4 pose = gatherer.poseOf(receiver);
    EXPECT_EQ(glm::mat3(pose), scratch.frame);
    EXPECT_NEAR(glm::distance(glm::vec3(pose[3]), receiver.positionWorld), 0.0f, 1e-3f);
    EXPECT_EQ(gatherer.raysTraced(), 2u * 64 * 64);
    // A pixel that is no number is none of the light, and no part of the level is to blame.
    radiance[64 * 32 + 32] = glm::vec3(std::numeric_limits<float>::quiet_NaN());
    EXPECT_TRUE(std::isfinite(gatherer.gatherDrawn(receiver, radiance, distance, scratch).reflected.vector[0].z));
    EXPECT_EQ(gatherer.notFinite(), 1u);
    EXPECT_EQ(gatherer.notFiniteInstance(), kNone);
  }
}

TEST(Gather, theSkyIsASumOfItsOwn) {
  Scene scene;
  addInstance(scene, quad({-200, -200, -1}, {400, 0, 0}, {0, 400, 0}));
  finish(scene);
  Sky sky;
  sky.radiance = {1, 2, 3};
  const glm::vec3 up(0, 0, 1);
  const Record r =
      gatherAt(scene, {0, 0, 0}, up, lightAt([](const glm::vec3&) { return glm::vec3(7.0f); }), withRays(256), sky);
  EXPECT_NEAR(irradianceOf(r.sky, up).y, 2.0f * std::numbers::pi_v<float>, 1e-4f);
  EXPECT_EQ(irradianceOf(r.reflected, up), glm::vec3(0.0f));
  EXPECT_TRUE(std::isinf(r.distance));
  EXPECT_TRUE(std::isinf(r.nearest));
}

// Half of a ceiling at height h is bright: the gradient of translation is -pi / (2 h) toward the dark half.
TEST(Gather, aHalfBrightCeilingHasItsGradient) {
  for (const float h : {0.5f, 1.0f, 4.0f}) {
    const auto half = lightAt([](const glm::vec3& p) { return glm::vec3(p.x < 0.0f ? 1.0f : 0.0f); });
    for (const RecordGatherer::Options& options : {withRays(4096), withPlane(Hemisphere::border)}) {
      const Record r = gatherAt(ceiling(h), {0, 0, 0}, {0, 0, 1}, half, options);
      EXPECT_NEAR(irradianceOf(r.reflected, {0, 0, 1}).x, 0.5f * std::numbers::pi_v<float>,
                  0.02f * std::numbers::pi_v<float>);
      EXPECT_NEAR(r.reflected.gradient[0].x * h, -0.5f * std::numbers::pi_v<float>,
                  0.05f * 0.5f * std::numbers::pi_v<float>)
          << h;
      EXPECT_NEAR(r.reflected.gradient[0].y * h, 0.0f, 0.05f) << h;
      EXPECT_NEAR(r.reflected.gradient[0].z, 0.0f, 1e-5f);
    }
  }
}

// Irradiance by a square of radiance 1, half side s, at height h over (x, 0, 0): form factors of rectangles to the
// element below their corner.
double squareIrradiance(double x, double s, double h) {
  const auto corner = [h](double a, double b) {
    const double p = std::sqrt(h * h + a * a), q = std::sqrt(h * h + b * b);
    return 0.5 * (a / p * std::atan(b / p) + b / q * std::atan(a / q));
  };
  return 2.0 * (corner(s - x, s) + corner(s + x, s));
}

TEST(Gather, aSquareOnTheCeilingHasItsIrradianceAndGradients) {
  const double s = 0.5, h = 1.0;
  const auto square =
      lightAt([&](const glm::vec3& p) { return glm::vec3(std::abs(p.x) < s && std::abs(p.y) < s ? 1.0f : 0.0f); });
  for (const double x : {0.0, 0.4, 1.0}) {
    const double e = squareIrradiance(x, s, h),
                 slope = (squareIrradiance(x + 1e-4, s, h) - squareIrradiance(x - 1e-4, s, h)) / 2e-4;
    // The mean of several records: one has the noise of its rays.
    const RayTracer tracer = tracerOf(ceiling(static_cast<float>(h)));
    const Sky sky;
    const RecordGatherer gatherer(tracer, square, sky, withRays(4096));
    RecordGatherer::Scratch scratch;
    double meanE = 0.0, meanSlope = 0.0, meanTurn = 0.0;
    constexpr int kRecords = 64;
    for (int k = 0; k < kRecords; ++k) {
      const Record r = gatherer.gather({{static_cast<float>(x), 0, 0}, {0, 0, 1}, {0, 0, 1}, 0.01f},
                                       static_cast<std::uint64_t>(k), scratch);
      meanE += r.reflected.vector[0].z / kRecords;
      meanSlope += r.reflected.gradient[0].x / kRecords;
      meanTurn += glm::cross(r.normal, r.reflected.vector[0]).y / kRecords;
    }
    EXPECT_NEAR(meanE, e, 0.01 * e) << x;
    EXPECT_NEAR(meanSlope, slope, 0.03 * std::max(std::abs(slope), e)) << x;
    // dE / d angle about +Y: the normal leans toward +X. The square lies toward -X.
    double turn = 0.0;
    for (int i = 0; i < 200; ++i) {
      for (int j = 0; j < 200; ++j) {
        const double dx = -s + (i + 0.5) * s / 100 - x, dy = -s + (j + 0.5) * s / 100;
        const double d2 = dx * dx + dy * dy + h * h;
        turn += dx * h / (d2 * d2) * (s / 100) * (s / 100);
      }
    }
    EXPECT_NEAR(meanTurn, turn, 0.02 * std::max(std::abs(turn), e)) << x;
  }
}

// Off to +X light comes from one direction: the irradiance rises as the normal leans there.
TEST(Gather, turningTowardALobeRaisesIrradiance) {
  const auto lobe = lightAt([](const glm::vec3& p) { return glm::vec3(p.x > 0.6f ? 1.0f : 0.0f); });
  const glm::vec3 up(0, 0, 1), leaning = glm::normalize(glm::vec3(0.1f, 0, 1));
  const Record r = gatherAt(room(), {0, 0, 0}, up, lobe, withRays(4096));
  const Record turned = gatherAt(room(), {0, 0, 0}, leaning, lobe, withRays(4096));
  const float here = irradianceOf(r.reflected, up).x, there = irradianceOf(turned.reflected, leaning).x;
  EXPECT_GT(there, here);
  EXPECT_NEAR(extrapolate(r.reflected, glm::vec3(0.0f), leaning).x, there, 0.03f * there);
}

TEST(Gather, distancesAreHarmonicMeans) {
  // Under a ceiling at height h, r = h / cos: the mean of 1 / r over equal shares of E is 2 / (3 h).
  const Record r = gatherAt(ceiling(0.8f), {0, 0, 0}, {0, 0, 1},
                            lightAt([](const glm::vec3&) { return glm::vec3(1.0f); }), withRays(1024));
  EXPECT_NEAR(r.distance, 1.5f * 0.8f, 0.01f);
  EXPECT_NEAR(r.nearest, 0.8f, 0.01f);
}

// Blue on one side and yellow on the other, as bright: luminance has no slope, but colours must not be extrapolated to
// beyond what there is.
TEST(Gather, channelsThatChangeAgainstEachOtherStayWithinTheLight) {
  Record record;
  record.normal = {0, 0, 1};
  record.distance = 2.0f;
  record.reflected.vector = glm::mat3(glm::vec3(0, 0, 1.0f), glm::vec3(0, 0, 2.0f), glm::vec3(0, 0, 0.5f));
  record.reflected.gradient = glm::mat3(glm::vec3(10.0f, 0, 0), glm::vec3(0.5f, 0, 0), glm::vec3(-50.0f, 0, 0));
  limitChannels(record);
  EXPECT_NEAR(record.reflected.gradient[0].x, 1.0f, 1e-6f);
  EXPECT_EQ(record.reflected.gradient[1].x, 0.5f);
  EXPECT_NEAR(record.reflected.gradient[2].x, -1.0f, 1e-6f);
  record.distance = std::numeric_limits<float>::infinity();
  record.reflected.gradient = glm::mat3(0.0f);
  limitChannels(record);
  EXPECT_EQ(record.reflected.gradient, glm::mat3(0.0f)) << "nothing is seen: 0 times infinity is no change";
}

TEST(Gather, lightThatIsNoNumberCountsAsNoneAndIsTold) {
  const Scene scene = room();
  const RayTracer tracer = tracerOf(scene);
  const Sky sky;
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    const HitRadiance light = lightAt([bad](const glm::vec3& p) { return glm::vec3(p.x < 0.0f ? 1.0f : bad); });
    const RecordGatherer gatherer(tracer, light, sky, withRays(256));
    RecordGatherer::Scratch scratch;
    const Record r = gatherer.gather({{0, 0, 0}, {0, 0, 1}, {0, 0, 1}, 0.01f}, 1, scratch);
    EXPECT_NEAR(irradianceOf(r.reflected, {0, 0, 1}).x, 0.5f * std::numbers::pi_v<float>, 0.1f);
    EXPECT_GT(gatherer.notFinite(), 0u);
    EXPECT_EQ(gatherer.notFiniteInstance(), 0u);
  }
}

// Where a patch of light begins and ends, cells are looked at again: the noise falls, and the record knows of it.
TEST(Gather, aSecondLookAtUnevenCellsLowersTheNoise) {
  const auto patch = lightAt([](const glm::vec3& p) {
    return glm::vec3(std::abs(p.x - 0.3f) < 0.1f && std::abs(p.y) < 0.1f ? 100.0f : 0.0f);
  });
  const Scene scene = ceiling(1.0f);
  const RayTracer tracer = tracerOf(scene);
  const Sky sky;
  const RecordGatherer gatherer(tracer, patch, sky, withRays(1024));
  RecordGatherer::Scratch scratch;
  double sum = 0.0, squares = 0.0, told = 0.0;
  constexpr int kRecords = 400;
  for (int k = 0; k < kRecords; ++k) {
    const Record r = gatherer.gather({{0, 0, 0}, {0, 0, 1}, {0, 0, 1}, 0.01f}, static_cast<std::uint64_t>(k), scratch);
    const double e = irradianceOf(r.reflected, {0, 0, 1}).x;
    sum += e;
    squares += e * e;
    told += r.noise;
  }
  const double mean = sum / kRecords, deviation = std::sqrt(squares / kRecords - mean * mean);
  // L A h² / d⁴ over the patch, by quadrature.
  double exact = 0.0;
  for (int i = 0; i < 100; ++i) {
    for (int j = 0; j < 100; ++j) {
      const double x = 0.2 + (i + 0.5) * 0.002, y = -0.1 + (j + 0.5) * 0.002, d2 = x * x + y * y + 1.0;
      exact += 100.0 * 4e-6 / (d2 * d2);
    }
  }
  EXPECT_NEAR(mean, exact, 0.02 * exact);
  EXPECT_LT(deviation, 0.1 * exact) << "about 0.2 without";
  EXPECT_NEAR(told / kRecords, deviation, 0.7 * deviation);
  EXPECT_GT(gatherer.raysTraced(), 1024u * kRecords);
}

}  // namespace
}  // namespace relume
