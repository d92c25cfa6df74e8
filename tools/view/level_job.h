// SPDX-License-Identifier: MIT
// A level that is loaded, or baked, on a thread of its own while the window goes on.
#pragma once

#include "relume/bake/context.h"
#include "tools/base/overall_progress.h"
#include "tools/view/loaded_level.h"

#include <atomic>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace relume {

class LevelJob {
 public:
  // Starts at once. `scene`: loadScene() of it, where that has been done.
  explicit LevelJob(LevelFiles files, std::optional<Scene> scene = {});
  // Cancels, and waits until the work has stopped.
  ~LevelJob();
  LevelJob(const LevelJob&) = delete;
  LevelJob& operator=(const LevelJob&) = delete;

  struct Progress {
    std::string stage;
    double fraction = 0.0;     // [0..1] of the whole
    double secondsLeft = 0.0;  // 0 while that is not known
  };
  Progress progress() const;
  void cancel() { context_.cancel(); }
  bool isCancelled() const { return context_.cancelled(); }
  const LevelFiles& files() const { return files_; }

  // What came of it, once it is over; nothing before. Takes it: call again and there is nothing more.
  std::optional<Result<LevelPtr>> takeResult();
  // Warnings so far; each once.
  std::vector<std::string> takeWarnings();

 private:
  void run(std::optional<Scene> scene);

  LevelFiles files_;
  Context context_;
  mutable std::mutex mutex_;  // of what follows
  OverallProgress overall_;
  Progress progress_;
  std::vector<std::string> warnings_;
  std::optional<Result<LevelPtr>> result_;
  double begin_ = 0.0;
  std::thread thread_;
};

}  // namespace relume
