// SPDX-License-Identifier: MIT
// Wall clock of a pass on the CPU.
#pragma once

#include <chrono>

namespace relume {

class Stopwatch {
 public:
  // [ms] since it was made, or since the last lap.
  double lap() {
    const Clock::time_point now = Clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - begin_).count();
    begin_ = now;
    return ms;
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point begin_ = Clock::now();
};

}  // namespace relume
