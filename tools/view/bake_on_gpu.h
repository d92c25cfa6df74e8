// SPDX-License-Identifier: MIT
// Voxels of a level with a bake, for cones: found by a thread of their own (live_job.h), and lit in OpenGL by what the
// bake's surfels send out.
#pragma once

#include "relume/lights.h"
#include "relume/relighter.h"
#include "relume/result.h"
#include "runtime/cones/surfel_voxels.h"
#include "runtime/live_gl/bake_voxels_gl.h"
#include "tools/base/worker_threads.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/gl_scene/shadow_maps.h"
#include "tools/view/driven_scene.h"
#include "tools/view/live_job.h"
#include "tools/view/loaded_level.h"
#include "tools/view/view_state.h"

#include <glm/mat4x4.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace relume {

// What a frame's voxels are lit by.
struct BakeFrame {
  GlResolveInputs inputs;  // of the GL relighter that the level is drawn with
  std::span<const Light> lights;
  const ViewState& state;  // what emits; whether to wait for voxels that have not been found yet
};

class BakeOnGpu {
 public:
  // Of a level with a bake, which must outlive it. cells: as LiveLevelOptions has them.
  // relighter: the GL one that the level is drawn with. Errors of BakeVoxelsGl.
  static Result<std::unique_ptr<BakeOnGpu>> create(const LoadedLevel& level, std::uint32_t cells,
                                                   const Relighter& relighter, const GetProcAddress& getProcAddress);

  // Another GL relighter of the bake, with all as it was where that is refused. Errors of BakeVoxelsGl.
  Status use(const Relighter& relighter);

  // A frame; with the first the voxels begin to be found, and anew where a driven emitter changes what they emit: those
  // before are lit until then. moved: as GlLevel::drawDynamic() has it. What was refused comes back once, and the light
  // before it stays. Changes program, buffer and texture bindings that the viewer sets before each draw. Errors of
  // LiveJob, SurfelVoxels and BakeVoxelsGl.
  Status update(const BakeFrame& frame, std::span<const glm::mat4> moved, const ShadowMaps& shadows);
  // Whether there are voxels, lit as of the last frame; whether others may still come.
  bool isLit() const { return number_ > 0; }
  bool isComing() const { return isComing_; }
  std::uint64_t number() const { return number_; }  // of the last frame, counted from 1

  const VoxelVolume& volume() const { return *volume_; }  // [isLit()]
  const gl::LitSides& sides() const { return voxels_.sides(); }
  std::vector<PassTime> passTimes() const { return voxels_.passTimes(); }
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  BakeOnGpu(const LoadedLevel& level, std::uint32_t cells, BakeVoxelsGl voxels, GetProcAddress getProcAddress);
  void begin(const ViewState& state);
  Status take(std::unique_ptr<VoxelVolume> volume);

  const LoadedLevel* level_;
  std::vector<MovingNode> nodes_;
  std::uint32_t cells_;
  GetProcAddress getProcAddress_;
  BakeVoxelsGl voxels_;
  std::unique_ptr<WorkerThreads> threads_;  // that find the surfels' voxels
  std::unique_ptr<VoxelVolume> volume_;
  std::optional<SurfelVoxels> surfels_;  // of volume_
  float emission_ = 0.0f;                // factor on what volume_ emits
  bool isComing_ = true;
  std::uint64_t number_ = 0;
  DrivenScene driven_;            // that the job is of
  std::unique_ptr<LiveJob> job_;  // null before the first frame
};

}  // namespace relume
