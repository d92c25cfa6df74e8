// SPDX-License-Identifier: MIT
// Frames of light without a bake in OpenGL, on the window's own thread: voxels come from the thread that finds them
// (live_job.h), shadows from the window's maps.
#pragma once

#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/live_gl/live_caches_gl.h"
#include "tools/base/worker_threads.h"
#include "tools/gl_scene/shadow_maps.h"
#include "tools/render/live_level.h"
#include "tools/view/live_job.h"

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

class LiveOnGpu {
 public:
  // Errors of LiveCachesGl.
  static Result<LiveOnGpu> create(const LiveLevelOptions& options, const GetProcAddress& getProcAddress);

  // Voxels that are lit from now on: those of a frame that are new.
  void take(LitFrame& found);
  // Where light is read from follows the eye, also where it has settled.
  void follow(const glm::vec3& eyeWorld);
  // A frame, `seconds` after the one before; none where light has settled, and false then. Changes program, buffer and
  // texture bindings that the viewer sets before each draw. Errors of LiveCachesGl.
  Result<bool> update(const LiveScene& scene, double seconds, const ShadowMaps& shadows);
  bool isSettled() const { return pace_.isSettled(); }

  const LiveCachesGl& caches() const { return caches_; }
  std::span<const VoxelVolume> volumes() const { return volumes_; }  // from the outermost on
  // Of the last frame that the GPU has finished.
  std::vector<PassTime> passTimes() const { return caches_.passTimes(); }

 private:
  LiveOnGpu(LiveCachesGl caches, unsigned threads)
      : caches_(std::move(caches)), threads_(std::make_unique<WorkerThreads>(threads)) {}

  LiveCachesGl caches_;
  std::unique_ptr<WorkerThreads> threads_;  // that find the caches' places
  std::vector<VoxelVolume> volumes_;        // from the outermost on
  bool isNew_ = false;                      // one of them: not lit yet
  std::optional<LiveScene> last_;
  LivePace pace_;
};

}  // namespace relume
