// SPDX-License-Identifier: MIT
// Work that is cancelled while it runs. What is measured is the processor's time that goes by after the cancel, which
// other programs on the machine do not add to.
#pragma once

#include "relume/bake/context.h"

#include <atomic>
#include <chrono>
#include <ctime>
#include <functional>
#include <thread>

namespace relume::test {

inline double processorSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Run work with two threads and cancel it once the processor has worked for so long. Returns the seconds that the
// processor went on after that; below 0: the work had ended before.
inline double processorSecondsAfterCancel(double seconds, const std::function<void(Context&)>& work) {
  Context context;
  context.threads = 2;
  std::atomic<bool> over{false};
  double asked = 0.0;
  const double begin = processorSeconds();
  std::thread clock([&] {
    while (!over && processorSeconds() - begin < seconds) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    asked = processorSeconds();
    context.cancel();
  });
  work(context);
  const double end = processorSeconds();
  over = true;
  clock.join();
  return end - asked;
}

}  // namespace relume::test
