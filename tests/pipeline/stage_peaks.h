// SPDX-License-Identifier: MIT
// What the process holds at most during each stage of a bake, beside what the stage had reckoned with.
#pragma once

#include "relume/bake/context.h"

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <map>
#include <string>
#include <string_view>

namespace relume::test {

// Watches the stages of a context's bake, by the system's own peak (Linux), which it sets back as each stage begins.
class StagePeaks {
 public:
  explicit StagePeaks(Context& context) : context_(context) {
    context.onProgress = [this](std::string_view stage, double fraction) {
      if (fraction == 0.0 && stage == context_.report().back().stage) begin(std::string(stage));
      return true;
    };
  }
  // Whether the system lets the peak be set back.
  static bool canMeasure() { return setBack() && peakNow() > 0.0; }

  // [MiB] by stage. Ask once the bake is done.
  std::map<std::string, double> measured() {
    begin("");
    return peak_;
  }
  std::map<std::string, double> reckoned() const {
    std::map<std::string, double> found;
    for (const StageReport& stage : context_.report()) {
      for (const auto& [name, value] : stage.figures) {
        if (name == "memory_estimate_mib") found[stage.stage] = std::max(found[stage.stage], value);
      }
    }
    return found;
  }

 private:
  static bool setBack() { return static_cast<bool>(std::ofstream("/proc/self/clear_refs") << "5" << std::flush); }
  static double peakNow() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
      if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / 1024.0;
    }
    return 0.0;
  }
  void begin(std::string stage) {
    if (!stage_.empty()) peak_[stage_] = peakNow();
    setBack();
    stage_ = std::move(stage);
  }

  Context& context_;
  std::string stage_;
  std::map<std::string, double> peak_;
};

}  // namespace relume::test
