// SPDX-License-Identifier: MIT
// When a window may stop drawing all the time: nothing has been asked of it for a while, and its light has had the
// frames to settle.
#pragma once

#include <algorithm>

namespace relume {

class Rest {
 public:
  // Once a frame that is drawn. now [s]; isBusy: input came, or what is drawn changes by itself.
  void frame(double now, bool isBusy) {
    if (!isDue_) frameSeconds_ = now - last_;
    last_ = now;
    if (isBusy) busyAt_ = now;
    frames_ = isBusy ? 0 : frames_ + 1;
    isDue_ = frames_ >= kFrames && now - busyAt_ >= kQuiet;
  }
  bool isDue() const { return isDue_; }

  // How long to wait for input before the next frame, which shows progress, messages and files that have changed [s].
  // Slow frames take a fifth of the time.
  double step() const { return std::max(kStep, 4.0 * frameSeconds_); }

 private:
  static constexpr double kStep = 0.25, kQuiet = 2.0;  // [s]
  // Of bounces: in a room that reflects nine tenths, what is left to come is a thousandth.
  static constexpr int kFrames = 64;

  double busyAt_ = 0.0, last_ = 0.0;  // [s]
  double frameSeconds_ = 0.0;         // of the last one without rest
  int frames_ = 0;                    // since it was busy
  bool isDue_ = false;
};

}  // namespace relume
