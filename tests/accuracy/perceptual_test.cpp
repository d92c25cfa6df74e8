// SPDX-License-Identifier: MIT
// Perceptual differences against published values and properties.
#include "tools/images/perceptual.h"
#include "tools/images/visible_difference.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <numeric>

namespace relume {
namespace {

using Picture = std::vector<glm::vec3>;
constexpr std::uint32_t kSide = 32;

Picture uniform(const glm::vec3& color) { return Picture(kSide * kSide, color); }
double mean(const std::vector<float>& e) {
  return std::accumulate(e.begin(), e.end(), 0.0) / static_cast<double>(e.size());
}
std::vector<float> flipOf(const Picture& a, const Picture& b) { return flip(kSide, kSide, a, b); }

// A bright square, moved right by `by` pixels.
Picture square(std::uint32_t by, float bright) {
  Picture p = uniform(glm::vec3(0.05f));
  for (std::uint32_t y = 10; y < 20; ++y) {
    for (std::uint32_t x = 8 + by; x < 18 + by; ++x) p[y * kSide + x] = glm::vec3(bright);
  }
  return p;
}

TEST(Lab, HasTheValuesOfThePrimaries) {
  const std::pair<glm::dvec3, glm::dvec3> kKnown[] = {{{1, 1, 1}, {100, 0, 0}},
                                                      {{1, 0, 0}, {53.24, 80.09, 67.20}},
                                                      {{0, 1, 0}, {87.73, -86.18, 83.18}},
                                                      {{0, 0, 1}, {32.30, 79.19, -107.86}},
                                                      {{0.2140411, 0.2140411, 0.2140411}, {53.39, 0, 0}},
                                                      {{0, 0, 0}, {0, 0, 0}}};
  for (const auto& [rgb, lab] : kKnown) {
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(labOf(rgb)[k], lab[k], 0.02);
  }
}

TEST(Lab, RmseIsTheDistanceOfUniformPictures) {
  const double distance = glm::length(labOf({1, 0, 0}) - labOf({0, 1, 0}));
  EXPECT_NEAR(labRmse(uniform({1, 0, 0}), uniform({0, 1, 0})), distance, 1e-4);
  // A quarter of the pixels: half the root.
  Picture quarter = uniform({1, 0, 0});
  std::fill_n(quarter.begin(), kSide * kSide / 4, glm::vec3(0, 1, 0));
  EXPECT_NEAR(labRmse(uniform({1, 0, 0}), quarter), 0.5 * distance, 1e-4);
  EXPECT_EQ(labRmse(quarter, quarter), 0.0);
}

TEST(Flip, IsNothingForTheSamePicture) {
  for (const float e : flipOf(square(0, 0.9f), square(0, 0.9f))) EXPECT_EQ(e, 0.0f);
}

TEST(Flip, IsOneBetweenGreenAndBlue) {
  for (const float e : flipOf(uniform({0, 1, 0}), uniform({0, 0, 1}))) EXPECT_NEAR(e, 1.0f, 1e-5f);
}

// HyAB of black and white is 100, of green and blue after Hunt 203.1: 0.95 + 0.05 (100^0.7 - 0.4 c) / (0.6 c) with
// c = 203.1^0.7 = 41.28.
TEST(Flip, OfBlackAndWhiteFollowsFromTheFormula) {
  for (const float e : flipOf(uniform(glm::vec3(0)), uniform(glm::vec3(1)))) EXPECT_NEAR(e, 0.9674f, 5e-4f);
}

TEST(Flip, IsSymmetric) {
  const std::vector<float> there = flipOf(square(0, 0.9f), square(3, 0.5f)),
                           back = flipOf(square(3, 0.5f), square(0, 0.9f));
  for (std::size_t i = 0; i < there.size(); ++i) EXPECT_NEAR(there[i], back[i], 1e-6f);
}

TEST(Flip, StaysBetweenNothingAndOneAndGrowsWithTheDifference) {
  double last = 0.0;
  for (const float bright : {0.06f, 0.1f, 0.2f, 0.4f, 0.8f}) {
    const std::vector<float> e = flipOf(square(0, 0.05f), square(0, bright));
    for (const float each : e) {
      EXPECT_GE(each, 0.0f);
      EXPECT_LE(each, 1.0f);
    }
    EXPECT_GT(mean(e), last);
    last = mean(e);
  }
}

// The same change of brightness is worse where it makes an edge.
TEST(Flip, WeighsEdgesMoreThanFlatChanges) {
  const std::vector<float> flat = flipOf(uniform(glm::vec3(0.05f)), uniform(glm::vec3(0.09f)));
  const std::vector<float> edge = flipOf(square(0, 0.05f), square(0, 0.09f));
  EXPECT_GT(*std::max_element(edge.begin(), edge.end()), 1.1f * *std::max_element(flat.begin(), flat.end()));
}

// Noise that the eye averages out at this distance counts less than the same amplitude in one piece.
TEST(Flip, FiltersFineColourNoise) {
  Picture noise = uniform({0.3f, 0.3f, 0.3f}), patch = noise;
  for (std::uint32_t i = 0; i < noise.size(); ++i) {
    const bool on = (i % kSide + i / kSide) % 2 == 0;
    noise[i].b += on ? 0.2f : -0.2f;
    patch[i].b += i < noise.size() / 2 ? 0.2f : -0.2f;
  }
  EXPECT_LT(mean(flipOf(uniform(glm::vec3(0.3f)), noise)), 0.25 * mean(flipOf(uniform(glm::vec3(0.3f)), patch)));
}

// Large pictures are worked on in tiles: what lies across a seam differs as it does elsewhere.
TEST(Flip, aDifferenceAcrossTilesIsThatWithinOne) {
  constexpr std::uint32_t kWidth = 1100, kHeight = 40;
  const auto errorOf = [&](std::uint32_t left) {
    Picture a(kWidth * kHeight, glm::vec3(0.3f)), b = a;
    for (std::uint32_t y = 10; y < 30; ++y) {
      for (std::uint32_t x = left; x < left + 20; ++x) b[y * kWidth + x] = glm::vec3(0.9f, 0.2f, 0.1f);
    }
    return flip(kWidth, kHeight, a, b);
  };
  const std::vector<float> within = errorOf(200), across = errorOf(502);  // tiles have 512 pixels a side
  EXPECT_GT(*std::max_element(within.begin(), within.end()), 0.3f);
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    for (std::uint32_t x = 150; x < 270; ++x)
      ASSERT_EQ(within[y * kWidth + x], across[y * kWidth + x + 302]) << x << ' ' << y;
  }
}

std::size_t seenOf(const Picture& a, const Picture& b, const ObserverOptions& options = {}) {
  const std::vector<std::uint8_t> seen = visiblyDifferent(kSide, kSide, a, b, options);
  return static_cast<std::size_t>(std::count(seen.begin(), seen.end(), 1));
}
constexpr std::size_t kAll = kSide * kSide;

TEST(VisibleDifference, ThresholdsAreTheTables) {
  // Pieces of the table meet, but for what its own digits leave.
  for (const double log : {-3.94, -1.44, -0.0184, 1.9}) {
    const double below = thresholdOfLuminance(std::pow(10.0, log - 1e-6)),
                 above = thresholdOfLuminance(std::pow(10.0, log + 1e-6));
    EXPECT_NEAR(below / above, 1.0, 0.03) << log;
  }
  EXPECT_NEAR(thresholdOfLuminance(1e-6), std::pow(10.0, -2.86), 1e-9);
  EXPECT_NEAR(thresholdOfLuminance(1000.0), std::pow(10.0, 3.0 - 1.255), 1e-9);
  // At 100 cd/m² the eye tells stripes of 3 to 4 a degree apart best.
  double best = 0.0, at = 0.0;
  for (double f = 0.5; f < 30.0; f += 0.01) {
    if (contrastSensitivity(f, 100.0) <= best) continue;
    best = contrastSensitivity(f, 100.0);
    at = f;
  }
  EXPECT_NEAR(at, 3.248, 0.01);
}

TEST(VisibleDifference, OfGreyBeginsAtTheThreshold) {
  const float ground = 0.5f, step = static_cast<float>(thresholdOfLuminance(50.0)) / 100.0f;
  const auto grey = [](float l) { return uniform(glm::vec3(l)); };
  EXPECT_EQ(seenOf(grey(ground), grey(ground)), 0u);
  EXPECT_EQ(seenOf(grey(ground), grey(ground + 0.97f * step)), 0u);
  EXPECT_EQ(seenOf(grey(ground), grey(ground + 1.05f * step)), kAll);
  // A dimmer screen, on which the step is a smaller part of what is seen
  EXPECT_EQ(seenOf(grey(ground), grey(ground + 1.05f * step), {.whiteLuminance = 10.0}), 0u);
}

TEST(VisibleDifference, OfColorIsSeenInTheLight) {
  // Of one luminance
  const glm::vec3 reddish(0.5f, 0.3f, 0.3f), greyish(glm::vec3(0.2126729f * 0.5f + 0.7873271f * 0.3f));
  EXPECT_EQ(seenOf(uniform(reddish), uniform(greyish)), kAll);
  EXPECT_EQ(seenOf(uniform(1e-4f * reddish), uniform(1e-4f * greyish)), 0u);
  EXPECT_EQ(seenOf(uniform(reddish), uniform(reddish + 1e-4f)), 0u);
}

TEST(VisibleDifference, APatternHidesAnother) {
  // Stripes two pixels wide, and a step that a plain ground shows.
  const float step = 1.3f * static_cast<float>(thresholdOfLuminance(40.0)) / 100.0f;
  Picture plain = uniform(glm::vec3(0.4f)), striped = plain, more, moreStriped;
  for (std::size_t i = 0; i < kAll; ++i) striped[i] = glm::vec3((i / 2) % 2 == 0 ? 0.1f : 0.7f);
  for (std::size_t i = 0; i < kAll; ++i) {
    more.push_back(plain[i] + step);
    moreStriped.push_back(striped[i] + step);
  }
  EXPECT_EQ(seenOf(plain, more), kAll);
  EXPECT_LT(seenOf(striped, moreStriped), kAll / 10);
  // Where a square has moved, it is seen, and nowhere else.
  const Picture here = square(0, 0.9f), there = square(3, 0.9f);
  const std::size_t moved = seenOf(here, there);
  EXPECT_GE(moved, 60u);
  EXPECT_LT(moved, 200u);
}

}  // namespace
}  // namespace relume
