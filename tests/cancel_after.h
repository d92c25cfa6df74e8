// SPDX-License-Identifier: MIT
// Work that is cancelled while it runs. What goes on after the cancel is measured as a share of the work that was left,
// in the processor's time of one process: a slow or busy machine and sanitizers stretch both alike.
#pragma once

#include "relume/bake/context.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <ctime>
#include <functional>
#include <thread>
#include <utility>

namespace relume::test {

// [s] Of all threads of this process.
inline double processorSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

class CancelledWork {
 public:
  // The work returns whether it was done to its end. It is done once here, to know how much it is.
  explicit CancelledWork(std::function<bool(Context&)> work) : work_(std::move(work)) {
    Context context;
    context.threads = 2;
    const double begin = processorSeconds();
    EXPECT_TRUE(work_(context));
    whole_ = processorSeconds() - begin;
  }

  // Cancel the work once a part `moment` [0..1] of it is done. Returns which share of the rest was done after that:
  // about 1 where the cancel is not heard. A machine that wakes the cancelling thread too late gets further tries, and
  // 0 where none is in time.
  double shareAfterCancel(double moment) const {
    constexpr double kLeastLeft = 0.1;  // of the work, for the share to mean something
    for (int i = 0; i < 8; ++i, moment *= 0.7) {
      Context context;
      context.threads = 2;
      std::atomic<bool> over{false};
      double asked = 0.0;
      const double begin = processorSeconds();
      std::thread clock([&] {
        while (!over && processorSeconds() - begin < moment * whole_)
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        context.cancel();
        asked = processorSeconds();
      });
      const bool isWhole = work_(context);
      const double end = processorSeconds();
      over = true;
      clock.join();
      const double left = whole_ - (asked - begin);
      if (left < kLeastLeft * whole_ || (isWhole && asked >= end)) continue;
      return (end - asked) / left;
    }
    return 0.0;
  }

 private:
  std::function<bool(Context&)> work_;
  double whole_ = 0.0;  // [s] of the processor
};

}  // namespace relume::test
