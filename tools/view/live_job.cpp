// SPDX-License-Identifier: MIT
// See live_job.h.
#include "tools/view/live_job.h"

#include "tools/base/clock.h"

#include <chrono>
#include <exception>
#include <new>
#include <span>

namespace relume {
namespace {

// hasVoxels: they are handed over; isNew: those that were handed over are others.
LitFrame frameOf(const LiveLevel& level, bool hasLight, bool hasVoxels, bool isNew, std::uint64_t number) {
  const std::span<const VoxelRadiance> radiance = level.volume().radiance();
  return {hasLight ? texelsOf(level.light()) : LiveTexels{},
          hasVoxels && isNew ? std::make_unique<VoxelVolume>(level.volume()) : nullptr,
          hasLight && hasVoxels ? std::vector<VoxelRadiance>(radiance.begin(), radiance.end())
                                : std::vector<VoxelRadiance>(),
          number,
          level.volumes().stats().occupied,
          level.light().activeCells(),
          level.isSettled(),
          level.passTimes(),
          level.bufferSizes()};
}

}  // namespace

LiveJob::LiveJob(const Scene& scene, const LiveLevelOptions& options, const std::optional<glm::vec3>& eyeWorld)
    : thread_([this, &scene, options, eyeWorld] { run(scene, options, eyeWorld); }) {}

LiveJob::~LiveJob() {
  context_.cancel();
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

// What waits to be taken goes without its voxels.
void LiveJob::dropVoxels() {
  handedOver_ = {0, 0};
  if (!result_ || !*result_) return;
  (*result_)->volume.reset();
  (*result_)->radiance.clear();
}

// Whether that asks for another frame.
bool LiveJob::changeWish(bool wantsVoxels) {
  if (wantsVoxels_ && !wantsVoxels) dropVoxels();
  return !std::exchange(wantsVoxels_, wantsVoxels) && wantsVoxels;
}

void LiveJob::follow(LiveScene scene, bool wantsVoxels) {
  const std::lock_guard lock(mutex_);
  const bool wantsMore = changeWish(wantsVoxels);
  if (next_ && !step_ && !wantsMore && isSame(*next_, scene) && next_->eyeWorld == scene.eyeWorld) return;
  next_ = std::move(scene);
  step_.reset();
  isWanted_ = true;
  wake_.notify_all();
}

void LiveJob::followOnce(LiveScene scene, double seconds, bool wantsVoxels) {
  const std::lock_guard lock(mutex_);
  changeWish(wantsVoxels);
  if (result_ && *result_ && (*result_)->volume) dropVoxels();
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

void LiveJob::run(const Scene& scene, const LiveLevelOptions& options, const std::optional<glm::vec3>& eyeWorld) {
  Error refused;
  try {
    auto level = LiveLevel::create(scene, options, context_, eyeWorld);
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
  std::unique_lock lock(mutex_);
  for (std::uint64_t number = 1;; ++number) {
    // The first is drawn before others take the processor's time.
    wake_.wait(lock, [&] { return stop_ || (isWanted_ && (number != 2 || !result_)); });
    if (stop_) return;
    const LiveScene now = *next_;
    const std::optional<double> step = step_;
    const bool hasVoxels = wantsVoxels_;
    const Versions before = handedOver_;
    isWanted_ = false;
    lock.unlock();
    const double begin = clockSeconds();
    const Status status = level.update(now, step.value_or(begin - last));
    last = begin;
    const Versions versions(level.volume().standingVersion(), level.volume().movingVersion());
    Result<LitFrame> found = status ? Result<LitFrame>(frameOf(level, hasLight, hasVoxels, versions != before, number))
                                    : Result<LitFrame>(status.error());
    lock.lock();
    handOver(std::move(found), versions);
    // What is refused once is refused again: wait for something else.
    if (!step && status && !level.isSettled()) isWanted_ = true;
    found_.notify_all();
  }
}

// In place of what nobody has taken yet, whose copy of the voxels is not lost unless a newer one takes its place.
void LiveJob::handOver(Result<LitFrame> found, const Versions& versions) {
  std::unique_ptr<VoxelVolume> waits;
  if (result_ && *result_) waits = std::move((*result_)->volume);
  if (found && found->volume) {
    handedOver_ = versions;
  } else if (found) {
    found->volume = std::move(waits);
  } else if (waits) {
    handedOver_ = {0, 0};
  }
  result_.emplace(std::move(found));
  if (!wantsVoxels_) dropVoxels();  // since the frame began
}

}  // namespace relume
