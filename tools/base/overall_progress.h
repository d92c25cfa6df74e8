// SPDX-License-Identifier: MIT
// How far a command is with all of its work, from how far it is with a stage.
#pragma once

#include "relume/bake/options.h"

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relume {

// Stages in order, with what each is of the whole; only the shares count.
struct ProgressPlan {
  struct Part {
    std::string stage;
    double weight = 0.0;  // [>= 0]
  };
  std::vector<Part> parts;
};

// The stages of `relume bake`, weighed by what the options ask of each. With `verify`, the second bake's as well. Empty
// where bakes are made until one has an error.
ProgressPlan planBake(const BakeOptions& options, bool verify);

class OverallProgress {
 public:
  explicit OverallProgress(ProgressPlan plan = {}) : plan_(std::move(plan)) {}
  bool known() const { return !plan_.parts.empty(); }

  // [0..1] Of the whole, once `stage` is that far [0..1]. Never less than before: stages that are not in the plan, or
  // come again, change nothing.
  double update(std::string_view stage, double fraction);

  // [s] That are left after `elapsed`, as fast as it went so far; 0 while that is not known.
  double secondsLeft(double elapsed) const;

 private:
  ProgressPlan plan_;
  std::size_t current_ = 0;
  double overall_ = 0.0;
};

}  // namespace relume
