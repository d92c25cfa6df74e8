// SPDX-License-Identifier: MIT
#include "bake/links/directions.h"
#include "formats/sh.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace relume {
namespace {

const glm::vec3 kTilted = glm::normalize(glm::vec3(0.3f, -0.8f, 0.5f));

std::vector<DirectionStrata::Sample> samplesOf(const DirectionStrata& strata, const glm::vec3& normal,
                                               std::uint64_t item) {
  DirectionStrata::Sequence sequence(strata, normal, RandomStream(7, 1, item));
  std::vector<DirectionStrata::Sample> samples(strata.count());
  for (std::size_t i = 0; i < samples.size(); i += DirectionStrata::kBlock) {
    sequence.next(std::span(samples).subspan(i).first<DirectionStrata::kBlock>());
  }
  return samples;
}

TEST(Directions, countIsRoundedDownToWholeTiles) {
  for (std::uint32_t rays = 16; rays < 5000; ++rays) {
    const DirectionStrata strata(rays);
    EXPECT_EQ(strata.count() % 16, 0u);
    EXPECT_LE(strata.count(), rays);
    EXPECT_GE(strata.count() * 2, rays) << rays;
  }
  EXPECT_EQ(DirectionStrata(4096).count(), 4096u);
  EXPECT_EQ(DirectionStrata(1u << 20).count(), 1u << 20);
}

TEST(Directions, areUnitVectorsAboveTheSurfaceWithTheirCosine) {
  for (const float evenShare : {0.0f, 0.5f, 1.0f}) {
    for (const auto& s : samplesOf(DirectionStrata(1024, evenShare), kTilted, 3)) {
      EXPECT_NEAR(glm::length(s.direction), 1.0f, 2e-6f);
      EXPECT_NEAR(glm::dot(s.direction, kTilted), s.cosine, 2e-6f);
      EXPECT_GE(s.cosine, 0.0f);
      EXPECT_GT(s.weight, 0.0f);
      EXPECT_TRUE(std::isfinite(s.weight));
    }
  }
}

// The integrals over the hemisphere of 1, cosine and cosine² are 2 pi, pi and 2 pi / 3; weights carry 1 / pi.
TEST(Directions, hemisphereIntegratesPowersOfTheCosine) {
  for (const float evenShare : {0.1f, 0.5f, 1.0f}) {
    double zero = 0, one = 0, two = 0;
    for (const auto& s : samplesOf(DirectionStrata(16384, evenShare), kTilted, 11)) {
      zero += s.weight;
      one += double{s.weight} * s.cosine;
      two += double{s.weight} * s.cosine * s.cosine;
    }
    EXPECT_NEAR(zero, 2.0, evenShare < 0.5f ? 2e-2 : 1e-3) << evenShare;
    EXPECT_NEAR(one, 1.0, 5e-4) << evenShare;
    EXPECT_NEAR(two, 2.0 / 3.0, 5e-4) << evenShare;
  }
}

// Every basis function but the first integrates to zero over the sphere, and their squares to one.
TEST(Directions, sphereIsOrthonormalForSphericalHarmonics) {
  std::array<double, 16> mean{}, square{};
  std::array<float, 16> y;
  for (const auto& s : samplesOf(DirectionStrata(16384), glm::vec3(0.0f), 5)) {
    evaluateSh(4, s.direction, y);
    for (int i = 0; i < 16; ++i) {
      mean[i] += std::numbers::pi * s.weight * y[i];
      square[i] += std::numbers::pi * s.weight * y[i] * y[i];
    }
  }
  for (int i = 0; i < 16; ++i) {
    EXPECT_NEAR(mean[i], i == 0 ? std::sqrt(4 * std::numbers::pi) : 0.0, 2e-3) << i;
    EXPECT_NEAR(square[i], 1.0, 5e-3) << i;
  }
}

// Stratified: every octant of the sphere and every quarter of the hemisphere has its share, far closer than by chance.
TEST(Directions, areStratified) {
  const auto sphere = samplesOf(DirectionStrata(4096), glm::vec3(0.0f), 9);
  int count[8] = {};
  for (const auto& s : sphere) ++count[(s.direction.x > 0) + 2 * (s.direction.y > 0) + 4 * (s.direction.z > 0)];
  for (const int n : count) EXPECT_NEAR(n, 512, 30);  // by chance: a standard deviation of 21
  const auto half = samplesOf(DirectionStrata(4096, 1.0f), glm::vec3(0, 0, 1), 9);
  int low = 0;
  for (const auto& s : half) low += s.direction.z < 0.5f;
  EXPECT_NEAR(low, 2048, 60);  // by chance: 32
}

TEST(Directions, packetsOfSixteenStayTogether) {
  for (const glm::vec3& normal : {glm::vec3(0.0f), kTilted}) {
    const auto samples = samplesOf(DirectionStrata(4096), normal, 2);
    double widest = 0;
    for (std::size_t tile = 0; tile < samples.size(); tile += 16) {
      for (std::size_t i = 1; i < 16; ++i) {
        const double cosine = glm::dot(samples[tile].direction, samples[tile + i].direction);
        widest = std::max(widest, std::acos(std::min(cosine, 1.0)));
      }
    }
    EXPECT_LT(widest, 0.55);  // 256 tiles of the sphere are about 0.22 rad wide
  }
}

TEST(Directions, dependOnTheItemAlone) {
  const DirectionStrata strata(256);
  const auto a = samplesOf(strata, kTilted, 1), again = samplesOf(strata, kTilted, 1),
             b = samplesOf(strata, kTilted, 2);
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].direction, again[i].direction);
    EXPECT_NE(a[i].direction, b[i].direction);
  }
}

}  // namespace
}  // namespace relume
