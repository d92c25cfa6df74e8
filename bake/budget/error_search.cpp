// SPDX-License-Identifier: MIT
// See error_search.h.
#include "bake/budget/error_search.h"

#include <algorithm>
#include <cmath>

namespace relume {
namespace {

constexpr double kFirstMiB = 2.0;    // a second or two of baking
constexpr double kErrorPower = 0.3;  // error ~ memory^-this
// A step: no smaller than pays for a bake, no larger than the guess is worth.
constexpr double kLeastStep = 1.5, kMostStep = 6.0;
constexpr double kRefines = 2.0;  // a step larger than this is tried once between

}  // namespace

ErrorSearch::ErrorSearch(double maxError, double largestMiB)
    : maxError_(maxError), largest_(largestMiB), now_(std::min(kFirstMiB, largestMiB)) {}

void ErrorSearch::note(double error) {
  if (error <= maxError_) {
    good_ = now_;
    isOver_ = hasRefined_ || bad_ == 0.0 || good_ < kRefines * bad_;
    hasRefined_ = true;
    if (!isOver_) now_ = std::sqrt(bad_ * good_);
    return;
  }
  isOver_ = good_ > 0.0 || now_ >= largest_;
  bad_ = now_;
  const double step = std::pow(error / maxError_, 1.0 / kErrorPower);
  now_ = std::min(now_ * std::clamp(step, kLeastStep, kMostStep), largest_);
}

}  // namespace relume
