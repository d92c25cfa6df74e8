// SPDX-License-Identifier: MIT
// Reflective shadow maps: what is refused, how samples are shared out, and CRC Eq. (2) against quadrature.
#include "runtime/live/rsm_image.h"
#include "formats/color.h"
#include "runtime/live/rsm_bounces.h"
#include "tests/live/lit_maps.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace relume {
namespace {

using namespace test;

constexpr double kPi = std::numbers::pi;

TEST(RsmImage, whatIsRefusedNamesMapAndTexel) {
  const float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  const LitPlate plate(4);
  EXPECT_TRUE(checkRsm(std::vector<RsmImage>{plate.image()}));
  const auto messageOf = [&](const RsmImage& image) {
    const std::vector<RsmImage> images{plate.image(), image};
    const Status ok = checkRsm(images);
    return ok ? std::string() : ok.error().message;
  };
  RsmImage image = plate.image();
  image.side = 0;
  EXPECT_NE(messageOf(image).find("map 1: 0 texels"), std::string::npos) << messageOf(image);
  image = plate.image();
  image.faces = 2;
  EXPECT_NE(messageOf(image).find("2 faces"), std::string::npos);
  image = plate.image();
  image.texel = image.texel.first(15);
  EXPECT_NE(messageOf(image).find("15 texels, expected"), std::string::npos);
  const auto broken = [&](auto change) {
    LitPlate bad(4);
    change(bad.texel[7]);
    return messageOf(bad.image());
  };
  for (const float v : {nan, inf, -1.0f}) {
    EXPECT_NE(broken([v](RsmTexel& t) { t.area = v; }).find("texel 7: its area"), std::string::npos) << v;
    EXPECT_NE(broken([v](RsmTexel& t) { t.flux.y = v; }).find("texel 7: its flux"), std::string::npos) << v;
  }
  EXPECT_NE(broken([nan](RsmTexel& t) { t.positionWorld.x = nan; }).find("position"), std::string::npos);
  EXPECT_NE(broken([](RsmTexel& t) { t.normal *= 2.0f; }).find("normal"), std::string::npos);
  // What sees nothing is not read.
  EXPECT_EQ(broken([nan](RsmTexel& t) { t = {glm::vec3(nan), 0.0f, glm::vec3(nan), glm::vec3(nan)}; }), "");
}

TEST(RsmImage, samplesAreSharedOutByFlux) {
  const LitPlate bright(64, {3, 3, 3}), dim(64, {1, 1, 1}), dark(64, {0, 0, 0}), faint(64, {1e-6f, 0, 0});
  const std::vector<RsmImage> images{bright.image(), dim.image(), dark.image(), faint.image()};
  const std::vector<RsmSample> samples = drawSamples(images, 100, 0);
  ASSERT_EQ(samples.size(), 101u) << "75 of the first, 25 of the second, one of what is nearly dark";
  // Together they send what the maps reflect.
  double sum = 0.0;
  for (const RsmSample& s : samples) sum += s.power.x;
  EXPECT_NEAR(sum, (4.0 * plateArea() * kPi + 0.25e-6) / kPi, 1e-5);
  // Another set is of other samples; the same set is the same.
  const std::vector<RsmSample> other = drawSamples(images, 100, 1), again = drawSamples(images, 100, 0);
  int same = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    EXPECT_EQ(samples[i].positionWorld, again[i].positionWorld);
    same += samples[i].positionWorld == other[i].positionWorld ? 1 : 0;
  }
  EXPECT_LT(same, 20);
}

// Coefficients at a place of a plate of radiance 1 that fills [-1, 1]² at height 0 and faces up, by brute force.
std::array<double, 9> quadrature(const glm::vec3& place) {
  std::array<double, 9> c{};
  constexpr int kSteps = 1000;
  for (int i = 0; i < kSteps * kSteps; ++i) {
    const double step = 2.0 / kSteps;
    const glm::vec3 x(static_cast<float>((i % kSteps + 0.5) * step - 1), 0.0f,
                      static_cast<float>((i / kSteps + 0.5) * step - 1));
    const glm::vec3 way = x - place;
    const double d = glm::length(way), solidAngle = step * step * -way.y / (d * d * d);
    std::array<float, 9> y;
    evaluateSh(3, way / static_cast<float>(d), y);
    for (std::size_t k = 0; k < 9; ++k) c[k] += solidAngle * y[k];
  }
  return c;
}

TEST(RsmFirstBounce, everyTexelIsTheQuadratureOfALitPlate) {
  const LitPlate plate(64, {1.0f, 0.5f, 0.25f});
  const std::vector<RsmImage> images{plate.image()};
  const std::vector<RsmSample> samples = drawSamples(images, 64 * 64, 0);
  ASSERT_EQ(samples.size(), 64u * 64u);
  const glm::vec3 colour = rgbToYCoCg({1.0f, 0.5f, 0.25f});
  for (const glm::vec3& place : {glm::vec3(0, 0.5f, 0), glm::vec3(0.3f, 1.0f, -0.8f), glm::vec3(2, 0.7f, 1)}) {
    std::array<float, 27> numbers{};
    for (const RsmSample& sample : samples) addSample(sample, place, nullptr, 0.0f, {3, 3}, numbers);
    const std::array<double, 9> expected = quadrature(place);
    for (std::size_t k = 0; k < 9; ++k) {
      EXPECT_NEAR(numbers[k], colour.x * expected[k], 0.005 * colour.x * expected[0]) << k;
      EXPECT_NEAR(numbers[9 + k], colour.y * expected[k], 0.005 * colour.x * expected[0]) << k;
      EXPECT_NEAR(numbers[18 + k], colour.z * expected[k], 0.005 * colour.x * expected[0]) << k;
    }
  }
  // Below it is dark, and however near one sample fills no more than pi sr with its radiance.
  std::array<float, 27> numbers{};
  addSample(samples[0], samples[0].positionWorld - glm::vec3(0.1f, 1, 0), nullptr, 0.0f, {3, 3}, numbers);
  EXPECT_EQ(numbers[0], 0.0f);
  const std::vector<RsmSample> one = drawSamples(images, 1, 0);
  for (float d = 1.0f; d > 1e-6f; d *= 0.5f) {
    numbers = {};
    addSample(one[0], one[0].positionWorld + glm::vec3(0, d, 0), nullptr, 0.0f, {3, 3}, numbers);
    EXPECT_LE(numbers[0], 1.0001 * colour.x * kPi * 0.2820948) << d;
  }
}

}  // namespace
}  // namespace relume
