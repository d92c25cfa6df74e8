// SPDX-License-Identifier: MIT
// A baked level whose static objects are moved in the viewer: live light of the level as it was baked and as it stands
// now, each by a thread of its own, and where the difference counts (relume/edit_blend.h). Threads begin with the first
// edit, and end when all is put back.
//
// Where an emitter is driven, a change of what any material emits has both levels voxelised anew (driven_scene.h), and
// the light before that stays until then.
#pragma once

#include "relume/result.h"
#include "tools/gl_scene/edit_fields.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/view/driven_scene.h"
#include "tools/view/live_job.h"
#include "tools/view/loaded_level.h"
#include "tools/view/view_state.h"

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace relume {

class EditShading {
 public:
  // The level must outlive it.
  explicit EditShading(const LoadedLevel& level);

  // Static objects that stand elsewhere than in the bake.
  std::size_t edited(const ViewState& state) const;
  // Whether there is an edit, and light for it: what is drawn reads it.
  bool isLit() const { return fields_ && fields_->isLit(); }
  bool isSettled() const { return !before_ || (isLit() && settled_[0] && settled_[1]); }

  // Follow a state, and take over what has been found. Errors of LiveLevel, LiveField and EditBlend; the light before
  // them stays.
  Status update(const ViewState& state, const std::vector<Light>& lights);
  // Before a draw with a program of makeEditedProgram(). [isLit()]
  void bind(GLuint program) const { fields_->bind(program); }
  std::vector<std::pair<std::string, std::size_t>> bufferSizes() const;

 private:
  bool isEdited(const ViewState& state, std::size_t object) const;
  Status begin(const ViewState& state, const LiveLevelOptions& options, const std::optional<glm::vec3>& eyeWorld);
  Status place(const ViewState& state);
  Status take(Result<LitFrame> found, bool isAfter);

  const LoadedLevel* level_;
  std::vector<MovingNode> nodes_;
  float longestSide_ = 0.0f;  // [m] of the level
  std::optional<EditFields> fields_;
  DrivenScene driven_;     // that both lights are of
  float emission_ = 1.0f;  // factor on it
  std::unique_ptr<LiveJob> before_, after_;
  LiveLevelOptions options_;                                      // that they were begun with
  float voxel_ = 0.0f;                                            // [m] of their outermost volumes; 0 = not known yet
  bool found_[2] = {false, false}, settled_[2] = {false, false};  // since they were begun
  std::vector<std::pair<std::string, std::size_t>> bytes_[2];
};

}  // namespace relume
