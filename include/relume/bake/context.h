// SPDX-License-Identifier: MIT
// What a stage of the bake is given beside its data: how to report progress and findings, when to stop, how many
// threads to use, and where to note what it measured. Libraries never print: the command line decides.
#pragma once

#include "relume/result.h"

#include <atomic>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace relume {

enum class Severity { info, warning, error };

// Seconds and named figures of one stage, in the order they were noted. For --report and `relume bench`.
struct StageReport {
  std::string stage;
  double seconds = 0.0;                                 // by the clock
  double processorSeconds = 0.0;                        // of all threads of the process, those of other work included
  std::vector<std::pair<std::string, double>> figures;  // name with unit suffix, value
};

class Context {
 public:
  // Called from any thread, at most a few hundred times a stage. fraction [0..1]; return false to cancel.
  std::function<bool(std::string_view stage, double fraction)> onProgress;
  // Called from any thread: something the user should know, with node names where there are any.
  std::function<void(Severity, std::string_view message)> onMessage;
  int threads = 0;  // [>= 0] 0 = all cores; never changes the result
  // [byte] What the process may hold; 0 = three quarters of what the machine leaves it. A stage that would need more
  // fails before it allocates; never changes the result.
  std::uint64_t maxMemory = 0;

  // Report progress; false when the work should stop (then return cancelledError()).
  bool progress(std::string_view stage, double fraction);
  bool cancelled() const { return cancelled_.load(std::memory_order_relaxed); }
  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }
  void message(Severity severity, std::string_view text);

  // Note a figure of the stage that runs now ("spacing_min_m", 0.04).
  void figure(std::string_view name, double value);
  const std::vector<StageReport>& report() const { return report_; }

  // Scope of a stage: opens its report entry, closes it with the seconds it took.
  class Stage {
   public:
    Stage(Context& context, std::string_view name);
    ~Stage();
    Stage(const Stage&) = delete;
    Stage& operator=(const Stage&) = delete;

   private:
    Context& context_;
    std::size_t entry_;
    std::size_t outer_;
    double begin_;
    double processorsBegin_;
  };

 private:
  std::atomic<bool> cancelled_{false};
  std::mutex mutex_;
  std::vector<StageReport> report_;
  std::size_t current_ = static_cast<std::size_t>(-1);
};

inline Error cancelledError() { return {ErrorCode::failed, "cancelled"}; }

}  // namespace relume
