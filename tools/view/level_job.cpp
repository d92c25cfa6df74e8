// SPDX-License-Identifier: MIT
// See level_job.h.
#include "tools/view/level_job.h"

#include "tools/base/clock.h"

#include <exception>
#include <new>
#include <utility>

namespace relume {

LevelJob::LevelJob(LevelFiles files, std::optional<Scene> scene) : files_(std::move(files)), begin_(clockSeconds()) {
  if (files_.bakeBy) overall_ = OverallProgress(planBake(*files_.bakeBy, false));
  progress_.stage = "load";
  context_.onProgress = [this](std::string_view stage, double fraction) {
    const std::lock_guard lock(mutex_);
    progress_.stage = std::string(stage);
    progress_.fraction = overall_.known() ? overall_.update(stage, fraction) : fraction;
    progress_.secondsLeft = overall_.known() ? overall_.secondsLeft(clockSeconds() - begin_) : 0.0;
    return true;
  };
  context_.onMessage = [this](Severity severity, std::string_view text) {
    if (severity == Severity::info) return;
    const std::lock_guard lock(mutex_);
    warnings_.emplace_back(text);
  };
  thread_ = std::thread([this, moved = std::move(scene)]() mutable { run(std::move(moved)); });
}

LevelJob::~LevelJob() {
  cancel();
  thread_.join();
}

void LevelJob::run(std::optional<Scene> scene) {
  Result<LevelPtr> result = cancelledError();
  try {
    result = scene ? loadBake(std::move(*scene), files_, context_) : loadLevel(files_, context_);
  } catch (const std::bad_alloc&) {
    result = Error{ErrorCode::memory, "\"" + files_.scene + "\": memory ran out"};
  } catch (const std::exception& e) {
    result = Error{ErrorCode::failed, "\"" + files_.scene + "\": " + e.what()};
  }
  const std::lock_guard lock(mutex_);
  result_.emplace(std::move(result));
}

LevelJob::Progress LevelJob::progress() const {
  const std::lock_guard lock(mutex_);
  return progress_;
}

std::optional<Result<LevelPtr>> LevelJob::takeResult() {
  const std::lock_guard lock(mutex_);
  return std::exchange(result_, std::nullopt);
}

std::vector<std::string> LevelJob::takeWarnings() {
  const std::lock_guard lock(mutex_);
  return std::exchange(warnings_, {});
}

}  // namespace relume
