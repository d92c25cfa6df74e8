// SPDX-License-Identifier: MIT
// When a window may rest: after a while and some frames without anything new, and not a frame longer.
#include "tools/view/rest.h"

#include <gtest/gtest.h>

namespace relume {
namespace {

// Frames of `rest` from `now` on, so many a second, until it is due; the time then, or 1000 s.
double dueAfter(Rest& rest, double now, double framesPerSecond) {
  for (double t = now; t < now + 1000.0; t += 1.0 / framesPerSecond) {
    rest.frame(t, false);
    if (rest.isDue()) return t - now;
  }
  return 1000.0;
}

TEST(Rest, takesSecondsOfFastFramesAndManyFramesOfSlowOnes) {
  Rest fast, slow;
  fast.frame(5.0, true);
  slow.frame(5.0, true);
  EXPECT_NEAR(dueAfter(fast, 5.0, 1000.0), 2.0, 0.01);
  EXPECT_NEAR(fast.step(), 0.25, 1e-9);
  EXPECT_NEAR(dueAfter(slow, 5.0, 10.0), 6.3, 0.11);  // of 64 frames
  EXPECT_NEAR(slow.step(), 0.4, 1e-6);
}

TEST(Rest, endsWithWhatIsNewAndComesAgain) {
  Rest rest;
  rest.frame(0.0, true);
  ASSERT_LT(dueAfter(rest, 0.0, 100.0), 1000.0);
  rest.frame(10.0, false);
  EXPECT_TRUE(rest.isDue());
  rest.frame(10.25, true);
  EXPECT_FALSE(rest.isDue());
  EXPECT_NEAR(dueAfter(rest, 10.25, 100.0), 2.0, 0.02);
}

TEST(Rest, neverComesWhileSomethingMoves) {
  Rest rest;
  for (int i = 0; i < 10000; ++i) {
    rest.frame(0.01 * i, i % 100 == 0);
    ASSERT_FALSE(rest.isDue()) << i;
  }
}

}  // namespace
}  // namespace relume
