// SPDX-License-Identifier: MIT
// A level without a bake in the viewer: its state goes to the thread that finds the light (live_job.h), and what that
// finds into the textures that the level is drawn with.
#pragma once

#include "tools/gl_scene/gl_level.h"
#include "tools/gl_scene/live_field.h"
#include "tools/view/live_job.h"
#include "tools/view/loaded_level.h"
#include "tools/view/view_state.h"

#include <memory>
#include <vector>

namespace relume {

class LiveShading {
 public:
  // Begins to voxelise the level, which must outlive it. Errors of LiveField.
  static Result<LiveShading> create(const LoadedLevel& level, const LiveLevelOptions& options);

  // Other cells or rays: what is shown stays until their light is there.
  void choose(const LiveLevelOptions& options);
  const LiveLevelOptions& options() const { return options_; }

  // Follow a state, and take over what has been found. What was refused comes back once; the light before it stays.
  // isSlow: a frame takes longer to draw than to light, so that the first one waits for its light.
  Status update(const ViewState& state, const std::vector<Light>& lights, bool isSlow);

  const LiveField& field() const { return field_; }
  // The last frame's numbers and costs, without texels; number 0 = none yet.
  const LitFrame& last() const { return last_; }

 private:
  LiveShading(const LoadedLevel& level, LiveField field)
      : level_(&level), nodes_(movingNodes(level.scene, Movable::all)), field_(std::move(field)) {}
  LiveScene sceneOf(const ViewState& state, const std::vector<Light>& lights) const;

  const LoadedLevel* level_;
  std::vector<MovingNode> nodes_;
  LiveField field_;
  LiveLevelOptions options_;
  std::unique_ptr<LiveJob> job_;
  LitFrame last_;
};

}  // namespace relume
