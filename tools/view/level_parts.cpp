// SPDX-License-Identifier: MIT
// See level_parts.h.
#include "tools/view/level_parts.h"

#include "tools/render/moving_parts.h"

#include <utility>

namespace relume {

Result<LevelParts> LevelParts::create(const Scene& scene) {
  LevelParts level;
  std::vector<MovingPart> parts = movingParts(scene);
  if (parts.empty() || parts.size() > kMaxMovingParts) return level;
  auto shapes = movingShapes(scene);
  if (!shapes) return shapes.error();
  level.nodes_ = movingNodes(scene);
  level.shapes_.emplace(std::move(*shapes));
  level.home_ = parts;
  level.parts_ = std::move(parts);
  return level;
}

void LevelParts::place(std::span<const glm::mat4> moved) {
  std::size_t part = 0;
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    for (std::uint32_t i = 0; i < nodes_[k].instanceCount; ++i, ++part)
      parts_[part].toWorld = glm::mat4x3(moved[k] * glm::mat4(home_[part].toWorld));
  }
}

void LevelParts::addTo(LightSetup& setup) const {
  setup.movingShapes = shapes_ ? &*shapes_ : nullptr;
  setup.movingParts = parts_;
}

}  // namespace relume
