// SPDX-License-Identifier: MIT
// The dynamic objects of a level as parts that move through its bake: they shadow and reflect light over links
// (relume/moving_shapes.h), whichever backend relights.
#pragma once

#include "relume/bake/scene.h"
#include "relume/lights.h"
#include "relume/moving_shapes.h"
#include "relume/result.h"
#include "tools/gl_scene/gl_level.h"

#include <glm/mat4x4.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace relume {

class LevelParts {
 public:
  // None where nothing moves, or more than kMaxMovingParts. Errors of MovingShapes.
  static Result<LevelParts> create(const Scene& scene);

  // RelightOptions::movingParts
  std::uint32_t count() const { return static_cast<std::uint32_t>(parts_.size()); }
  // Place them: moved[k] comes after the own transforms of movingNodes()[k]. [Size moved: movingNodes()]
  void place(std::span<const glm::mat4> moved);
  // Valid until the next place().
  void addTo(LightSetup& setup) const;

 private:
  std::vector<MovingNode> nodes_;
  std::optional<MovingShapes> shapes_;  // of the dynamic instances, in their order
  std::vector<MovingPart> home_;        // those where the level has them
  std::vector<MovingPart> parts_;       // and where they were last placed
};

}  // namespace relume
