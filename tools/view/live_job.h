// SPDX-License-Identifier: MIT
// Light without a bake on a thread of its own: follows what the window shows, and hands over what each frame of it has
// found, while the window goes on. Sleeps once the light has settled, and while the window draws the first frame: where
// a processor draws, both would take twice as long.
#pragma once

#include "tools/gl_scene/live_field.h"
#include "tools/render/live_level.h"

#include <algorithm>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace relume {

// Voxels of a volume: a copy, if they are others than those that were handed over last, and where the CPU lights them
// what they send out, in the order of VoxelVolume::radiance().
struct FoundVolume {
  std::unique_ptr<VoxelVolume> copy;
  std::vector<VoxelRadiance> radiance;
};

// What a frame has found, and what it cost.
struct LitFrame {
  LiveTexels texels;
  std::vector<FoundVolume> volumes;  // from the outermost on [Size 0 where none are wanted, or all]
  bool hasCopies() const {
    return std::ranges::any_of(volumes, [](const FoundVolume& each) { return each.copy != nullptr; });
  }
  std::uint64_t number = 0;  // counted from 1
  std::uint32_t voxels = 0, caches = 0;
  bool isSettled = false;  // no more come unless something changes
  std::vector<PassTime> times;
  std::vector<std::pair<std::string, std::size_t>> bytes;
};

// Take a frame's copies into the volumes that were taken before; whether there were any. They run by parallelFor.
bool takeCopies(LitFrame& found, std::vector<VoxelVolume>& volumes, const ParallelFor& parallelFor);

// Where volumes in one another about an eye are centred, in a level so long [m]: in steps of a quarter of the smallest
// cell, so that light that has settled sleeps while the eye turns about. Nothing for one volume.
std::optional<glm::vec3> steadyEye(const LiveLevelOptions& options, float longestSide, const glm::vec3& eyeWorld);

class LiveJob {
 public:
  // Starts to voxelise at once; the scene must outlive it.
  // eyeWorld: as LiveLevel::create() has it.
  LiveJob(const Scene& scene, const LiveLevelOptions& options, const std::optional<glm::vec3>& eyeWorld = std::nullopt);
  // Cancels, and waits until the work has stopped.
  ~LiveJob();
  LiveJob(const LiveJob&) = delete;
  LiveJob& operator=(const LiveJob&) = delete;

  // What the light is of from now on. Frames come until it has settled, with the voxels where they are wanted; a frame
  // more comes where they have not been so far. Who no longer wants them keeps none.
  void follow(LiveScene scene, bool wantsVoxels);
  // One frame of it, `seconds` after the one before, and no more.
  void followOnce(LiveScene scene, double seconds, bool wantsVoxels);

  // The newest frame, or what was refused; nothing where there is none since the last call, after so many seconds. A
  // level that cannot be voxelised is refused once, and nothing comes after it. Errors of LiveLevel.
  std::optional<Result<LitFrame>> take(double seconds = 0.0);
  // The same, once there is one; what was refused comes again.
  Result<LitFrame> wait();

 private:
  // Of each volume, from the outermost on: what stands, what moves.
  using Versions = std::vector<std::pair<std::uint64_t, std::uint64_t>>;

  void run(const Scene& scene, const LiveLevelOptions& options, const std::optional<glm::vec3>& eyeWorld);
  void frames(LiveLevel& level, bool hasLight);
  void dropVoxels();
  bool changeWish(bool wantsVoxels);
  void comeBack();
  void handOver(Result<LitFrame> found, const Versions& versions);

  Context context_;
  std::mutex mutex_;  // of what follows
  std::condition_variable wake_, found_;
  std::optional<LiveScene> next_;
  std::optional<double> step_;  // [s] of followOnce()
  bool isWanted_ = false, stop_ = false;
  bool wantsVoxels_ = false;
  bool isFirstTaken_ = false, isFirstDrawn_ = false;  // who has taken a frame draws it, and then comes back
  Versions handedOver_;           // of the copies that were taken, or wait in result_; empty = there are none
  std::optional<Error> refused_;  // why there will be no frames
  std::optional<Result<LitFrame>> result_;
  std::thread thread_;
};

}  // namespace relume
