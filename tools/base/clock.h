// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>

namespace relume {

// [s] of a clock that never goes back; any thread.
inline double clockSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace relume
