// SPDX-License-Identifier: MIT
// Which memory to bake with next until the certificate says no more than was asked for. Errors fall with about the
// 0.3rd power of the memory, so each step goes where that would reach the goal; a step too far is tried once between.
#pragma once

#include "relume/bake/options.h"

namespace relume {

class ErrorSearch {
 public:
  // largestMiB [> 0]: where it gives up.
  ErrorSearch(double maxError, double largestMiB);

  // [MiB] What to bake with now.
  double memoryMiB() const { return now_; }
  // The bake with memoryMiB() has certified this error [>= 0].
  void note(double error);

  bool isOver() const { return isOver_; }
  // [MiB] The least memory that was good enough; 0 = none was.
  double foundMiB() const { return good_; }

 private:
  double maxError_, largest_, now_;
  double bad_ = 0.0;  // [MiB] the most that was not enough
  double good_ = 0.0;
  bool isOver_ = false, hasRefined_ = false;
};

}  // namespace relume
