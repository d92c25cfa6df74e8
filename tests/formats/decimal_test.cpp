// SPDX-License-Identifier: MIT
// Numbers as text: what printf would write in the C locale, in any locale.
#include "formats/decimal.h"
#include "formats/validate.h"

#include "tests/comma_locale.h"
#include "tests/formats/small_bake.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <limits>

namespace relume {
namespace {

const double kNumbers[] = {0.0, -0.0, 0.1, 1.0, -2.5, 1e-6, 1234567.0, 1e300, 5e-324, 0.30000000000000004};

std::string printfOf(const char* pattern, int digits, double value) {
  char text[400];
  std::snprintf(text, sizeof text, pattern, digits, value);
  return text;
}

TEST(Decimal, isWhatPrintfWritesInTheCLocale) {
  for (const double v : kNumbers) {
    for (const int digits : {1, 6, 17}) EXPECT_EQ(decimalGeneral(v, digits), printfOf("%.*g", digits, v));
  }
  EXPECT_EQ(decimal(0.1), "0.1");
  EXPECT_EQ(decimal(0.1f), "0.1");
  EXPECT_EQ(decimal(std::numeric_limits<float>::infinity()), "inf");
  EXPECT_EQ(decimal(std::nan("")), "nan");
}

TEST(Decimal, readsBackWhatItWrites) {
  for (const double v : kNumbers) EXPECT_EQ(std::strtod(decimal(v).c_str(), nullptr), v);
}

TEST(Decimal, literalsOfGlslAreFloats) {
  EXPECT_EQ(decimalGlsl(0.5f), "0.5");
  EXPECT_EQ(decimalGlsl(1.0f), "1.0");
  EXPECT_EQ(hexadecimal(0), "0000000000000000");
  EXPECT_EQ(hexadecimal(0x0123456789abcdefu), "0123456789abcdef");
  EXPECT_EQ(decimalGlsl(0.0f), "0.0");
  EXPECT_EQ(decimalGlsl(1e-7f), "1e-07");
}

TEST(Decimal, aHostsCommasChangeNothing) {
  // A number in each kind of finding that has one.
  Bake broken = makeSmallBake();
  std::vector<glm::vec3> normal = broken.surfels.normal.toVector(), albedo = broken.surfels.albedo.toVector();
  normal[0] = {0.25f, 0.5f, 1.5f};
  albedo[1] = {0.5f, 1.25f, 0.0f};
  broken.surfels.normal = std::move(normal);
  broken.surfels.albedo = std::move(albedo);
  broken.surfels.areaEach = 1e30f;
  const auto texts = [&] {
    std::vector<std::string> all = {decimal(1234.5), decimal(0.5f), decimalGeneral(1234.5, 6), decimalGlsl(0.5f)};
    for (const Finding& finding : validateBake(broken)) all.push_back(toString(finding));
    return all;
  };
  const std::vector<std::string> before = texts();
  ASSERT_GE(before.size(), 6u) << "the broken bake must have findings with numbers";
  const test::CommaLocale commas;
  EXPECT_EQ(texts(), before);
  if (!commas.ofC()) GTEST_SKIP() << test::kNoCommaLocale;
}

}  // namespace
}  // namespace relume
