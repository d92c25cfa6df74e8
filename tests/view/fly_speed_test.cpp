// SPDX-License-Identifier: MIT
// How fast a camera flies: by the level's size, by the wheel, and within limits.
#include "tools/view/fly_speed.h"

#include <gtest/gtest.h>

#include <limits>

namespace relume {
namespace {

FlySpeed speedIn(float diagonal) {
  FlySpeed speed;
  speed.fit(diagonal);
  return speed;
}

TEST(FlySpeed, aLevelTwiceAsLargeIsFlownThroughInTheSameTime) {
  EXPECT_FLOAT_EQ(speedIn(12.0f).metresPerSecond(), 2.0f);
  EXPECT_FLOAT_EQ(speedIn(24.0f).metresPerSecond(), 2.0f * speedIn(12.0f).metresPerSecond());
}

TEST(FlySpeed, tinyAndHugeLevelsHaveSpeedsToFlyBy) {
  EXPECT_FLOAT_EQ(speedIn(1e-3f).metresPerSecond(), 0.1f);
  EXPECT_FLOAT_EQ(speedIn(1e6f).metresPerSecond(), 20.0f);
  for (const float none :
       {0.0f, -1.0f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()})
    EXPECT_FLOAT_EQ(speedIn(none).metresPerSecond(), FlySpeed().metresPerSecond()) << none;
}

TEST(FlySpeed, theWheelScalesItThereAndBack) {
  FlySpeed speed = speedIn(12.0f);
  speed.scroll(1.0f);
  EXPECT_FLOAT_EQ(speed.metresPerSecond(), 2.5f);
  speed.scroll(2.0f);
  speed.scroll(-3.0f);
  EXPECT_FLOAT_EQ(speed.metresPerSecond(), 2.0f);
  for (int i = 0; i < 100; ++i) speed.scroll(1.0f);
  EXPECT_FLOAT_EQ(speed.metresPerSecond(), FlySpeed::kFastest);
  speed.scroll(-1e9f);
  EXPECT_FLOAT_EQ(speed.metresPerSecond(), FlySpeed::kSlowest);
  speed.scroll(1.0f);
  EXPECT_FLOAT_EQ(speed.metresPerSecond(), FlySpeed::kSlowest * FlySpeed::kNotch);
}

TEST(FlySpeed, anotherLevelForgetsTheWheel) {
  FlySpeed speed = speedIn(12.0f);
  speed.scroll(5.0f);
  speed.fit(6.0f);
  EXPECT_FLOAT_EQ(speed.metresPerSecond(), 1.0f);
}

TEST(FlySpeed, isToldInFewDigits) {
  EXPECT_EQ(speedIn(12.0f).text(), "2.0 m/s");
  EXPECT_EQ(speedIn(1.5f).text(), "0.25 m/s");
  EXPECT_EQ(speedIn(90.0f).text(), "15 m/s");
  EXPECT_EQ(speedIn(59.8f).text(), "10 m/s");
}

}  // namespace
}  // namespace relume
