// SPDX-License-Identifier: MIT
// See live_job.h.
#include "tools/view/live_job.h"

#include "tools/base/clock.h"

#include <glm/common.hpp>

#include <chrono>
#include <exception>
#include <new>

namespace relume {
namespace {

// hasVoxels: they are handed over; isNew: of which volumes others than those that were handed over.
LitFrame frameOf(const LiveLevel& level, bool hasLight, bool hasVoxels, const std::vector<bool>& isNew,
                 std::uint64_t number) {
  std::vector<FoundVolume> volumes;
  for (std::size_t l = 0; hasVoxels && l < isNew.size(); ++l) {
    const VoxelVolume& volume = level.volumes()[l];
    FoundVolume& found = volumes.emplace_back();
    if (isNew[l]) found.copy = std::make_unique<VoxelVolume>(volume);
    if (hasLight) found.radiance.assign(volume.radiance().begin(), volume.radiance().end());
  }
  return {hasLight ? texelsOf(level.light()) : LiveTexels{},
          std::move(volumes),
          number,
          level.volumes().stats().occupied,
          level.light().activeCells(),
          level.isSettled(),
          level.passTimes(),
          level.bufferSizes()};
}

}  // namespace

bool takeCopies(LitFrame& found, std::vector<VoxelVolume>& volumes, const ParallelFor& parallelFor) {
  bool any = false;
  for (std::size_t l = 0; l < found.volumes.size(); ++l) {
    const std::unique_ptr<VoxelVolume> copy = std::move(found.volumes[l].copy);
    if (!copy) continue;
    any = true;
    copy->useParallelFor(parallelFor);
    if (l < volumes.size()) {
      volumes[l] = std::move(*copy);
    } else {
      volumes.push_back(std::move(*copy));
    }
  }
  return any;
}

std::optional<glm::vec3> steadyEye(const LiveLevelOptions& options, float longestSide, const glm::vec3& eyeWorld) {
  if (options.cascades == 1) return std::nullopt;
  const float step = 0.25f * longestSide / static_cast<float>(options.cells << (options.cascades - 1));
  return step > 0.0f ? step * glm::floor(eyeWorld / step + 0.5f) : eyeWorld;
}

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
  handedOver_.clear();
  if (!result_ || !*result_) return;
  (*result_)->volumes.clear();
}

// Whether that asks for another frame.
bool LiveJob::changeWish(bool wantsVoxels) {
  if (wantsVoxels_ && !wantsVoxels) dropVoxels();
  return !std::exchange(wantsVoxels_, wantsVoxels) && wantsVoxels;
}

// Who has taken the first frame has drawn it by now.
void LiveJob::comeBack() {
  if (!isFirstTaken_ || std::exchange(isFirstDrawn_, true)) return;
  wake_.notify_all();
}

void LiveJob::follow(LiveScene scene, bool wantsVoxels) {
  const std::lock_guard lock(mutex_);
  comeBack();
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
  if (result_ && *result_ && (*result_)->hasCopies()) dropVoxels();
  next_ = std::move(scene);
  step_ = seconds;
  isWanted_ = isFirstDrawn_ = true;
  result_.reset();
  wake_.notify_all();
}

std::optional<Result<LitFrame>> LiveJob::take(double seconds) {
  std::unique_lock lock(mutex_);
  comeBack();
  if (seconds > 0.0)
    found_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return result_.has_value(); });
  isFirstTaken_ = isFirstTaken_ || result_;
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
    wake_.wait(lock, [&] { return stop_ || (isWanted_ && (number != 2 || isFirstDrawn_)); });
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
    Versions versions;
    std::vector<bool> isNew;
    for (std::size_t l = 0; l < level.volumes().size(); ++l) {
      versions.emplace_back(level.volumes()[l].standingVersion(), level.volumes()[l].movingVersion());
      isNew.push_back(l >= before.size() || versions[l] != before[l]);
    }
    Result<LitFrame> found = status ? Result<LitFrame>(frameOf(level, hasLight, hasVoxels, isNew, number))
                                    : Result<LitFrame>(status.error());
    lock.lock();
    handOver(std::move(found), versions);
    // What is refused once is refused again: wait for something else.
    if (!step && status && !level.isSettled()) isWanted_ = true;
    found_.notify_all();
  }
}

// In place of what nobody has taken yet, whose copies of the voxels are not lost unless newer ones take their place.
void LiveJob::handOver(Result<LitFrame> found, const Versions& versions) {
  LitFrame waits;
  if (result_ && *result_) waits = std::move(**result_);
  if (!found) {
    if (waits.hasCopies()) handedOver_.clear();
  } else {
    if (found->hasCopies()) handedOver_ = versions;
    for (std::size_t l = 0; l < waits.volumes.size() && l < found->volumes.size(); ++l) {
      if (!found->volumes[l].copy) found->volumes[l].copy = std::move(waits.volumes[l].copy);
    }
  }
  result_.emplace(std::move(found));
  if (!wantsVoxels_) dropVoxels();  // since the frame began
}

}  // namespace relume
