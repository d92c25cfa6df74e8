// SPDX-License-Identifier: MIT
// Radiance records against closed forms and quadrature.
#include "bake/preview/radiance_records.h"

#include "tests/preview/known_light.h"
#include "tests/rays/make_scene.h"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace relume {
namespace {

using namespace test;

RecordGatherer::Options gathering(std::uint32_t rays, Hemisphere hemisphere = Hemisphere::fan) {
  RecordGatherer::Options options;
  options.rays = rays;
  options.hemisphere = hemisphere;
  return options;
}

// What a record at the origin of a scene has, and the frame it has it in.
struct Gathered {
  std::vector<float> sums;
  glm::mat3 frame{1.0f};
  Gathered(const Scene& scene, const HitRadiance& light, const RecordGatherer::Options& options, int order,
           const glm::vec3& position) {
    const RayTracer tracer = tracerOf(scene);
    const Sky sky;
    const RecordGatherer gatherer(tracer, light, sky, options);
    RecordGatherer::Scratch scratch;
    gatherer.gather({position, {0, 0, 1}, {0, 0, 1}, 0.01f}, 1, scratch);
    sums.resize(hshRecordSize(order));
    sumHshCells(gatherer.cells(), hshCells(gatherer.cells(), order), scratch.reflected, scratch.distance, sums);
    frame = scratch.frame;
  }
};

TEST(RadianceRecords, aFurnaceHasTheFirstCoefficientAloneAndNoGradient) {
  Scene scene;
  addInstance(scene, box({-1, -1, -1}, {1, 1, 1}, true));
  finish(scene);
  const glm::vec3 radiance(0.5f, 1.0f, 2.0f);
  constexpr int kOrder = 5;
  for (const RecordGatherer::Options& options : {gathering(1024), gathering(0x400, Hemisphere::border)}) {
    const Gathered record(scene, lightAt([&](const glm::vec3&) { return radiance; }), options, kOrder, {0.2f, 0, 0});
    for (int c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < kOrder * kOrder; ++i) {
        const double expected = i == 0 ? std::sqrt(2.0 * std::numbers::pi) * static_cast<double>(radiance[c]) : 0.0;
        EXPECT_NEAR(record.sums[static_cast<std::size_t>(c) * kOrder * kOrder + i], expected, 0.005 * radiance[c]) << i;
      }
    }
    for (std::size_t i = 3 * kOrder * kOrder; i < record.sums.size(); ++i) EXPECT_EQ(record.sums[i], 0.0f);
  }
}

// A ceiling at height 1 that is bright where x > 0, seen from x: its coefficients, by quadrature up to the edge for
// each angle about the normal.
std::vector<double> halfBrightCeiling(int order, const glm::mat3& frame, double x) {
  std::vector<double> sums(static_cast<std::size_t>(order * order), 0.0), h(sums.size());
  std::array<double, 32> u{}, weight{};
  constexpr int kTurns = 1024;
  for (int k = 0; k < kTurns; ++k) {
    const double phi = 2.0 * std::numbers::pi * (k + 0.5) / kTurns;
    // Where x + tan(theta) cos(phi) = 0.
    const double tangent = -x / std::cos(phi), edge = 1.0 / std::sqrt(1.0 + tangent * tangent);  // z there
    const bool crosses = tangent > 0.0;
    double low = 0.0, high = 1.0;
    if (std::cos(phi) > 0.0 && crosses) high = edge;
    if (std::cos(phi) < 0.0 && crosses) low = edge;
    if (std::cos(phi) < 0.0 && !crosses) continue;
    gaussLegendre(std::asin(std::sqrt(low)), std::asin(std::sqrt(high)), u, weight);
    for (std::size_t i = 0; i < u.size(); ++i) {
      const double z = std::sin(u[i]) * std::sin(u[i]), r = std::sqrt(1.0 - z * z);
      const glm::dvec3 world(r * std::cos(phi), r * std::sin(phi), z);
      evaluateHsh(order, world * glm::dmat3(frame), h);
      for (std::size_t j = 0; j < h.size(); ++j)
        sums[j] += h[j] * weight[i] * std::sin(2.0 * u[i]) * 2.0 * std::numbers::pi / kTurns;
    }
  }
  return sums;
}

TEST(RadianceRecords, underAHalfBrightCeilingTheGradientIsThatOfCentralDifferences) {
  Scene scene;
  addInstance(scene, quad({-200, -200, 1}, {0, 400, 0}, {400, 0, 0}));
  finish(scene);
  const HitRadiance light = lightAt([](const glm::vec3& p) { return glm::vec3(p.x > 0.0f ? 1.0f : 0.0f); });
  constexpr int kOrder = 6;
  constexpr std::size_t kCount = kOrder * kOrder;
  for (const float x : {0.1f, 0.4f, -0.3f}) {
    const Gathered record(scene, light, gathering(16384), kOrder, {x, 0, 0});
    const std::vector<double> expected = halfBrightCeiling(kOrder, record.frame, static_cast<double>(x) + 1e-6),
                              after = halfBrightCeiling(kOrder, record.frame, static_cast<double>(x) + 1e-3),
                              before = halfBrightCeiling(kOrder, record.frame, static_cast<double>(x) - 1e-3);
    double lightError = 0.0, lightSize = 0.0, error = 0.0, size = 0.0;
    for (std::size_t i = 0; i < kCount; ++i) {
      const double slope = (after[i] - before[i]) / 2e-3;
      const double found =
          record.sums[3 * kCount + i] * record.frame[0].x + record.sums[6 * kCount + i] * record.frame[1].x;
      lightError += std::pow(record.sums[i] - expected[i], 2.0);
      lightSize += std::pow(expected[i], 2.0);
      error += std::pow(found - slope, 2.0);
      size += std::pow(slope, 2.0);
    }
    EXPECT_LT(std::sqrt(lightError / lightSize), 0.01) << x;
    EXPECT_LT(std::sqrt(error / size), 0.05) << x;
  }
}

