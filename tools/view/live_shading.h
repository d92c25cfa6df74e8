// SPDX-License-Identifier: MIT
// A level without a bake in the viewer: its state goes to the thread that finds the light (live_job.h), and what that
// finds into the textures that the level is drawn with, and for cones into voxels of the window's own; or that thread
// finds voxels alone, and OpenGL their light (live_on_gpu.h).
#pragma once

#include "tools/gl_scene/gl_level.h"
#include "tools/gl_scene/live_field.h"
#include "tools/view/live_job.h"
#include "tools/view/live_on_gpu.h"
#include "tools/view/loaded_level.h"
#include "tools/view/view_state.h"

#include <memory>
#include <optional>
#include <vector>

namespace relume {

class LiveShading {
 public:
  // Begins to voxelise the level, which must outlive it, about the eye. Errors of LiveField and LiveOnGpu.
  static Result<LiveShading> create(const LoadedLevel& level, const LiveLevelOptions& options,
                                    const GetProcAddress& getProcAddress, const glm::vec3& eyeWorld);

  // Other cells, rays or another backend: what is shown stays until their light is there. Errors of LiveOnGpu, with
  // all as it was.
  Status choose(const LiveLevelOptions& options);
  const LiveLevelOptions& options() const { return options_; }

  // Follow a state, and take over what has been found. What was refused comes back once; the light before it stays.
  // isSlow: a frame takes longer to draw than to light, so that the first one waits for its light.
  // shadows: of these lights. hasCones: voxels are wanted.
  Status update(const ViewState& state, const std::vector<Light>& lights, const ShadowMaps& shadows, bool isSlow,
                bool hasCones);

  // Bind what a program of makeLiveProgram() reads.
  void bind(GLuint program) const;
  const GetProcAddress& getProcAddress() const { return getProcAddress_; }
  // The voxels, for cones, from the outermost volume on, empty where there are none yet; and the sides of each where
  // OpenGL lights them, none where the CPU does and the volumes have their radiance. None of the job's threads reads or
  // writes either.
  std::span<const VoxelVolume> volumes() const;
  std::vector<const gl::LitSides*> sides() const;
  std::uint64_t lit() const { return lit_; }  // changes with their light, counted from 1
  // Whether the CPU lights, and its next frame brings the voxels that cones want.
  bool awaitsVoxels() const {
    return options_.backend == BackendKind::cpu && last_.number > 0 && !isRefused_ && volumes().empty();
  }
  // The last frame's numbers, without texels; number 0 = none yet.
  const LitFrame& last() const { return last_; }
  // What it cost, and what was done once; and what is held.
  std::vector<PassTime> passTimes() const;
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  LiveShading(const LoadedLevel& level, LiveField field, GetProcAddress getProcAddress, const glm::vec3& eyeWorld);
  Status show(LitFrame found);
  void takeVoxels(LitFrame& found);
  Status lightOnGpu(const LiveScene& scene, double step, const ShadowMaps& shadows);
  LiveScene sceneOf(const ViewState& state, const std::vector<Light>& lights) const;

  const LoadedLevel* level_;
  std::vector<MovingNode> nodes_;
  GetProcAddress getProcAddress_;
  LiveField field_;
  glm::vec3 eyeWorld_;                     // of the last state
  float longestSide_ = 0.0f;               // [m] of the level
  std::optional<LiveOnGpu> shown_, next_;  // in place of the field; next_: has no voxels yet
  LiveLevelOptions options_;
  std::vector<VoxelVolume> volumes_;   // that the CPU lights, as of the last frame; empty = no cones want them
  std::optional<LiveScene> followed_;  // that the light is of
  std::uint64_t lit_ = 0;
  bool isRefused_ = false;  // the last that was followed
  std::unique_ptr<LiveJob> job_;
  double clock_ = 0.0;  // [s] of the last frame on the GPU
  LitFrame last_;
};

}  // namespace relume
