// SPDX-License-Identifier: MIT
// Progress of the whole work: by the stages' shares, never back.
#include "tools/base/overall_progress.h"

#include <gtest/gtest.h>

namespace relume {
namespace {

TEST(OverallProgress, stagesCountByTheirShare) {
  OverallProgress progress(ProgressPlan{{{"a", 1.0}, {"b", 3.0}}});
  EXPECT_DOUBLE_EQ(progress.update("a", 0.5), 0.125);
  EXPECT_DOUBLE_EQ(progress.update("b", 0.0), 0.25);
  EXPECT_DOUBLE_EQ(progress.update("b", 1.0), 1.0);
}

TEST(OverallProgress, neverStepsBack) {
  OverallProgress progress(ProgressPlan{{{"a", 1.0}, {"b", 1.0}}});
  progress.update("b", 0.5);
  EXPECT_DOUBLE_EQ(progress.update("a", 0.1), 0.75) << "a stage that comes again";
  EXPECT_DOUBLE_EQ(progress.update("b", 0.2), 0.75);
  EXPECT_DOUBLE_EQ(progress.update("inside b", 0.9), 0.75) << "not in the plan";
}

TEST(OverallProgress, timeLeftFollowsThePace) {
  OverallProgress progress(ProgressPlan{{{"a", 1.0}, {"b", 3.0}}});
  EXPECT_EQ(progress.secondsLeft(5.0), 0.0) << "nothing is known yet";
  progress.update("a", 1.0);
  EXPECT_DOUBLE_EQ(progress.secondsLeft(5.0), 15.0);
  progress.update("b", 1.0);
  EXPECT_EQ(progress.secondsLeft(20.0), 0.0);
  EXPECT_FALSE(OverallProgress().known());
}

// More of an option makes its stage's share larger, and a second bake doubles the work.
TEST(OverallProgress, plansFollowTheOptions) {
  const auto share = [](const BakeOptions& options, bool verify, const std::string& stage) {
    OverallProgress progress(planBake(options, verify));
    const double before = progress.update(stage, 0.0);
    return progress.update(stage, 1.0) - before;
  };
  BakeOptions options, rays;
  rays.links.raysPerCache *= 4;
  EXPECT_GT(share(rays, false, "links"), share(options, false, "links"));
  EXPECT_GT(share(options, false, "links"), 0.4) << "most of a bake of the preset high";
  EXPECT_NEAR(share(options, true, "links"), 0.5 * share(options, false, "links"), 0.01);
  for (const char* stage : {"import", "play space", "surfels", "hierarchy", "caches", "links", "provenance"})
    EXPECT_GT(share(options, false, stage), 0.0) << stage;
}

}  // namespace
}  // namespace relume