// RCS Eq. (5) by brute force over the records that a receiver reads, each a radiance for each direction in its own
// frame up to its horizon: the splat, on a sphere where frames are tilted as well.
TEST(RadianceRecords, aSplatIsTheIntegralOverTheSameRecords) {
  Scene scene;
  addInstance(scene, box({-2, -2, -2}, {2, 2, 2}, true));
  finish(scene);
  const RayTracer tracer = tracerOf(scene);
  const HitRadiance light =
      lightAt([](const glm::vec3& p) { return glm::vec3(1.5f + 0.5f * p.x, 1.0f + 0.3f * p.y, 2.0f - 0.5f * p.z); });
  const Sky sky;
  const RecordGatherer gatherer(tracer, light, sky, gathering(1024));
  Context context;
  constexpr int kOrder = 7;
  constexpr std::size_t kCount = kOrder * kOrder;
  const LobeTable lobes(kOrder, LobeKind::mean, context);
  const std::vector<float> exponents(3, 8.0f);
  RadianceRecords radiance(gatherer.cells(), lobes, 0.5f, RecordReach::guarded);
  const RecordKeeper keeper = radiance.keeper(exponents);

  // Three records a little turned against the receiver.
  const PixelReceiver receiver{{0, 0, 0}, {0, 0, 1}, {0, 0, 1}, 0.02f};
  std::vector<Record> records;
  std::vector<glm::mat3> frames;
  std::vector<std::vector<float>> coefficients;
  RecordGatherer::Scratch scratch;
  keeper.resize(3);
  for (const glm::vec3& lean : {glm::vec3(0), glm::vec3(0.15f, 0.1f, 0), glm::vec3(-0.1f, 0.2f, 0)}) {
    PixelReceiver at = receiver;
    at.positionWorld = 0.5f * lean;
    at.normal = at.geometricNormal = glm::normalize(glm::vec3(0, 0, 1) + lean);
    const std::size_t k = records.size();
    records.push_back(gatherer.gather(at, k, scratch));
    keeper.keep(k, k, records.back(), scratch);
    frames.push_back(scratch.frame);
    coefficients.emplace_back(hshRecordSize(kOrder));
    sumHshCells(gatherer.cells(), hshCells(gatherer.cells(), kOrder), scratch.reflected, scratch.distance,
                coefficients.back());
  }
  const Camera camera = lookAt({0, 0, 1.5f}, {0, 0.01f, 0}, 1.0f);
  const CameraRays rays(camera, 32, 32);
  Interpolation interpolation;
  interpolation.accuracy = 0.5f;
  const RecordTiles tiles(rays, records, interpolation);
  RadianceSplat splat;
  radiance.splat(tiles, records, 16, 16, receiver, splat);
  ASSERT_EQ(splat.records.size(), 3u);

  for (const glm::vec3& axis :
       {glm::vec3(0, 0, 1), glm::normalize(glm::vec3(0.5f, -0.2f, 1)), glm::normalize(glm::vec3(-0.3f, 0.9f, 1))}) {
    glm::dvec3 sum(0.0);
    double total = 0.0;
    std::array<double, 48> u{}, weight{};
    std::vector<double> h(kCount);
    gaussLegendre(0.0, 0.5 * std::numbers::pi, u, weight);
    for (std::size_t i = 0; i < u.size(); ++i) {
      for (int k = 0; k < 96; ++k) {
        const double z = std::sin(u[i]) * std::sin(u[i]), r = std::sqrt(1.0 - z * z),
                     phi = 2.0 * std::numbers::pi * (k + 0.5) / 96;
        const glm::dvec3 d(r * std::cos(phi), r * std::sin(phi), z);
        const double lobe =
            std::pow(std::max(0.0, glm::dot(d, glm::dvec3(axis))), 8.0) * weight[i] * std::sin(2.0 * u[i]);
        for (const RecordTiles::Weighed& weighed : splat.records) {
          const glm::mat3& frame = frames[weighed.record];
          const glm::dvec3 local = d * glm::dmat3(frame);
          if (local.z <= 0.0) continue;
          const double share = lobe * static_cast<double>(weighed.weight);
          total += share;
          evaluateHsh(kOrder, local, h);
          const std::vector<float>& c = coefficients[weighed.record];
          const double x = glm::dot(weighed.offset, frame[0]), y = glm::dot(weighed.offset, frame[1]);
          for (std::size_t channel = 0; channel < 3; ++channel) {
            const std::size_t n = channel * kCount;
            double value = 0.0;
            for (std::size_t j = 0; j < kCount; ++j)
              value += h[j] * (c[n + j] + x * c[n + 3 * kCount + j] + y * c[n + 6 * kCount + j]);
            sum[static_cast<int>(channel)] += share * value;
          }
        }
      }
    }
    const glm::vec3 found = mirroredLight(splat, lobes, 8.0f, axis);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], sum[c] / total, 0.015 * sum[c] / total) << c;
  }
}

TEST(RadianceRecords, ordersGrowWithTheExponent) {
  EXPECT_EQ(hshOrderOf(1.0f), 5);
  EXPECT_EQ(hshOrderOf(8.0f), 8);
  EXPECT_EQ(hshOrderOf(15.0f), 9);
  EXPECT_EQ(hshOrderOf(kMaxRecordExponent), kMaxHshOrder);
  EXPECT_EQ(hshOrderOf(1e4f), kMaxHshOrder);
  EXPECT_EQ(hshOrderOf(-1.0f), 5);
}

}  // namespace
}  // namespace relume
