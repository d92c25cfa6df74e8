// SPDX-License-Identifier: MIT
// The search for the least memory whose bake has an error, against errors that are laws; what is said of an error that
// the noise of its certificate hides.
#include "bake/budget/error_search.h"
#include "bake/budget/bake_to_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace relume {
namespace {

struct Searched {
  double foundMiB = 0.0;
  int bakes = 0;
};

Searched search(double maxError, double largestMiB, const std::function<double(double memoryMiB)>& errorOf) {
  ErrorSearch search(maxError, largestMiB);
  Searched searched;
  while (!search.isOver() && searched.bakes < 100) {
    EXPECT_LE(search.memoryMiB(), largestMiB);
    search.note(errorOf(search.memoryMiB()));
    ++searched.bakes;
  }
  searched.foundMiB = search.foundMiB();
  return searched;
}

TEST(ErrorSearch, findsLittleMoreThanItTakes) {
  for (const double power : {0.15, 0.3, 0.5}) {
    for (double needed = 2.5; needed < 900.0; needed *= 1.37) {
      const auto law = [&](double memory) { return 0.1 * std::pow(needed / memory, power); };
      const Searched found = search(0.1, 1024.0, law);
      EXPECT_GE(found.foundMiB, 0.999 * needed);
      EXPECT_LE(found.foundMiB, 4.0 * needed) << power << ", " << needed;
      EXPECT_LE(found.bakes, 12) << power << ", " << needed;
    }
  }
  EXPECT_LE(search(0.1, 1024.0, [](double memory) { return 0.1 * std::pow(100.0 / memory, 0.3); }).bakes, 5);
}

TEST(ErrorSearch, startsSmallAndEndsAtTheLargest) {
  const Searched easy = search(0.5, 1024.0, [](double) { return 0.1; });
  EXPECT_EQ(easy.bakes, 1);
  EXPECT_LE(easy.foundMiB, 4.0);
  EXPECT_EQ(search(0.5, 0.5, [](double) { return 0.1; }).foundMiB, 0.5);
  double largest = 0.0;
  const Searched never = search(0.01, 50.0, [&](double memory) {
    largest = memory;
    return 0.1;
  });
  EXPECT_EQ(never.foundMiB, 0.0);
  EXPECT_EQ(largest, 50.0);
}

// Certificates have noise: an error that does not fall, or falls and rises again, ends the search as well.
TEST(ErrorSearch, endsWhateverTheErrors) {
  int calls = 0;
  const Searched up = search(0.1, 1024.0, [&](double) { return ++calls % 3 == 0 ? 0.09 : 0.2; });
  EXPECT_GT(up.foundMiB, 0.0);
  EXPECT_LE(up.bakes, 8);
  EXPECT_EQ(search(0.1, 1024.0, [](double) { return 1e30; }).foundMiB, 0.0);
}

// The warnings of a bake to an error whose certificate is this.
std::string warningsOf(float maxError, std::vector<float> squaredError, std::vector<float> standardError) {
  std::string warnings;
  Context context;
  context.onMessage = [&](Severity severity, std::string_view text) {
    if (severity == Severity::warning) warnings += text;
  };
  BakeOptions asked;
  asked.budget = {1.0f, 0.0f, maxError};
  const Result<Bake> baked = bakeToError(asked, context, [&](const BakeOptions&) -> Result<Bake> {
    Bake bake;
    bake.certificate.lightKind = std::vector<std::uint32_t>(squaredError.size(), 1);
    bake.certificate.squaredError = squaredError;
    bake.certificate.standardError = standardError;
    return bake;
  });
  EXPECT_TRUE(baked) << baked.error().message;
  return warnings;
}

TEST(ErrorSearch, boundsBelowTheNoiseAreMetWithAWarning) {
  // The middle is below 0, its standard error that of an error of 2 %; lights that are not the middle have others.
  const std::vector<float> squared = {0.04f, -0.0001f, -0.02f}, deviation = {0.01f, 0.0004f, 0.01f};
  const std::string warned = warningsOf(0.001f, squared, deviation);
  EXPECT_NE(warned.find("(--max-error) is 0.001,"), std::string::npos) << warned;
  EXPECT_NE(warned.find("noise is as large as an error of 2.0 %"), std::string::npos) << warned;
  EXPECT_EQ(warningsOf(0.03f, squared, deviation), "") << "a bound that the certificate can tell";
  // Of an even number of lights the two in the middle; of an error above the noise nothing is said.
  EXPECT_NE(warningsOf(0.01f, {-0.1f, 0.0f, 0.0001f, 0.1f}, {1.0f, 0.0001f, 0.0003f, 1.0f}).find("an error of 1.4 %"),
            std::string::npos);
  EXPECT_EQ(warningsOf(0.5f, {0.01f}, {0.0001f}), "");
}

}  // namespace
}  // namespace relume
