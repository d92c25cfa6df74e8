// SPDX-License-Identifier: MIT
// The cut alone under lights that no bake knew, on the large level: against every visible leaf, at n_L 254. Long.
#include "tests/links/cut_level.h"
#include "tests/long_tests.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

namespace relume::test {
namespace {

struct Bound {
  const char* suite;
  double median, worst;  // of the relative RMSE over caches
};

TEST(Untrained, cutAloneStaysWithinItsBoundsUnderSunsSpotsAndTorches) {
  if (!test::longTests()) GTEST_SKIP() << "a long test: set RELUME_LONG_TESTS=1";
  const std::filesystem::path path = std::filesystem::path(RELUME_SHARED_DIR) / "scenes/sponza/sponza.glb";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " does not exist: set RELUME_SHARED_DIR";

  Context context;
  const auto level = loadCutLevel(path.string(), BakeOptions{}, context);
  ASSERT_TRUE(level) << level.error().message;
  const CutReads cut = cutCaches(**level, {});
  EXPECT_LE(cut.max, 254u);
  const Reads leaves = leafReads(**level);
  // A spot that lights some dozen surfels has its worst case at the edge of the patch: docs/notes/cuts.md.
  const Bound bounds[] = {{"suns", 0.04, 0.12}, {"spots", 0.06, 0.16}, {"torch", 0.04, 0.05}};
  const std::vector<LightSuite> suites = untrainedLights(**level, context);
  ASSERT_EQ(suites.size(), std::size(bounds));
  for (std::size_t s = 0; s < suites.size(); ++s) {
    const LitSenders& lit = suites[s].lit;
    ASSERT_EQ(suites[s].name, bounds[s].suite);
    EXPECT_GE(lit.count(), 12u) << suites[s].name;
    const std::vector<double> exact = irradiance(**level, leaves, (*level)->hierarchy.firstWeight, lit);
    const SuiteError e =
        summarize(compareCaches(irradiance(**level, cut.reads, cut.firstWeight, lit), exact, lit.count()), lit.name);
    EXPECT_LE(e.medianRmse, bounds[s].median) << suites[s].name;
    EXPECT_LE(e.worstRmse, bounds[s].worst) << e.worst;
    EXPECT_NEAR(e.medianEnergy, 1.0, 0.02) << suites[s].name;
    EXPECT_NEAR(e.worstEnergy, 1.0, 0.02) << suites[s].name;
  }
}

}  // namespace
}  // namespace relume::test
