// SPDX-License-Identifier: MIT
// Compact links: how exactly codes stand for numbers, and that rows keep their sums.
#include "formats/compact_links.h"
#include "formats/pack.h"
#include "formats/sh.h"
#include "tests/formats/random_direction.h"
#include "tests/formats/small_bake.h"

#include <gtest/gtest.h>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace relume {
namespace {

TEST(CompactLinks, transfersKeepNineBitsOverTwentyTwoPowersOfTwo) {
  for (float f = 1.2f; f > 6.2e-5f; f *= 0.997f) EXPECT_NEAR(unpackTransfer(packTransfer(f)), f, f / 511.0f);
  for (std::uint32_t code = 0; code < 0x1000; ++code) {
    EXPECT_EQ(packTransfer(unpackTransfer(code)), code);
    if (code > 0) {
      EXPECT_GT(unpackTransfer(code), unpackTransfer(code - 1));
    }
  }
  EXPECT_EQ(unpackTransfer(0), 0.0f);
  EXPECT_LT(unpackTransfer(0xFFF), 2.0f);
  EXPECT_EQ(packTransfer(50.0f), 0xFFFu);
  EXPECT_EQ(packTransfer(-1.0f), 0u);
  EXPECT_EQ(packTransfer(std::numeric_limits<float>::quiet_NaN()), 0u);
}

// As the maths library rounds: eight bits after the leading one, below 2^-14 multiples of 2^-22, ties to even.
TEST(CompactLinks, transfersRoundToTheNearestCodeAndTiesToEven) {
  const auto rounded = [](float f) {
    const int exponent = std::max(std::ilogb(f), -14);
    return std::min(std::ldexp(std::nearbyint(std::ldexp(f, 8 - exponent)), exponent - 8), 1.99609375f);
  };
  for (std::uint32_t bits = 0x32000000u; bits < 0x40000000u; bits += 997) {
    const auto f = std::bit_cast<float>(bits);
    ASSERT_EQ(unpackTransfer(packTransfer(f)), rounded(f)) << f;
  }
  for (std::uint32_t code = 0; code + 1 < 0x1000; ++code) {
    const float tie = 0.5f * (unpackTransfer(code) + unpackTransfer(code + 1));
    ASSERT_EQ(packTransfer(tie), code + code % 2) << tie;
  }
}

TEST(CompactLinks, shapesStayNearTheirDirectionsAndCones) {
  std::mt19937 random(4);
  double worst8 = 0.0, worst6 = 0.0;
  std::vector<glm::vec3> directions = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (int i = 0; i < 20000; ++i) directions.push_back(randomDirection(random));
  for (const glm::vec3& d : directions) {
    const float cosAlpha = 1.0f - 2.0f * std::pow(static_cast<float>(random() % 1001) / 1000.0f, 2.0f);
    const LinkDirection eight = unpackShape8(packShape8({d, cosAlpha})), six = unpackShape6(packShape6({d, cosAlpha}));
    worst8 = std::max(worst8, static_cast<double>(glm::length(eight.direction - d)));
    worst6 = std::max(worst6, static_cast<double>(glm::length(six.direction - d)));
    EXPECT_NEAR(glm::length(six.direction), 1.0f, 1e-6f);
    // Half a step of q, by the slope 4 q / most².
    const float open = std::sqrt(0.5f - 0.5f * cosAlpha);
    EXPECT_NEAR(eight.cosAlpha, cosAlpha, 2.0f * (open + 0.002f) / 255.0f);
    EXPECT_NEAR(six.cosAlpha, cosAlpha, 2.0f * (open + 0.04f) / 15.0f);
  }
  EXPECT_LT(worst8, 0.0009);
  EXPECT_LT(worst6, 0.058);
  EXPECT_LT(packShape6({{0.6f, 0, -0.8f}, -1.0f}), 1u << 16);
}

TEST(CompactLinks, everyCodeOfAShapeIsAUnitDirectionAndACone) {
  for (std::uint32_t bits = 0; bits < 1u << 16; ++bits) {
    const LinkDirection d = unpackShape6(bits);
    ASSERT_NEAR(glm::length(d.direction), 1.0f, 1e-5f) << bits;
    ASSERT_GE(d.cosAlpha, -1.0f);
    ASSERT_LE(d.cosAlpha, 1.0f);
  }
}

TEST(CompactLinks, aRowKeepsItsSum) {
  std::mt19937 random(8);
  CompactLinkWriter writer(LinkKind::irradiance);
  writer.beginRow();
  double exact = 0.0, stored = 0.0;
  for (std::uint32_t i = 0; i < 254; ++i) {
    const float f = 0.01f * static_cast<float>(random() % 1000 + 1) / 1000.0f;
    exact += f;
    writer.add(i, f);
    stored += unpackTransfer(writer.head.back() >> 20);
    EXPECT_EQ(writer.head.back() & 0xFFFFFu, i);
  }
  EXPECT_NEAR(stored, exact, 1e-5);
}

Links randomLinks(LinkKind kind, std::uint32_t bands, std::uint32_t count) {
  std::mt19937 random(11);
  std::vector<std::uint32_t> node;
  std::vector<ConeLink> cone;
  std::vector<std::uint16_t> sh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const float f = 0.02f * static_cast<float>(random() % 100 + 1) / 100.0f,
                cosAlpha = 1.0f - static_cast<float>(random() % 1000) / 700.0f;
    const glm::vec3 d = randomDirection(random);
    node.push_back(7 * i);
    cone.push_back({7 * i, packHalf(f), packHalf(cosAlpha), packOctahedral(d)});
    std::array<float, kMaxCoefficients> y;
    std::array<float, kMaxBands> ratio;
    evaluateSh(kMaxBands, d, y);
    coneBandRatios(kMaxBands, cosAlpha, ratio);
    for (std::uint32_t l = 0; l < bands; ++l) {
      for (std::uint32_t k = l * l; k < (l + 1) * (l + 1); ++k) sh.push_back(packHalf(f * ratio[l] * y[k] / y[0]));
    }
  }
  Links links;
  links.kind = kind;
  links.rowBegin = std::vector<std::uint32_t>{0, count / 3, count};
  if (kind == LinkKind::cone) {
    links.cone = cone;
  } else {
    links.bands = bands;
    links.shNode = node;
    links.shCoefficients = sh;
  }
  return links;
}

