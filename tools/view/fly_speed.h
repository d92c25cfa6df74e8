// SPDX-License-Identifier: MIT
// How fast the camera flies: a level is crossed in some seconds, whatever its size, and the mouse wheel scales that.
#pragma once

#include "bake/base/printed.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace relume {

class FlySpeed {
 public:
  static constexpr float kNotch = 1.25f;                        // of the wheel
  static constexpr float kFast = 4.0f;                          // with Shift
  static constexpr float kSlowest = 0.01f, kFastest = 1000.0f;  // [m/s] that the wheel reaches

  // Fit a level whose box has this diagonal [m]; what the wheel has said of another is forgotten. One that is not a
  // length leaves the speed as it is.
  void fit(float diagonal) {
    if (!(diagonal > 0.0f) || !std::isfinite(diagonal)) return;
    speed_ = std::clamp(diagonal / kSecondsAcross, kSlowestFit, kFastestFit);
  }
  // Notches of the wheel: away from the hand, which is positive, is faster.
  void scroll(float notches) {
    const float scaled = speed_ * std::pow(kNotch, notches);
    if (!std::isnan(scaled)) speed_ = std::clamp(scaled, kSlowest, kFastest);
  }
  float metresPerSecond() const { return speed_; }
  // "2.5 m/s"
  std::string text() const {
    return printed(speed_ >= 9.95f ? "%.0f m/s" : speed_ >= 0.995f ? "%.1f m/s" : "%.2f m/s", speed_);
  }

 private:
  static constexpr float kSecondsAcross = 6.0f;
  // [m/s] A model on a table is not flown through in a blink, nor rooms under a sky that is a ball of a kilometre.
  static constexpr float kSlowestFit = 0.1f, kFastestFit = 20.0f;

  float speed_ = 2.0f;  // [m/s]
};

}  // namespace relume
