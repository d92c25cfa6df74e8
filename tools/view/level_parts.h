// SPDX-License-Identifier: MIT
// The dynamic objects of a level as parts that move through its bake: they shadow and reflect light over links
// (relume/moving_shapes.h), and send what they are shown to emit, whichever backend relights.
#pragma once

#include "relume/bake/scene.h"
#include "relume/lights.h"
#include "relume/moving_shapes.h"
#include "relume/result.h"
#include "tools/gl_scene/gl_level.h"
#include "tools/view/loaded_level.h"
#include "tools/view/view_state.h"

#include <glm/mat4x4.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace relume {

class LevelParts {
 public:
  // None where nothing moves, or more than kMaxMovingParts. The level must outlive them. Errors of MovingShapes.
  static Result<LevelParts> create(const LoadedLevel& level, const ViewState& state);

  // RelightOptions::movingParts
  std::uint32_t count() const { return static_cast<std::uint32_t>(parts_.size()); }
  // Let them emit what a state has: shapes are made anew where a driven material of theirs changes. Errors of
  // MovingShapes, once: what they emitted stays.
  Status emit(const ViewState& state);
  // Place them: moved[k] comes after the own transforms of movingNodes()[k]. [Size moved: movingNodes()]
  void place(std::span<const glm::mat4> moved);
  // With LightSetup::emissionScale: the state's factor, or 1 where that is 0 and a driven material of theirs shines;
  // then all else that emits is to be darkened in another way. Valid until the next place() or emit().
  void addTo(LightSetup& setup) const;

 private:
  const LoadedLevel* level_ = nullptr;
  std::vector<MovingNode> nodes_;
  std::vector<std::uint32_t> emitters_;  // materials of what moves that emit, or may
  Scene scene_;                          // what moves alone, as shapes_ are of it [if there are emitters_]
  float emissionScale_ = 1.0f;
  std::optional<MovingShapes> shapes_;  // of the dynamic instances, in their order
  std::vector<MovingPart> home_;        // those where the level has them
  std::vector<MovingPart> parts_;       // and where they were last placed
};

}  // namespace relume
