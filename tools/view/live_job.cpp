// SPDX-License-Identifier: MIT
// See live_job.h.
#include "tools/view/live_job.h"

#include "tools/base/clock.h"

#include <chrono>
#include <exception>
#include <new>

namespace relume {
namespace {

// isNew: the voxels are not those of the frame before.
LitFrame frameOf(const LiveLevel& level, bool hasLight, bool isNew, std::uint64_t number) {
  return {hasLight ? texelsOf(level.light()) : LiveTexels{},
          hasLight || !isNew ? nullptr : std::make_unique<VoxelVolume>(level.volume()),
          number,
          level.volume().stats().occupied,
          level.light().activeCells(),
          level.isSettled(),
          level.passTimes(),
          level.bufferSizes()};
}

}  // namespace

LiveJob::LiveJob(const Scene& scene, const LiveLevelOptions& options)
    : thread_([this, &scene, options] { run(scene, options); }) {}

LiveJob::~LiveJob() {
  context_.cancel();
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void LiveJob::follow(LiveScene scene) {
  const std::lock_guard lock(mutex_);
  if (next_ && !step_ && isSame(*next_, scene)) return;
  next_ = std::move(scene);
  step_.reset();
  isWanted_ = true;
  wake_.notify_all();
}

void LiveJob::followOnce(LiveScene scene, double seconds) {
  const std::lock_guard lock(mutex_);
  next_ = std::move(scene);
  step_ = seconds;
  isWanted_ = true;
  result_.reset();
  wake_.notify_all();
}

std::optional<Result<LitFrame>> LiveJob::take(double seconds) {
  std::unique_lock lock(mutex_);
  if (seconds > 0.0)
    found_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return result_.has_value(); });
  wake_.notify_all();
  return std::exchange(result_, std::nullopt);
}

Result<LitFrame> LiveJob::wait() {
  std::unique_lock lock(mutex_);
  found_.wait(lock, [this] { return result_ || refused_; });
  if (!result_) return *refused_;
  return std::move(*std::exchange(result_, std::nullopt));
}

void LiveJob::run(const Scene& scene, const LiveLevelOptions& options) {
  Error refused;
  try {
    auto level = LiveLevel::create(scene, options, context_);
    if (level) return frames(*level, options.backend == BackendKind::cpu);
    refused = level.error();
  } catch (const std::bad_alloc&) {
    refused = {ErrorCode::memory, "live light: memory ran out; fewer cells take less"};
  } catch (const std::exception& e) {
    refused = {ErrorCode::failed, std::string("live light: ") + e.what()};
  }
  const std::lock_guard lock(mutex_);
  refused_ = refused;
  result_.emplace(std::move(refused));
  found_.notify_all();
}

// Frames of what is followed, until the end.
void LiveJob::frames(LiveLevel& level, bool hasLight) {
  double last = clockSeconds();
  std::pair<std::uint64_t, std::uint64_t> shown{0, 0};  // versions of the volume
  std::unique_lock lock(mutex_);
  for (std::uint64_t number = 1;; ++number) {
    // The first is drawn before others take the processor's time.
    wake_.wait(lock, [&] { return stop_ || (isWanted_ && (number != 2 || !result_)); });
    if (stop_) return;
    const LiveScene now = *next_;
    const std::optional<double> step = step_;
    isWanted_ = false;
    lock.unlock();
    const double begin = clockSeconds();
    const Status status = level.update(now, step.value_or(begin - last));
    last = begin;
    const std::pair versions(level.volume().standingVersion(), level.volume().movingVersion());
    Result<LitFrame> result = status ? Result<LitFrame>(frameOf(level, hasLight, versions != shown, number))
                                     : Result<LitFrame>(status.error());
    lock.lock();
    // A copy that nobody has taken yet is not lost, unless a newer one takes its place.
    std::unique_ptr<VoxelVolume> waits;
    if (result_ && *result_) waits = std::move((*result_)->volume);
    if (result && !result->volume) result->volume = std::move(waits);
    if (status) shown = versions;
    result_.emplace(std::move(result));
    // What is refused once is refused again: wait for something else.
    if (!step && status && !level.isSettled()) isWanted_ = true;
    found_.notify_all();
  }
}

}  // namespace relume