double rmsError(const Links& a, const Links& b, int bands) {
  double error = 0.0, square = 0.0;
  std::array<float, kMaxCoefficients> ca, cb;
  for (std::uint32_t i = 0; i < a.count(); ++i) {
    EXPECT_EQ(a.node(i), b.node(i));
    linkCoefficients(a, i, false, bands, ca);
    linkCoefficients(b, i, false, bands, cb);
    for (int k = 0; k < bands * bands; ++k) {
      error += std::pow(ca[static_cast<std::size_t>(k)] - cb[static_cast<std::size_t>(k)], 2.0);
      square += std::pow(ca[static_cast<std::size_t>(k)], 2.0);
    }
  }
  return std::sqrt(error / square);
}

TEST(CompactLinks, packedLinksStandForNearlyTheSameCoefficients) {
  const Links cone = randomLinks(LinkKind::cone, 0, 301);
  EXPECT_LT(rmsError(cone, *compactLinks(cone), 4), 0.07);
}

// Relative distance of the sums of a row's coefficients: what a cache errs by when all its senders are alike.
double sumError(const Links& a, const Links& b) {
  std::array<double, 16> sum{}, off{};
  std::array<float, kMaxCoefficients> ca, cb;
  for (std::uint32_t i = 0; i < a.count(); ++i) {
    linkCoefficients(a, i, false, 4, ca);
    linkCoefficients(b, i, false, 4, cb);
    for (std::size_t k = 0; k < 16; ++k) {
      sum[k] += ca[k];
      off[k] += cb[k] - ca[k];
    }
  }
  double error = 0.0, square = 0.0;
  for (std::size_t k = 0; k < 16; ++k) {
    error += off[k] * off[k];
    square += sum[k] * sum[k];
  }
  return std::sqrt(error / square);
}

TEST(CompactLinks, errorsOfARowOfShapedLinksCancel) {
  // Links that are cones: as SH of four bands they are exactly what oct6 can nearly say.
  const Links cone = randomLinks(LinkKind::cone, 0, 240);
  Links sh;
  sh.kind = LinkKind::sh;
  sh.bands = 4;
  std::vector<std::uint32_t> node;
  std::vector<std::uint16_t> halves;
  std::array<float, kMaxCoefficients> c;
  for (std::uint32_t i = 0; i < cone.count(); ++i) {
    node.push_back(cone.node(i));
    linkCoefficients(cone, i, false, 4, c);
    for (std::size_t k = 0; k < 16; ++k) halves.push_back(packHalf(c[k]));
  }
  sh.rowBegin = cone.rowBegin;
  sh.shNode = node;
  sh.shCoefficients = halves;
  const Links shaped = *compactLinks(sh), nearest = *compactLinks(cone);
  EXPECT_LT(rmsError(cone, shaped, 4), 0.2);
  EXPECT_LT(sumError(cone, shaped), 0.75 * sumError(cone, nearest));
}

TEST(CompactLinks, otherPairsOfKindsAndTooManyNodesAreRefused) {
  Links cone = randomLinks(LinkKind::cone, 0, 9);
  EXPECT_EQ(compactLinks(randomLinks(LinkKind::sh, 3, 9)).error().code, ErrorCode::unsupported);
  EXPECT_EQ(compactLinks(*compactLinks(cone)).error().code, ErrorCode::unsupported);
  std::vector<ConeLink> links = cone.cone.toVector();
  links.back().node = kMaxCompactNodes;
  cone.cone = links;
  const Result<Links> packed = compactLinks(cone);
  ASSERT_FALSE(packed);
  EXPECT_NE(packed.error().message.find("1048576"), std::string::npos) << packed.error().message;
}

}  // namespace
}  // namespace relume
